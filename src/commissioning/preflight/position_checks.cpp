#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "commissioning/preflight/geometry.hpp"
#include "softarm/model/entire_functions.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {
namespace {

constexpr double kUnitSlack = 0.25;        ///< of the factor
constexpr double kPlausibleExtent = 2.0;   ///< times or parts of the configured length
constexpr double kLengthTolerance = 0.05;  ///< of the segment
constexpr double kWorldAxes_rad = 0.5;
constexpr double kSagging_rad = 1.2;  ///< the same of an arm whose base is not upright
constexpr double kUpright = 0.9;      ///< cosine of the base's axis and gravity
constexpr double kStill = 0.02;       ///< motion of the end, of the arm's extent
constexpr double kStraight = 0.25;  ///< bodies beside the line through the outermost, of its length

std::vector<std::size_t> seen_bodies(const MeanPoses& rest) {
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < rest.body.size(); ++i)
    if (rest.body[i].valid) out.push_back(i);
  return out;
}

double arc_length_m(const ArmParameters& arm, std::size_t from, std::size_t to) {
  double length_m = 0.0;
  for (std::size_t i = from; i < to; ++i) length_m += arm.segments[i].length_m;
  return length_m;
}

/// Largest distance between two bodies, and what the configuration has for the same.
struct Extent {
  double measured_m = 0.0, configured_m = 0.0;
  std::size_t a = 0, b = 0;  ///< the two bodies
};

Extent extent_of(const ArmParameters& arm, const MeanPoses& rest) {
  Extent out;
  const std::vector<std::size_t> bodies = seen_bodies(rest);
  for (const std::size_t i : bodies)
    for (const std::size_t j : bodies) {
      if (j <= i) continue;
      const double apart_m = (rest.body[i].position_m - rest.body[j].position_m).norm();
      if (apart_m > out.measured_m) {
        out.measured_m = apart_m;
        out.a = i;
        out.b = j;
      }
      out.configured_m = std::max(out.configured_m, arc_length_m(arm, i, j));
    }
  return out;
}

/// Positions along the line through the outermost two bodies, in the direction nearest the
/// configured order.
struct AlongLine {
  std::vector<std::size_t> order;
  double beside = 0.0;  ///< farthest from the line, of its length
};

AlongLine along_line(const MeanPoses& rest, const Extent& extent) {
  AlongLine out{seen_bodies(rest), 0.0};
  const std::vector<std::size_t> configured = out.order;
  const Eigen::Vector3d start_m = rest.body[extent.a].position_m;
  const Eigen::Vector3d line = (rest.body[extent.b].position_m - start_m).normalized();
  const auto along = [&](std::size_t i) { return line.dot(rest.body[i].position_m - start_m); };
  for (const std::size_t i : out.order) {
    const Eigen::Vector3d to = rest.body[i].position_m - start_m;
    out.beside = std::max(out.beside, (to - along(i) * line).norm() / extent.measured_m);
  }
  std::sort(out.order.begin(), out.order.end(),
            [&](std::size_t i, std::size_t j) { return along(i) < along(j); });
  // The line does not show which end is the base: choose the one that leaves more bodies in place.
  const std::vector<std::size_t> reversed(out.order.rbegin(), out.order.rend());
  const auto displaced = [&](const std::vector<std::size_t>& order) {
    std::size_t count = 0;
    for (std::size_t k = 0; k < order.size(); ++k) count += order[k] != configured[k] ? 1 : 0;
    return count;
  };
  if (displaced(reversed) < displaced(out.order)) out.order = reversed;
  return out;
}

const char* nearest_axis(const Eigen::Vector3d& direction) {
  static constexpr std::array kNames{"+x", "-x", "+y", "-y", "+z", "-z"};
  Eigen::Index axis = 0;
  direction.cwiseAbs().maxCoeff(&axis);
  return kNames[static_cast<std::size_t>(2 * axis + (direction[axis] < 0.0 ? 1 : 0))];
}

}  // namespace

std::string place(std::size_t body) {
  return body == 0 ? "base" : fmt::format("end of segment {}", body);
}

