#include "softarm/estimation/curvature_filter.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace softarm {
namespace {

// Prediction ends at this scaled horizon, and the memory with a gap of twice that.
constexpr double kMaxHorizon = 2.0;
// Of a frame: a segment whose memory has faded to less is no longer predicted, however many frames
// may be.
constexpr double kLeastWeight = 1e-6;

/// sum over m of b(a) b(a)' with b = (1, -a, a^2 / 2), from the moments of the scaled age a.
Eigen::Matrix3d normal_matrix(const std::array<double, 5>& moment) {
  Eigen::Matrix3d M;
  M << moment[0], -moment[1], moment[2] / 2.0,  //
      -moment[1], moment[2], -moment[3] / 2.0,  //
      moment[2] / 2.0, -moment[3] / 2.0, moment[4] / 4.0;
  return M;
}

/// sum over k >= 0 of x^k (k step)^m for m = 0 .. 4.
std::array<double, 5> geometric_moments(double x, double step) {
  const double d = 1.0 - x;
  const double h = step;
  return {1.0 / d, h * x / (d * d), h * h * x * (1.0 + x) / std::pow(d, 3),
          std::pow(h, 3) * x * (1.0 + x * (4.0 + x)) / std::pow(d, 4),
          std::pow(h, 4) * x * (1.0 + x * (11.0 + x * (11.0 + x))) / std::pow(d, 5)};
}

}  // namespace

bool FilteredMotion::all_valid() const noexcept {
  return segments > 0 &&
         std::all_of(valid.begin(), valid.begin() + segments, [](bool v) { return v; });
}

FilterNoise filter_noise(double bandwidth_radps, double period_s, double horizon_s) {
  const double step = bandwidth_radps * period_s;
  const double ahead = bandwidth_radps * horizon_s;
  // With weights w the fit is c = M^-1 sum w b y; independent measurements give it the covariance
  // M^-1 N M^-1.
  const Eigen::Matrix3d M = normal_matrix(geometric_moments(std::exp(-step), step));
  const Eigen::Matrix3d N = normal_matrix(geometric_moments(std::exp(-2.0 * step), step));
  const Eigen::LDLT<Eigen::Matrix3d> factor(M);
  const Eigen::Vector3d u = factor.solve(Eigen::Vector3d(1.0, ahead, ahead * ahead / 2.0));
  const Eigen::Vector3d velocity = factor.solve(Eigen::Vector3d(0.0, 1.0, ahead));
  return {std::sqrt(u.dot(N * u)), bandwidth_radps * std::sqrt(velocity.dot(N * velocity))};
}

CurvatureFilter::CurvatureFilter(const EstimationSettings& settings, int segments)
    : bandwidth_radps_(settings.filter_bandwidth_radps),
      predicted_frames_(settings.predicted_frames) {
  if (segments < 1 || segments > kMaxSegments) {
    throw std::invalid_argument(
        fmt::format("expected 1 to {} segments, got {}", kMaxSegments, segments));
  }
  if (!(bandwidth_radps_ > 0.0) || !std::isfinite(bandwidth_radps_)) {
    throw std::invalid_argument(
        fmt::format("expected a filter bandwidth > 0 rad/s, got {}", bandwidth_radps_));
  }
  if (predicted_frames_ < 0) {
    throw std::invalid_argument(
        fmt::format("expected predicted_frames >= 0, got {}", predicted_frames_));
  }
  memory_.resize(static_cast<std::size_t>(segments));
  known_.resize(static_cast<std::size_t>(segments));
  reset();
}

void CurvatureFilter::reset() noexcept {
  for (Memory& memory : memory_) {
    start(memory, Eigen::Vector2d::Zero());
    memory.valid = false;
  }
  for (Quadratic& known : known_) known.fill(Eigen::Vector2d::Zero());
  has_known_ = false;
  has_frame_ = false;
  newest_ns_ = 0;
}

CurvatureFilter::Quadratic CurvatureFilter::known_at(int segment,
                                                     double scaled_time) const noexcept {
  const Quadratic& k = known_[static_cast<std::size_t>(segment)];
  const double h = scaled_time;
  return {k[0] + h * k[1] + (h * h / 2.0) * k[2], k[1] + h * k[2], k[2]};
}

void CurvatureFilter::adopt(const KnownMotion* known, double step) noexcept {
  const bool usable = known != nullptr && known->u_rad.size() == 2 * std::ssize(known_) &&
                      known->velocity_radps.size() == known->u_rad.size() &&
                      known->acceleration_radps2.size() == known->u_rad.size();
  const bool changed = usable != has_known_ || (usable && known->source != source_);
  const double per_scaled_time = 1.0 / bandwidth_radps_;
  for (int i = 0; i < static_cast<int>(known_.size()); ++i) {
    Quadratic now;
    now.fill(Eigen::Vector2d::Zero());
    if (usable) {
      now = {known->u_rad.segment<2>(2 * i),
             per_scaled_time * known->velocity_radps.segment<2>(2 * i),
             per_scaled_time * per_scaled_time * known->acceleration_radps2.segment<2>(2 * i)};
    }
    if (changed) {
      // What was remembered deviates from the old motion; from the new one it deviates by their
      // difference more.
      const Quadratic before = known_at(i, step);
      shift(memory_[static_cast<std::size_t>(i)],
            {before[0] - now[0], before[1] - now[1], before[2] - now[2]});
    }
    known_[static_cast<std::size_t>(i)] = now;
  }
  has_known_ = usable;
  source_ = usable ? known->source : 0;
}

