#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "commissioning/preflight/geometry.hpp"
#include "softarm/model/coordinates.hpp"
#include "softarm/model/statics.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {
namespace {

constexpr double kNormTolerance = 0.02;
constexpr double kAskew_rad = 0.05;

/// Names of all readings that fit: for a hanging arm two of them may be the same.
std::vector<std::string> hands_that_fit(const Poses& poses) {
  std::vector<std::string> names;
  for (const Reading& reading : wrong_hands())
    if (fit_of(reading, poses.rest, poses.bent).convinces()) names.emplace_back(reading.name);
  return names;
}

}  // namespace

Finding check_quaternions(const Experiment& experiment, const Poses& poses,
                          const Poses& in_other_order) {
  for (std::size_t i = 0; i < poses.rest.body.size(); ++i) {
    const BodyPose& body = poses.rest.body[i];
    if (body.valid && std::abs(body.orientation.norm() - 1.0) >= kNormTolerance)
      return Finding::failed(
          kQuaternions,
          fmt::format("{}: a quaternion of length {:.3f}, expected 1", place(i),
                      body.orientation.norm()),
          "the sender must send unit quaternions; if it is far off, other numbers are sent");
  }
  const ReadingFit fit = fit_of(kAsConfigured, poses.rest, poses.bent);
  const ReadingFit other = fit_of(kAsConfigured, in_other_order.rest, in_other_order.bent);
  std::string text = fmt::format(
      "chords and orientations of segments agree within {:.3f} rad at rest", fit.at_rest_rad);
  if (fit.has_bent) text += fmt::format(", {:.0f} % when bent", 100.0 * fit.bent);
  if (fit.fits() && !other.convinces()) return Finding::passed(kQuaternions, text);
  if (fit.fits())
    return Finding::not_checked(
        kQuaternions, text +
                          "; as long as the arm is straight, so they would in the other order: "
                          "--pulse bends it");
  if (other.convinces())
    return Finding::failed(
        kQuaternions,
        fmt::format("w, x, y, z and x, y, z, w are interchanged: as configured, chords and "
                    "orientations disagree by {:.2f} rad, in the other order by {:.3f} rad",
                    fit.at_rest_rad, other.at_rest_rad),
        fmt::format(
            "daemon.mocap.quaternion: {}",
            experiment.transport.mocap.quaternion == QuaternionOrder::wxyz ? "xyzw" : "wxyz"));
  if (!hands_that_fit(poses).empty())
    return Finding::not_checked(kQuaternions, text + "; neither order fits, see handedness");
  return Finding::failed(
      kQuaternions,
      fmt::format("chords and orientations disagree by {:.2f} rad in either order",
                  fit.at_rest_rad),
      "set the bodies' axes: z of every body along the arm, away from the base, x towards the "
      "angle 0 of the chambers");
}

Finding check_handedness(const Poses& poses, const Poses& in_other_order) {
  const char* check = "handedness";
  const ReadingFit fit = fit_of(kAsConfigured, poses.rest, poses.bent);
  const std::vector<std::string> hands = hands_that_fit(poses);
  if (fit.fits() && hands.empty())
    return Finding::passed(check, "positions and orientations bend the same way");
  if (fit.fits())
    return Finding::not_checked(
        check,
        fit.has_bent
            ? "the arm bent in one plane only; a mirrored world would look the same"
            : "the arm hangs straight, where a mirrored world looks the same; --pulse bends it");
  if (hands.empty() || fit_of(kAsConfigured, in_other_order.rest, in_other_order.bent).convinces())
    return Finding::not_checked(check, "fix the quaternions first");
  return Finding::failed(check,
                         fmt::format("positions and orientations do not belong together; {} would",
                                     fmt::join(hands, " or ")),
                         "make the sender's world right-handed, positions and orientations alike, "
                         "from body to world");
}