Poses poses_of(const Experiment& experiment, const Observation& seen,
               std::vector<BodyPose> SeenFrame::*poses) {
  const int bodies = experiment.arm.size() + 1;
  Poses out{mean_poses(seen, seen.start_ns, seen.rest_end_ns, bodies, poses), {}};
  for (const Pulse& pulse : seen.pulses)
    out.bent.push_back({mean_poses(seen, pulse.before_ns, pulse.start_ns, bodies, poses),
                        mean_poses(seen, pulse.held_ns, pulse.end_ns, bodies, poses)});
  return out;
}

Finding check_still(const Experiment& experiment, const Observation& seen, const MeanPoses& rest) {
  const std::size_t tip = rest.body.size() - 1;
  double sum = 0.0, count = 0.0;
  for (const SeenFrame& frame : seen.frames) {
    if (frame.arrival_ns >= seen.rest_end_ns || !frame.body[tip].valid) continue;
    sum += (frame.body[tip].position_m - rest.body[tip].position_m).squaredNorm();
    count += 1.0;
  }
  const double part = std::sqrt(sum / count) / extent_of(experiment.arm, rest).measured_m;
  const std::string text =
      fmt::format("the end moves by {:.2g} % of the arm's length rms", 100.0 * part);
  if (part <= kStill) return Finding::passed(kStillCheck, text);
  return Finding::failed(
      kStillCheck, text,
      "wait until the arm hangs still, softarm disarm if a daemon moves it; or the camera confuses "
      "two bodies: make their markers differ");
}

Finding check_units(const Experiment& experiment, const MeanPoses& rest) {
  struct Unit {
    const char* name;
    double factor;
  };
  static constexpr std::array kFactors{Unit{"millimetres", 1e3},     Unit{"centimetres", 1e2},
                                       Unit{"inches", 1.0 / 0.0254}, Unit{"feet", 1.0 / 0.3048},
                                       Unit{"kilometres", 1e-3},     Unit{"units of 0.1 km", 1e-2}};
  const Extent extent = extent_of(experiment.arm, rest);
  const double ratio = extent.measured_m / extent.configured_m;
  const std::string text =
      fmt::format("the outermost bodies are {:.4g} m apart, {:.4g} m configured", extent.measured_m,
                  extent.configured_m);
  if (ratio < kPlausibleExtent && ratio > 1.0 / kPlausibleExtent)
    return Finding::passed(kUnits, text);
  const bool configured_mm = experiment.transport.mocap.unit == LengthUnit::millimetre;
  Finding out = Finding::failed(
      kUnits, text,
      fmt::format(
          "the sender's unit of length (daemon.mocap.unit is {}), and arm.length_m in metres",
          configured_mm ? "mm" : "m"));
  for (const Unit& unit : kFactors)
    if (std::abs(ratio / unit.factor - 1.0) < kUnitSlack) {
      if (unit.factor == 1e3 && !configured_mm) out.fix = "daemon.mocap.unit: mm";
      if (unit.factor == 1e-3 && configured_mm) out.fix = "daemon.mocap.unit: m";
      out.text += unit.factor > 1.0
                      ? fmt::format(": positions come in {}", unit.name)
                      : fmt::format(": positions are {:g} times too small, divided twice",
                                    1.0 / unit.factor);
    }
  return out;
}

