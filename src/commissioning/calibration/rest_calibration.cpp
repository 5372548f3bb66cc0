#include "softarm/commissioning/calibration/rest_calibration.hpp"

#include <fmt/format.h>

#include <cmath>
#include <span>
#include <stdexcept>

#include "softarm/estimation/curvature_estimator.hpp"
#include "softarm/model/statics.hpp"
#include "softarm/transport/pose_convention.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {
namespace {

constexpr std::size_t kFewestFrames = 50;

Eigen::Isometry3d pose_of(const MarkerFrameSettings& frame) {
  return to_isometry(pose_on_body(frame));
}

/// The shape that gravity gives the arm without pressure.
Eigen::VectorXd hanging_shape(const ArmParameters& arm) {
  if (const auto u = rest_shape(arm, Eigen::VectorXd::Zero(arm.dof()))) return *u;
  throw std::runtime_error(
      "the model has no shape at rest near straight: expected stiffness that holds the arm's "
      "weight (arm.stiffness_nm_per_rad, arm.mass_kg, arm.base.rotation)");
}

std::vector<RestReading> read_segments(const Experiment& experiment, const BodySettings& bodies,
                                       std::span<const Eigen::Isometry3d> mean) {
  const ArmParameters& arm = experiment.arm;
  const CurvatureEstimator estimator(experiment.estimation, arm,
                                     body_noise(experiment.estimation, arm.size()));
  MocapFrame frame;
  frame.segments = arm.size();
  for (std::size_t i = 0; i < mean.size(); ++i) {
    Eigen::Isometry3d pose = mean[i];
    if (i > 0) pose = pose * pose_of(bodies.segment_marker_frames[i - 1]);
    if (i == 0 && bodies.base_id >= 0) pose = pose * pose_of(bodies.base_marker_frame);
    frame.body[i] = {pose.translation(), Eigen::Quaterniond(pose.linear()), true};
  }
  CurvatureEstimate estimate;
  estimator.estimate(frame, estimate);
  std::vector<RestReading> out(static_cast<std::size_t>(arm.size()));
  for (std::size_t i = 0; i < out.size(); ++i)
    out[i] = {estimate.u_rad.segment<2>(2 * static_cast<Eigen::Index>(i)), estimate.twist_rad[i],
              estimate.length_error_m[i], estimate.valid[i]};
  return out;
}

/// Turns `base`, about its own origin, the shortest way to where the arm's axis ought to point.
Eigen::Isometry3d levelled(const Eigen::Isometry3d& base, const ArmParameters& arm) {
  const Eigen::Vector3d axis = base.linear().col(2), wanted = arm.base_rotation.col(2);
  Eigen::Isometry3d out = base;
  out.linear() =
      Eigen::Quaterniond::FromTwoVectors(axis, wanted).toRotationMatrix() * base.linear();
  return out;
}

BodySettings plates_from(const Experiment& experiment, const Eigen::VectorXd& rest_u_rad,
                         std::span<const Eigen::Isometry3d> mean, BaseSource source) {
  BodySettings out = experiment.transport.bodies;
  const bool fixed = out.base_id < 0;
  Eigen::Isometry3d base = fixed ? mean[0] : mean[0] * pose_of(out.base_marker_frame);
  if (!fixed && source == BaseSource::arm) base = levelled(base, experiment.arm);
  ArmParameters at_base = experiment.arm;
  at_base.base_position_m = base.translation();
  at_base.base_rotation = base.linear();
  const std::vector<Eigen::Isometry3d> found = frames_on_bodies(at_base, rest_u_rad, mean);
  if (!fixed && source == BaseSource::arm)
    out.base_marker_frame = with_pose_on_body(out.base_marker_frame, found[0]);
  out.segment_marker_frames.resize(found.size() - 1);
  for (std::size_t i = 1; i < found.size(); ++i)
    out.segment_marker_frames[i - 1] =
        with_pose_on_body(out.segment_marker_frames[i - 1], found[i]);
  return out;
}

std::string body_name(std::size_t i) { return i == 0 ? "base" : fmt::format("segment {}", i); }

/// Poses of every body over time; one pose of a fixed base.
std::vector<std::vector<TimedPose>> gather(const Experiment& experiment,
                                           const std::vector<MocapFrame>& frames) {
  const auto bodies = static_cast<std::size_t>(experiment.arm.size()) + 1;
  std::vector<std::vector<TimedPose>> out(bodies);
  std::vector<std::size_t> unseen(bodies, 0);
  for (const MocapFrame& frame : frames) {
    bool all = true;
    for (std::size_t i = 0; i < bodies; ++i) {
      const BodyPose& body = frame.body[i];
      const bool usable =
          body.valid && body.position_m.allFinite() &&
          std::abs(body.orientation.norm() - 1.0) <= experiment.estimation.quaternion_tolerance;
      if (!usable) ++unseen[i];
      all = all && usable;
    }
    const bool later = out[0].empty() || frame.capture_ns > out[0].back().time_ns;
    for (std::size_t i = 0; i < bodies && all && later; ++i)
      out[i].push_back({frame.capture_ns, frame.body[i].position_m, frame.body[i].orientation});
  }
  if (out[0].size() >= kFewestFrames) return out;
  std::string who;
  for (std::size_t i = 0; i < bodies; ++i)
    if (unseen[i] > 0)
      who += fmt::format("; {} was not seen (or sent no pose) in {}", body_name(i), unseen[i]);
  throw std::runtime_error(fmt::format(
      "expected at least {} frames with every body, got {} of {}{}; see daemon.bodies for the "
      "expected bodies, or give a longer --duration",
      kFewestFrames, out[0].size(), frames.size(), who));
}

void expect_still(const std::vector<PoseStatistics>& bodies) {
  std::string moving;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const PoseStatistics& body = bodies[i];
    if (body.still()) continue;
    moving += fmt::format(
        "{} is out of tolerance: {:.2f} mm and {:.1f} mrad from its mean (limits {:.2f} mm, {:.1f} "
        "mrad); ",
        body_name(i), 1e3 * body.wander_m, 1e3 * body.wander_rad, 1e3 * body.wander_limit_m,
        1e3 * body.wander_limit_rad);
  }
  if (!moving.empty())
    throw std::runtime_error("the arm moves: " + moving +
                             "let it hang without pressure (softarm disarm) until it is still, and "
                             "check that no marker is loose");
}

