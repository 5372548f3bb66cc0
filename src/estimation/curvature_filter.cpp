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

CurvatureFilter::CurvatureFilter(const EstimationSettings& settings, const ArmParameters& arm)
    : CurvatureFilter(settings, arm.size()) {
  if (!arm.extensible) return;
  stretch_.resize(memory_.size());
  known_stretch_.resize(memory_.size());
  for (const SegmentParameters& segment : arm.segments) length_m_.push_back(segment.length_m);
  reset();
}

void CurvatureFilter::reset() noexcept {
  for (Memory& memory : memory_) {
    start(memory, Eigen::Vector2d::Zero());
    memory.valid = false;
  }
  for (Fit<1>& stretch : stretch_) start<1>(Eigen::Matrix<double, 1, 1>::Zero(), stretch);
  for (auto& known : known_) known.fill(Eigen::Vector2d::Zero());
  for (auto& known : known_stretch_) known.fill(Eigen::Matrix<double, 1, 1>::Zero());
  has_known_ = false;
  has_frame_ = false;
  newest_ns_ = 0;
}

template <int D>
CurvatureFilter::Quadratic<D> CurvatureFilter::later(const Quadratic<D>& k, double h) noexcept {
  return {k[0] + h * k[1] + (h * h / 2.0) * k[2], k[1] + h * k[2], k[2]};
}

template <int D>
CurvatureFilter::Quadratic<D> CurvatureFilter::known_part(const KnownMotion& known,
                                                          int at) const noexcept {
  const double per_scaled_time = 1.0 / bandwidth_radps_;
  return {known.u_rad.segment<D>(at), per_scaled_time * known.velocity_radps.segment<D>(at),
          per_scaled_time * per_scaled_time * known.acceleration_radps2.segment<D>(at)};
}

template <int D>
void CurvatureFilter::adopt(const std::array<double, 5>& weight, double step, bool changed,
                            const Quadratic<D>& now, Quadratic<D>& known, Fit<D>& fit) noexcept {
  if (changed) {
    // What was remembered deviates from the old motion; from the new one it deviates by their
    // difference more.
    const Quadratic<D> before = later<D>(known, step);
    shift<D>(weight, {before[0] - now[0], before[1] - now[1], before[2] - now[2]}, fit);
  }
  known = now;
}

void CurvatureFilter::adopt(const KnownMotion* known, double step) noexcept {
  const bool usable = known != nullptr && known->u_rad.size() == width() * std::ssize(known_) &&
                      known->velocity_radps.size() == known->u_rad.size() &&
                      known->acceleration_radps2.size() == known->u_rad.size();
  const bool changed = usable != has_known_ || (usable && known->source != source_);
  const int w = static_cast<int>(width());
  for (int i = 0; i < static_cast<int>(known_.size()); ++i) {
    const auto k = static_cast<std::size_t>(i);
    Quadratic<2> now;
    now.fill(Eigen::Vector2d::Zero());
    if (usable) now = known_part<2>(*known, w * i);
    adopt<2>(memory_[k].weight, step, changed, now, known_[k], memory_[k].u);
    if (stretch_.empty()) continue;
    Quadratic<1> length;
    length.fill(Eigen::Matrix<double, 1, 1>::Zero());
    if (usable) length = known_part<1>(*known, w * i + 2);
    adopt<1>(memory_[k].weight, step, changed, length, known_stretch_[k], stretch_[k]);
  }
  has_known_ = usable;
  source_ = usable ? known->source : 0;
}

void CurvatureFilter::age(Memory& memory, Fit<1>* stretch, double step) noexcept {
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
  for (std::size_t m = 3; m-- > 0;) advance(memory.u.deviation, m);
  for (std::size_t m = 3; stretch != nullptr && m-- > 0;) advance(stretch->deviation, m);
}

template <int D>
void CurvatureFilter::shift(const std::array<double, 5>& weight, const Quadratic<D>& change,
                            Fit<D>& fit) noexcept {
  for (std::size_t m = 0; m < 3; ++m) {
    fit.deviation[m] +=
        weight[m] * change[0] - weight[m + 1] * change[1] + weight[m + 2] / 2.0 * change[2];
  }
}

// One frame's weight spread over the past as the weights of a long rest would be: moments m!.
template <int D>
void CurvatureFilter::start(const Eigen::Matrix<double, D, 1>& deviation, Fit<D>& fit) noexcept {
  fit.deviation = {deviation, deviation, 2.0 * deviation};
  fit.fit[0] = deviation;
  fit.fit[1].setZero();
  fit.fit[2].setZero();
}