Finding check_order(const Experiment& experiment, const MeanPoses& rest) {
  const std::vector<std::size_t> configured = seen_bodies(rest);
  if (configured.size() < 3) return Finding::not_checked(kOrder, "fewer than three bodies seen");
  const AlongLine line = along_line(rest, extent_of(experiment.arm, rest));
  if (line.beside > kStraight)
    return Finding::not_checked(
        kOrder, fmt::format("the arm is too curved, {:.0f} % of its length beside a line",
                            100.0 * line.beside));
  if (line.order == configured)
    return Finding::passed(kOrder, "bodies follow one another from base to tip as configured");
  std::vector<std::string> found, wrong;
  for (std::size_t k = 0; k < configured.size(); ++k) {
    found.push_back(place(line.order[k]));
    if (line.order[k] != configured[k]) wrong.push_back(place(configured[k]));
  }
  Finding out = Finding::failed(kOrder,
                                wrong.size() == 2
                                    ? fmt::format("{} and {} are exchanged", wrong[0], wrong[1])
                                    : fmt::format("along the arm come: {}", fmt::join(found, ", ")),
                                "exchange them in daemon.bodies or in the motion capture");
  const BodySettings& bodies = experiment.transport.bodies;
  const auto id = [&](std::size_t body) {
    return body == 0 ? bodies.base_id : bodies.segment_ids[body - 1];
  };
  std::vector<int> ids;
  for (const std::size_t body : line.order) ids.push_back(id(body));
  if (ids.size() == rest.body.size() && bodies.base_id >= 0 &&
      !experiment.transport.mocap.source.named())
    out.fix = fmt::format("daemon.bodies: {{base_id: {}, segment_ids: [{}]}}", ids.front(),
                          fmt::join(ids.begin() + 1, ids.end(), ", "));
  return out;
}

Finding check_world_axes(const Experiment& experiment, const MeanPoses& rest) {
  const ArmParameters& arm = experiment.arm;
  if (!rest.body.front().valid || !rest.body.back().valid)
    return Finding::not_checked(kWorldAxes, "base or tip not seen");
  const Eigen::Vector3d expected = arm.base_rotation.col(2);
  const Eigen::Vector3d measured =
      (rest.body.back().position_m - rest.body.front().position_m).normalized();
  const double off_rad = std::atan2(measured.cross(expected).norm(), measured.dot(expected));
  const bool upright = arm.gravity_mps2.norm() == 0.0 ||
                       std::abs(expected.dot(arm.gravity_mps2.normalized())) > kUpright;
  const std::string text =
      fmt::format("from base to tip the arm points along {} of the motion capture's world",
                  nearest_axis(measured));
  if (off_rad < (upright ? kWorldAxes_rad : kSagging_rad)) return Finding::passed(kWorldAxes, text);
  return Finding::failed(
      kWorldAxes,
      fmt::format("{}, by arm.base it should be {}, {:.2f} rad away", text, nearest_axis(expected),
                  off_rad),
      "daemon.mocap.axes (many systems have y up: y_up), or arm.base.rotation; or base and tip are "
      "exchanged in daemon.bodies");
}

Finding check_lengths(const Experiment& experiment, const MeanPoses& rest, bool curved) {
  std::vector<std::string> wrong;
  std::vector<double> all_m;
  double worst = 0.0;
  for (std::size_t i = 0; i + 1 < rest.body.size(); ++i) {
    if (!rest.body[i].valid || !rest.body[i + 1].valid) continue;
    const double configured_m = experiment.arm.segments[i].length_m;
    double length_m = (rest.body[i + 1].position_m - rest.body[i].position_m).norm();
    if (curved) {
      const SegmentBend bend = segment_bend(rest.body[i], rest.body[i + 1], kAsConfigured);
      const double half_rad =
          std::atan2(bend.by_orientation.head<2>().norm(), bend.by_orientation.z());
      length_m /= entire_functions(half_rad * half_rad)[1];
    }
    const double off = length_m / configured_m - 1.0;
    worst = std::max(worst, std::abs(off));
    all_m.push_back(std::round(1e4 * length_m) * 1e-4);
    if (std::abs(off) > kLengthTolerance)
      wrong.push_back(fmt::format("segment {} is {:.4f} m long, {:.4f} m configured", i + 1,
                                  length_m, configured_m));
  }
  if (wrong.empty())
    return Finding::passed(
        "lengths",
        fmt::format("segments are as long as configured within {:.1f} %", 100.0 * worst));
  return Finding::failed(
      "lengths", fmt::format("{}", fmt::join(wrong, "; ")),
      fmt::format("measure from body to body: arm.length_m: [{:.4g}]", fmt::join(all_m, ", ")));
}

}  // namespace softarm