std::vector<Eigen::Isometry3d> means(const std::vector<std::vector<TimedPose>>& poses, bool fixed,
                                     std::size_t first, std::size_t count) {
  std::vector<Eigen::Isometry3d> out;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const auto part = std::span(poses[i]).subspan(first, count);
    if (i == 0 && fixed) {  // exactly, not through a mean
      Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
      pose.linear() = part[0].orientation.toRotationMatrix();
      pose.translation() = part[0].position_m;
      out.push_back(pose);
    } else {
      out.push_back(pose_statistics(part).mean);
    }
  }
  return out;
}

std::string bodies_text(const RestCalibration& found) {
  std::string text = fmt::format("{:<12}{:>7}{:>22}{:>26}{:>24}\n", "body", "frames",
                                 "spread an axis", "error of the mean", "largest deviation");
  for (std::size_t i = 0; i < found.body.size(); ++i) {
    const PoseStatistics& body = found.body[i];
    if (body.frames == 0) continue;
    text += fmt::format(
        "{:<12}{:>7}{:>8.3f} mm {:>5.2f} mrad{:>12.4f} mm {:>6.3f} mrad{:>10.3f} mm "
        "{:>5.2f} mrad\n",
        body_name(i), body.frames, 1e3 * body.position_spread_m, 1e3 * body.orientation_spread_rad,
        1e3 * body.position_error_m, 1e3 * body.orientation_error_rad, 1e3 * body.wander_m,
        1e3 * body.wander_rad);
  }
  return text;
}

std::string plates_text(const BodySettings& before, const RestCalibration& found) {
  std::string text =
      "\nmarker frames: pose of S_i on its body, and the distance from the configured one\n";
  for (std::size_t i = before.base_id < 0 ? 1 : 0; i < found.body.size(); ++i) {
    const MarkerFrameSettings& now =
        i == 0 ? found.bodies.base_marker_frame : found.bodies.segment_marker_frames[i - 1];
    MarkerFrameSettings was = before.base_marker_frame;
    if (i > 0)
      was = i <= before.segment_marker_frames.size() ? before.segment_marker_frames[i - 1]
                                                     : MarkerFrameSettings{};
    const Eigen::Isometry3d from = pose_of(was).inverse() * pose_of(now);
    const Eigen::Vector3d mm = 1e3 * now.position_m, mrad = 1e3 * now.rotation_rad;
    text += fmt::format(
        "{:<12}[{:.2f}, {:.2f}, {:.2f}] mm, turned by [{:.2f}, {:.2f}, {:.2f}] mrad; {:.2f} mm and "
        "{:.2f} mrad away\n",
        body_name(i), mm.x(), mm.y(), mm.z(), mrad.x(), mrad.y(), mrad.z(),
        1e3 * from.translation().norm(), 1e3 * std::abs(Eigen::AngleAxisd(from.linear()).angle()));
  }
  return text;
}