void CurvatureFilter::start(Memory& memory, const Eigen::Vector2d& deviation) noexcept {
  memory.weight = {1.0, 1.0, 2.0, 6.0, 24.0};
  start<2>(deviation, memory.u);
  memory.unseen = 0;
  memory.valid = true;
}

template <int D>
void CurvatureFilter::solve(const std::array<double, 5>& weight, Fit<D>& fit) noexcept {
  Eigen::Matrix<double, 3, D> right;
  right.row(0) = fit.deviation[0];
  right.row(1) = -fit.deviation[1];
  right.row(2) = fit.deviation[2] / 2.0;
  const Eigen::Matrix<double, 3, D> solved =
      Eigen::LDLT<Eigen::Matrix3d>(normal_matrix(weight)).solve(right);
  fit.fit = {solved.row(0), solved.row(1), solved.row(2)};
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
    for (std::size_t i = 0; i < memory_.size(); ++i)
      age(memory_[i], stretch_.empty() ? nullptr : &stretch_[i], step);
  }
  adopt(known, step);
  has_frame_ = true;
  newest_ns_ = capture_ns;
  for (std::size_t i = 0; i < memory_.size(); ++i) observe(i, estimate);
}

void CurvatureFilter::observe(std::size_t i, const CurvatureEstimate& estimate) noexcept {
  Memory& memory = memory_[i];
  const bool seen =
      estimate.valid[i] && (stretch_.empty() || std::isfinite(estimate.length_variance_m2[i]));
  if (!seen) {
    if (++memory.unseen > predicted_frames_ || memory.weight[0] < kLeastWeight) {
      memory.valid = false;
    }
    if (!memory.valid) return;
    solve<2>(memory.weight, memory.u);
    if (!stretch_.empty()) solve<1>(memory.weight, stretch_[i]);
    return;
  }
  const bool starts = !memory.valid;
  const Eigen::Vector2d deviation =
      estimate.u_rad.segment<2>(2 * static_cast<Eigen::Index>(i)) - known_[i][0];
  if (starts) {
    start(memory, deviation);
  } else {
    memory.weight[0] += 1.0;
    memory.u.deviation[0] += deviation;
    memory.unseen = 0;
    solve<2>(memory.weight, memory.u);
  }
  if (stretch_.empty()) return;
  const Eigen::Matrix<double, 1, 1> length(estimate.length_m[i] - length_m_[i] -
                                           known_stretch_[i][0][0]);
  if (starts) {
    start<1>(length, stretch_[i]);
  } else {
    stretch_[i].deviation[0] += length;
    solve<1>(memory.weight, stretch_[i]);
  }
}

template <int D>
void CurvatureFilter::evaluate(const Fit<D>& memory, const Quadratic<D>& known, double ahead,
                               int at, const KnownMotion* same_source,
                               FilteredMotion& out) const noexcept {
  using Value = Eigen::Matrix<double, D, 1>;
  const Quadratic<D> carried = later<D>(known, ahead);
  const auto& fit = memory.fit;
  const Value deviation = fit[0] + ahead * fit[1] + (ahead * ahead / 2.0) * fit[2];
  const Value rate = bandwidth_radps_ * (fit[1] + ahead * fit[2]);
  out.u_rad.segment<D>(at) =
      deviation + (same_source != nullptr ? Value(same_source->u_rad.segment<D>(at)) : carried[0]);
  out.velocity_radps.segment<D>(at) =
      rate + (same_source != nullptr ? Value(same_source->velocity_radps.segment<D>(at))
                                     : bandwidth_radps_ * carried[1]);
}

void CurvatureFilter::predict(std::int64_t time_ns, FilteredMotion& out,
                              const KnownMotion* known) const noexcept {
  const int n = static_cast<int>(memory_.size()), w = static_cast<int>(width());
  out.segments = n;
  out.u_rad.setZero(w * n);
  out.velocity_radps.setZero(w * n);
  const double ahead =
      std::clamp(bandwidth_radps_ * 1e-9 * static_cast<double>(time_ns - newest_ns_), -kMaxHorizon,
                 kMaxHorizon);
  const bool same_source = known != nullptr && has_known_ && known->source == source_ &&
                           known->u_rad.size() == w * n && known->velocity_radps.size() == w * n;
  for (int i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    out.valid[k] = memory_[k].valid;
    if (!memory_[k].valid) continue;
    evaluate<2>(memory_[k].u, known_[k], ahead, w * i, same_source ? known : nullptr, out);
    if (!stretch_.empty())
      evaluate<1>(stretch_[k], known_stretch_[k], ahead, w * i + 2, same_source ? known : nullptr,
                  out);
  }
}

}  // namespace softarm