void CurvatureFilter::age(Memory& memory, double step) noexcept {
  // Every age grows by the step: sum w e^-h (a + h)^m by the binomial theorem, highest power first.
  static constexpr double kBinomial[5][5] = {
      {1, 0, 0, 0, 0}, {1, 1, 0, 0, 0}, {1, 2, 1, 0, 0}, {1, 3, 3, 1, 0}, {1, 4, 6, 4, 1}};
  const double forget = std::exp(-step);
  const auto advance = [&](auto& moment, std::size_t power) {
    auto sum = moment[power];
    double factor = 1.0;
    for (std::size_t j = power; j-- > 0;) {
      factor *= step;
      sum += kBinomial[power][j] * factor * moment[j];
    }
    moment[power] = forget * sum;
  };
  for (std::size_t m = memory.weight.size(); m-- > 0;) advance(memory.weight, m);
  for (std::size_t m = memory.deviation.size(); m-- > 0;) advance(memory.deviation, m);
}

void CurvatureFilter::shift(Memory& memory, const Quadratic& change) noexcept {
  for (std::size_t m = 0; m < 3; ++m) {
    memory.deviation[m] += memory.weight[m] * change[0] - memory.weight[m + 1] * change[1] +
                           memory.weight[m + 2] / 2.0 * change[2];
  }
}

void CurvatureFilter::start(Memory& memory, const Eigen::Vector2d& deviation) noexcept {
  // One frame's weight spread over the past as the weights of a long rest would be: moments m!.
  memory.weight = {1.0, 1.0, 2.0, 6.0, 24.0};
  memory.deviation = {deviation, deviation, 2.0 * deviation};
  memory.fit = {deviation, Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};
  memory.unseen = 0;
  memory.valid = true;
}

void CurvatureFilter::observe(Memory& memory, const Eigen::Vector2d& deviation) noexcept {
  memory.weight[0] += 1.0;
  memory.deviation[0] += deviation;
  memory.unseen = 0;
}

void CurvatureFilter::solve(Memory& memory) noexcept {
  Eigen::Matrix<double, 3, 2> right;
  right.row(0) = memory.deviation[0];
  right.row(1) = -memory.deviation[1];
  right.row(2) = memory.deviation[2] / 2.0;
  const Eigen::Matrix<double, 3, 2> fit =
      Eigen::LDLT<Eigen::Matrix3d>(normal_matrix(memory.weight)).solve(right);
  memory.fit = {fit.row(0), fit.row(1), fit.row(2)};
}

void CurvatureFilter::update(std::int64_t capture_ns, const CurvatureEstimate& estimate,
                             const KnownMotion* known) noexcept {
  if (has_frame_ && capture_ns <= newest_ns_) return;
  if (estimate.segments != static_cast<int>(memory_.size())) return;
  double step = 0.0;
  if (has_frame_) {
    step = bandwidth_radps_ * 1e-9 * static_cast<double>(capture_ns - newest_ns_);
    if (step > 2.0 * kMaxHorizon) reset();
  }
  if (has_frame_) {
    for (Memory& memory : memory_) age(memory, step);
  }
  adopt(known, step);
  has_frame_ = true;
  newest_ns_ = capture_ns;
  for (std::size_t i = 0; i < memory_.size(); ++i) {
    Memory& memory = memory_[i];
    if (!estimate.valid[i]) {
      if (++memory.unseen > predicted_frames_ || memory.weight[0] < kLeastWeight) {
        memory.valid = false;
      }
      if (memory.valid) solve(memory);
      continue;
    }
    const Eigen::Vector2d deviation =
        estimate.u_rad.segment<2>(2 * static_cast<Eigen::Index>(i)) - known_[i][0];
    if (!memory.valid) {
      start(memory, deviation);
    } else {
      observe(memory, deviation);
      solve(memory);
    }
  }
}

void CurvatureFilter::predict(std::int64_t time_ns, FilteredMotion& out,
                              const KnownMotion* known) const noexcept {
  const int n = static_cast<int>(memory_.size());
  out.segments = n;
  out.u_rad.setZero(2 * n);
  out.velocity_radps.setZero(2 * n);
  const double ahead =
      std::clamp(bandwidth_radps_ * 1e-9 * static_cast<double>(time_ns - newest_ns_), -kMaxHorizon,
                 kMaxHorizon);
  const bool same_source = known != nullptr && has_known_ && known->source == source_ &&
                           known->u_rad.size() == 2 * n && known->velocity_radps.size() == 2 * n;
  for (int i = 0; i < n; ++i) {
    const Memory& memory = memory_[static_cast<std::size_t>(i)];
    out.valid[static_cast<std::size_t>(i)] = memory.valid;
    if (!memory.valid) continue;
    const Quadratic carried = known_at(i, ahead);
    const auto& fit = memory.fit;
    const Eigen::Vector2d deviation = fit[0] + ahead * fit[1] + (ahead * ahead / 2.0) * fit[2];
    const Eigen::Vector2d rate = bandwidth_radps_ * (fit[1] + ahead * fit[2]);
    out.u_rad.segment<2>(2 * i) =
        deviation + (same_source ? Eigen::Vector2d(known->u_rad.segment<2>(2 * i)) : carried[0]);
    out.velocity_radps.segment<2>(2 * i) =
        rate + (same_source ? Eigen::Vector2d(known->velocity_radps.segment<2>(2 * i))
                            : bandwidth_radps_ * carried[1]);
  }
}

}  // namespace softarm