std::string readings_text(const RestCalibration& found) {
  std::string text = fmt::format("\n{:<12}{:<24}{:<50}{}\n", "at rest", "u expected",
                                 "before: u, twist, length too long by", "after: the same");
  const auto reading = [](const RestReading& read) {
    if (!read.valid) return std::string("fits no bend");
    return fmt::format("[{:.2f}, {:.2f}] mrad, {:.2f} mrad, {:.2f} mm", 1e3 * read.u_rad.x(),
                       1e3 * read.u_rad.y(), 1e3 * read.twist_rad, 1e3 * read.length_error_m);
  };
  for (std::size_t i = 0; i < found.before.size(); ++i) {
    const auto k = 2 * static_cast<Eigen::Index>(i);
    text += fmt::format("{:<12}{:<24}{:<50}{}\n", body_name(i + 1),
                        fmt::format("[{:.2f}, {:.2f}] mrad", 1e3 * found.rest_u_rad[k],
                                    1e3 * found.rest_u_rad[k + 1]),
                        reading(found.before[i]), reading(found.after[i]));
  }
  return text +
         "(after: the second half of the frames, with the marker frames from the first half)\n";
}

}  // namespace

RestCalibration calibrate_rest(const Experiment& experiment, const std::vector<MocapFrame>& frames,
                               BaseSource base) {
  const auto poses = gather(experiment, frames);
  const bool fixed = experiment.transport.bodies.base_id < 0;
  const std::size_t count = poses[0].size();
  RestCalibration out;
  out.body.resize(poses.size());
  for (std::size_t i = fixed ? 1 : 0; i < poses.size(); ++i)
    out.body[i] = pose_statistics(poses[i]);
  expect_still(out.body);
  out.rest_u_rad = hanging_shape(experiment.arm);
  const auto all = means(poses, fixed, 0, count);
  const auto first = means(poses, fixed, 0, count / 2);
  const auto second = means(poses, fixed, count / 2, count - count / 2);
  out.bodies = plates_from(experiment, out.rest_u_rad, all, base);
  BodySettings configured = experiment.transport.bodies;
  configured.segment_marker_frames.resize(poses.size() - 1);
  out.before = read_segments(experiment, configured, all);
  out.after =
      read_segments(experiment, plates_from(experiment, out.rest_u_rad, first, base), second);
  if (!fixed) {
    const Eigen::Matrix3d read = (all[0] * pose_of(configured.base_marker_frame)).linear();
    const double cosine = read.col(2).dot(experiment.arm.base_rotation.col(2));
    const double sine = read.col(2).cross(experiment.arm.base_rotation.col(2)).norm();
    out.base_tilt_rad = std::atan2(sine, cosine);
  }
  return out;
}

std::string calibration_text(const Experiment& experiment, const RestCalibration& found) {
  std::string text =
      bodies_text(found) + plates_text(experiment.transport.bodies, found) + readings_text(found);
  if (experiment.transport.bodies.base_id >= 0)
    text += fmt::format(
        "\nthe arm's axis at the base was {:.2f} mrad from arm.base.rotation, which "
        "gives the model the direction of gravity; --base arm uses that instead\n",
        1e3 * found.base_tilt_rad);
  text +=
      "not determined by an arm at rest: the position of the base, its rotation about the arm's "
      "axis "
      "(so the direction phi = 0), and lengths: their errors are now part of the marker frames\n";
  return text;
}

std::string calibrated_yaml(const RestCalibration& found, const std::string& note,
                            const std::string& config) {
  const auto row = [&](const MarkerFrameSettings& each) {
    const Eigen::Vector3d &p = each.position_m, &r = each.rotation_rad;
    return fmt::format(
        "{{{}position_m: [{:.9f}, {:.9f}, {:.9f}], rotation_rad: [{:.9f}, {:.9f}, {:.9f}]}}",
        !each.name.empty() ? fmt::format("name: {}, ", each.name) : "", p.x(), p.y(), p.z(), r.x(),
        r.y(), r.z());
  };
  std::string text = fmt::format("# {}\ninclude: {}\n\ndaemon:\n  bodies:\n", note, config);
  if (found.bodies.base_id >= 0)
    text += fmt::format("    base_plate: {}\n", row(found.bodies.base_marker_frame));
  text += "    segment_plates:\n";
  for (const MarkerFrameSettings& each : found.bodies.segment_marker_frames)
    text += fmt::format("      - {}\n", row(each));
  return text;
}

}  // namespace softarm
