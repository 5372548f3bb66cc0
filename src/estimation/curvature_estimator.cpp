#include "softarm/estimation/curvature_estimator.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "softarm/model/entire_functions.hpp"

namespace softarm {
namespace {

/// Of the segment's length; a shorter chord has no direction worth judging.
constexpr double kLeastChord = 0.2;

/// 2 atan2(h, v) / h for h >= 0, the factor that turns (v1, v2) into u. For v > 0 it is an even
/// entire-like function of h with the limit 2 / v; the series serves where h / v could underflow or
/// h is zero.
double twice_angle_over(double h, double v) {
  if (v > 0.0) {
    const double x = h / v;
    if (x < 1e-3) {
      const double x2 = x * x;
      return 2.0 / v * (1.0 - x2 * (1.0 / 3.0 - x2 * (1.0 / 5.0 - x2 / 7.0)));
    }
  }
  return 2.0 * std::atan2(h, v) / h;
}

/// The relative transform (19) and what it measures.
struct RelativePose {
  Eigen::Quaterniond q;
  Eigen::Vector3d t;
  double chord;
  Eigen::Vector3d bend;  // (q_y, -q_x, q_w), not normalized, on the side of t
  Eigen::Vector3d axis;  // vector part of q on the same side
};

RelativePose relative_pose(const BodyPose& upper, const BodyPose& lower) {
  const Eigen::Quaterniond to_upper = upper.orientation.normalized().conjugate();
  RelativePose out;
  out.q = to_upper * lower.orientation.normalized();
  out.t = to_upper * (lower.position_m - upper.position_m);
  out.chord = out.t.norm();
  out.bend = Eigen::Vector3d(out.q.y(), -out.q.x(), out.q.w());
  // q and -q are the same rotation: t says which one the bend means; without it theta <= pi.
  const double side = out.chord > 0.0 ? out.bend.dot(out.t) : out.q.w();
  const double sign = side < 0.0 ? -1.0 : 1.0;
  out.bend *= sign;
  out.axis = sign * out.q.vec();
  return out;
}

struct Weights {
  double position;     // of t
  double orientation;  // of the unit bend vector
  double variance;     // of theta
};

/// A PCC segment with the chord direction d = t/|t| has the quaternion q0 = (d_z; -d_y, d_x, 0). The
/// angle about d of what is left of q beyond it, q0^-1 q: 2 atan2(d . q_vector, d . bend), which is
/// alpha where a PCC segment's end is turned about its own axis by alpha.
double torsion_about_chord(const RelativePose& relative) {
  return 2.0 * std::atan2(relative.t.dot(relative.axis), relative.t.dot(relative.bend));
}

/// The best linear combination of the two measurements of theta / 2, see the header; multiplied by
/// |t|^2 so that nothing is divided by a chord that vanishes towards theta = 2 pi.
Weights pose_weights(double position_variance, double upper_variance, double lower_variance,
                     double chord) {
  const double chord2 = chord * chord;
  // The variance of either measurement of theta / 2, and their covariance, times |t|^2.
  const double of_position = position_variance + chord2 * upper_variance;
  const double of_orientation = chord2 * (upper_variance + lower_variance) / 4.0;
  const double common = chord2 * upper_variance / 2.0;
  // With a noisier upper frame the optimum would have a negative weight: it would push the estimate
  // away from the position to undo the common error. That trusts in the noise model and amplifies
  // what t and R disagree on because the arm is no PCC arm. So the position is then left out, which
  // costs nothing with equal frames.
  double w_position = std::max(0.0, of_orientation - common);
  double w_orientation = of_position - common;
  double sum = w_position + w_orientation;
  if (!(sum > 0.0)) {  // both noise-free, or |t| = 0
    w_position = 0.0;
    w_orientation = sum = 1.0;
  }
  w_position /= sum;
  w_orientation /= sum;
  const double half_angle_variance = w_position * w_position * of_position +
                                     2.0 * w_position * w_orientation * common +
                                     w_orientation * w_orientation * of_orientation;
  const double variance = chord2 > 0.0 ? 4.0 * half_angle_variance / chord2 : 0.0;
  return {chord > 0.0 ? w_position / chord : 0.0, w_orientation, variance};
}

/// u from a vector along the mean of both measurements. False where phi means nothing (theta = 2
/// pi) or v is zero.
bool curvature_of(const Eigen::Vector3d& v, Eigen::Vector2d& u) {
  const double h = std::hypot(v.x(), v.y());
  if (!(h > 0.0) && !(v.z() > 0.0)) return false;
  u = twice_angle_over(h, v.z()) * v.head<2>();
  return u.allFinite();
}

/// The chord over the length of a PCC segment, c1(theta^2 / 4) = sin(x) / x with x = theta / 2, and
/// the length by the chord. The radial and transverse parts of the positions' noise are independent:
/// one moves |t|, the other theta, of which l depends by kappa = theta (c2 - c3) / (4 c1) = (1 - x
/// cot x) / theta.
void measure_length(double position_variance, SegmentCurvature& out) {
  const auto c = entire_functions(0.25 * out.u_rad.squaredNorm());
  out.chord_over_length = c[1];
  if (!(out.chord_m > 0.0) || !(c[1] > 0.0)) return;
  const double slope = out.chord_m * out.u_rad.norm() * (c[2] - c[3]) / (4.0 * c[1] * c[1]);
  out.length_m = out.chord_m / c[1];
  out.length_variance_m2 = position_variance / (c[1] * c[1]) + slope * slope * out.variance_rad2;
  out.length_covariance_m_rad = slope * out.variance_rad2;
}

/// (20) as printed. Where arcsin has no value (its argument above 1 from a quaternion's rounding)
/// it takes pi / 2.
bool printed_curvature(const RelativePose& relative, double orientation_variance,
                       Eigen::Vector2d& u, double& variance) {
  const Eigen::Matrix3d R = relative.q.toRotationMatrix();
  const double phi = relative.t.x() == 0.0 && relative.t.y() == 0.0
                         ? 0.0
                         : std::atan(relative.t.y() / relative.t.x());
  const double sine = std::min(1.0, std::hypot(R(0, 2), R(1, 2)));
  const double sign = relative.t.z() < 0.0 ? -1.0 : 1.0;
  const double theta = sign * std::asin(sine);
  u = theta * Eigen::Vector2d(std::cos(phi), std::sin(phi));
  variance = orientation_variance / std::max(1e-6, 1.0 - sine * sine);
  return u.allFinite();
}

double checked_sigma(double value, const char* name, std::size_t body) {
  if (!(value >= 0.0) || !std::isfinite(value)) {
    throw std::invalid_argument(
        fmt::format("noise of body {}: expected a {} >= 0, got {}", body, name, value));
  }
  return value;
}

}  // namespace

std::vector<BodyNoise> body_noise(const EstimationSettings& settings, int segments) {
  const BodyNoise measured{settings.position_noise_m, settings.orientation_noise_rad};
  std::vector<BodyNoise> noise(static_cast<std::size_t>(segments) + 1, measured);
  if (settings.base_is_fixed) noise.front() = BodyNoise{};
  return noise;
}

void CurvatureEstimate::leave_out(int index) noexcept {
  const auto k = static_cast<std::size_t>(index);
  valid[k] = false;
  u_rad.segment<2>(2 * index).setZero();
  variance_rad2[k] = twist_rad[k] = torsion_rad[k] = length_error_m[k] = 0.0;
  length_m[k] = length_covariance_m_rad[k] = 0.0;
  length_variance_m2[k] = std::numeric_limits<double>::infinity();
}

CurvatureEstimator::CurvatureEstimator(const EstimationSettings& settings, const ArmParameters& arm,
                                       std::span<const BodyNoise> noise)
    : method_(settings.method) {
  if (arm.size() < 1 || arm.size() > kMaxSegments) {
    throw std::invalid_argument(
        fmt::format("expected 1 to {} segments, got {}", kMaxSegments, arm.size()));
  }
  const std::size_t n = arm.segments.size();
  if (noise.size() != n + 1) {
    throw std::invalid_argument(
        fmt::format("expected the noise of {} bodies, got {}", n + 1, noise.size()));
  }
  const auto square = [](double x) { return x * x; };
  for (std::size_t i = 0; i < n; ++i) {
    const double length = arm.segments[i].length_m;
    if (!(length > 0.0) || !std::isfinite(length)) {
      throw std::invalid_argument(
          fmt::format("segment {}: expected a length > 0, got {}", i + 1, length));
    }
    segments_.push_back(
        {.length_m = length,
         .position_variance =
             square(checked_sigma(noise[i].position_m, "position noise", i)) +
             square(checked_sigma(noise[i + 1].position_m, "position noise", i + 1)),
         .upper_variance = square(checked_sigma(noise[i].orientation_rad, "orientation noise", i)),
         .lower_variance =
             square(checked_sigma(noise[i + 1].orientation_rad, "orientation noise", i + 1))});
  }
}

SegmentCurvature CurvatureEstimator::segment(int index, const BodyPose& upper,
                                             const BodyPose& lower) const noexcept {
  const SegmentConstants& constants = segments_[static_cast<std::size_t>(index)];
  const RelativePose relative = relative_pose(upper, lower);
  const double bend_norm = relative.bend.norm();
  const double orientation_variance = constants.upper_variance + constants.lower_variance;

  SegmentCurvature out;
  out.chord_m = relative.chord;
  if (!(bend_norm > 0.0) || !std::isfinite(relative.chord)) return out;  // twisted by half a turn
  Eigen::Vector3d v = relative.bend;
  out.variance_rad2 = orientation_variance;
  switch (method_) {
    case CurvatureMethod::printed:
      out.valid = printed_curvature(relative, orientation_variance, out.u_rad, out.variance_rad2);
      break;
    case CurvatureMethod::pose: {
      const Weights weights = pose_weights(constants.position_variance, constants.upper_variance,
                                           constants.lower_variance, relative.chord);
      v = weights.position * relative.t + weights.orientation / bend_norm * relative.bend;
      out.variance_rad2 = relative.chord > 0.0 ? weights.variance : orientation_variance;
      [[fallthrough]];
    }
    case CurvatureMethod::orientation:
      out.valid = curvature_of(v, out.u_rad);
  }
  if (!out.valid) out.u_rad.setZero();
  if (out.valid) measure_length(constants.position_variance, out);
  out.twist_rad = 2.0 * std::atan2(relative.axis.z(), bend_norm);
  // Towards theta = 2 pi the chord vanishes, and with it its direction.
  out.torsion_rad = relative.chord > kLeastChord * constants.length_m
                        ? torsion_about_chord(relative)
                        : out.twist_rad;
  return out;
}

void CurvatureEstimator::estimate(const MocapFrame& frame, CurvatureEstimate& out) const noexcept {
  const int n = segments();
  out.segments = n;
  out.u_rad.setZero(2 * n);
  for (int i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    SegmentCurvature one;
    if (frame.segments == n && frame.body[k].valid && frame.body[k + 1].valid) {
      one = segment(i, frame.body[k], frame.body[k + 1]);
    }
    out.valid[k] = one.valid;
    out.u_rad.segment<2>(2 * i) = one.u_rad;
    out.variance_rad2[k] = one.valid ? one.variance_rad2 : 0.0;
    out.twist_rad[k] = one.valid ? one.twist_rad : 0.0;
    out.torsion_rad[k] = one.valid ? one.torsion_rad : 0.0;
    out.length_error_m[k] =
        one.valid ? one.chord_m - segments_[k].length_m * one.chord_over_length : 0.0;
    out.length_m[k] = one.length_m;
    out.length_variance_m2[k] = one.length_variance_m2;
    out.length_covariance_m_rad[k] = one.length_covariance_m_rad;
  }
}

}  // namespace softarm