Finding check_rest_pose(const Experiment& experiment, const MeanPoses& rest) {
  const char* check = "rest pose";
  Eigen::VectorXd u_rad;
  if (!curvature_of(experiment, rest, u_rad))
    return Finding::not_checked(check, "not every segment seen");
  const ArmParameters arm = at_rest_length(experiment.arm);
  DynamicsWorkspace workspace(arm);
  Eigen::VectorXd off_nm(arm.dof());
  static_moments(arm, workspace, u_rad, off_nm);
  std::vector<std::string> wrong;
  double bend_rad = 0.0, twist_rad = 0.0;
  for (std::size_t i = 0; i + 1 < rest.body.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(2 * i);
    const double bend =
        off_nm.segment<2>(k).norm() / experiment.arm.segments[i].stiffness_nm_per_rad;
    const double twist = segment_bend(rest.body[i], rest.body[i + 1], kAsConfigured).twist_rad;
    bend_rad = std::max(bend_rad, bend);
    twist_rad = std::max(twist_rad, std::abs(twist));
    if (bend > kAskew_rad)
      wrong.push_back(
          fmt::format("segment {} reads ({:.3f}, {:.3f}) rad, {:.3f} rad from where it would rest",
                      i + 1, u_rad[k], u_rad[k + 1], bend));
    if (std::abs(twist) > kAskew_rad)
      wrong.push_back(fmt::format("segment {} is twisted by {:.3f} rad", i + 1, twist));
  }
  if (wrong.empty())
    return Finding::passed(
        check, fmt::format("bent by {:.3f} rad from its equilibrium, twisted by {:.3f} rad at most",
                           bend_rad, twist_rad));
  return Finding::failed(
      check, fmt::format("{}", fmt::join(wrong, "; ")),
      "softarm calibrate, with the arm at rest (daemon.bodies.base_plate, segment_plates)");
}

std::vector<Finding> check_geometry(const Experiment& experiment, const Observation& seen) {
  const Poses poses = poses_of(experiment, seen, &SeenFrame::body);
  const Poses in_other_order = poses_of(experiment, seen, &SeenFrame::in_other_order);
  const auto count = std::count_if(poses.rest.body.begin(), poses.rest.body.end(),
                                   [](const BodyPose& body) { return body.valid; });
  static constexpr std::array kRest{kUnits,       kOrder,       kWorldAxes, "lengths",
                                    kQuaternions, "handedness", "rest pose"};
  std::vector<Finding> out;
  if (count < 2 || !poses.rest.body.back().valid) {
    out.push_back(Finding::not_checked(kStillCheck, "too few bodies seen"));
    for (const char* check : kRest)
      out.push_back(Finding::not_checked(check, "too few bodies seen"));
    return out;
  }
  out.push_back(check_still(experiment, seen, poses.rest));
  if (failed(out, kStillCheck)) {
    for (const char* check : kRest) out.push_back(Finding::not_checked(check, "the arm moves"));
    return out;
  }
  out.push_back(check_units(experiment, poses.rest));
  out.push_back(check_order(experiment, poses.rest));
  out.push_back(check_world_axes(experiment, poses.rest));
  const bool ordered = !failed(out, kUnits) && !failed(out, kOrder);
  const Finding quaternions = failed(out, kOrder)
                                  ? Finding::not_checked(kQuaternions, "fix the order first")
                                  : check_quaternions(experiment, poses, in_other_order);
  const bool readable = quaternions.verdict != Verdict::fail && !failed(out, kOrder);
  out.push_back(ordered ? check_lengths(experiment, poses.rest, readable)
                        : Finding::not_checked("lengths", "fix units and order first"));
  out.push_back(quaternions);
  out.push_back(failed(out, kOrder) ? Finding::not_checked("handedness", "fix the order first")
                                    : check_handedness(poses, in_other_order));
  out.push_back(ordered && readable && !failed(out, "handedness")
                    ? check_rest_pose(experiment, poses.rest)
                    : Finding::not_checked("rest pose", "fix what failed above first"));
  return out;
}

}  // namespace softarm
