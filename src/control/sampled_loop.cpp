#include "control/sampled_loop.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>
#include <limits>
#include <unsupported/Eigen/MatrixFunctions>
#include <vector>

#include "softarm/model/modes.hpp"

namespace softarm {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Events happen on a grid of so many instants a control period: as many matrix exponentials.
constexpr int kGrid = 8;

/// The third-order filter on one number a row: the fit (value, rate, curvature) in scaled time.
class SteadyFilter {
 public:
  /// `step_s` is the time between two instants of the grid, `frame_steps` so many from frame to
  /// frame.
  SteadyFilter(double bandwidth_radps, double step_s, double frame_steps, Eigen::Index rows)
      : bandwidth_(bandwidth_radps),
        step_(bandwidth_radps * step_s),
        fit_(MatrixXd::Zero(3, rows)) {
    // The information of the fit, sum over the past of w b b', b = (1, -a, a^2 / 2), w = e^-a; of
    // three frames at least, without which there is no curvature.
    const double age = step_ * frame_steps;
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
    int frames = 0;
    for (double a = 0.0; a < 60.0 || frames < 3; a += age, ++frames) {
      const Eigen::Vector3d b(1.0, -a, 0.5 * a * a);
      information += std::exp(-a) * b * b.transpose();
    }
    gain_ = information.inverse().col(0);
  }

  void update(std::int64_t capture, const VectorXd& measured) {
    fit_ = carried(static_cast<double>(capture));
    fit_ += gain_ * (measured.transpose() - fit_.row(0)).eval();
    newest_ = static_cast<double>(capture);
  }
  VectorXd value(double at) const { return carried(at).row(0); }
  VectorXd rate(double at) const { return bandwidth_ * carried(at).row(1); }
  void scale(double factor) { fit_ *= factor; }

 private:
  MatrixXd carried(double at) const {
    const double h = step_ * (at - newest_);
    Eigen::Matrix3d carry;
    carry << 1.0, h, 0.5 * h * h, 0.0, 1.0, h, 0.0, 0.0, 1.0;
    return carry * fit_;
  }

  double bandwidth_, step_;
  Eigen::Vector3d gain_;
  MatrixXd fit_;
  double newest_ = 0.0;
};

/// Arm and valves between events, exactly: x = (e, e', f) and the held command s.
class HeldArm {
 public:
  HeldArm(const BendingPlane& plane, double valve_lag_s, double step_s)
      : n_(plane.stiffness.rows()) {
    const bool lag = valve_lag_s > 0.0;
    const MatrixXd stiffness = plane.gravity_slope + plane.stiffness;
    MatrixXd rates = MatrixXd::Zero(4 * n_, 4 * n_);
    rates.block(0, n_, n_, n_).setIdentity();
    rates.block(n_, 0, n_, n_) = -plane.inverse_inertia * stiffness;
    rates.block(n_, n_, n_, n_) = -plane.inverse_inertia * plane.damping;
    rates.block(n_, (lag ? 2 : 3) * n_, n_, n_) = plane.inverse_inertia;
    if (lag) {
      rates.block(2 * n_, 2 * n_, n_, n_).diagonal().setConstant(-1.0 / valve_lag_s);
      rates.block(2 * n_, 3 * n_, n_, n_).diagonal().setConstant(1.0 / valve_lag_s);
    }
    for (int k = 1; k <= kGrid; ++k) steps_.push_back((k * step_s * rates).exp());
    state_ = VectorXd::Zero(4 * n_);
    // Every mode gets its share.
    for (Eigen::Index i = 0; i < n_; ++i) state_[i] = 1.0 + 0.37 * static_cast<double>(i);
  }

  /// At most kGrid steps.
  void advance(std::int64_t steps) {
    if (steps > 0) state_ = (steps_[static_cast<std::size_t>(steps - 1)] * state_).eval();
  }
  VectorXd deviation() const { return state_.head(n_); }
  void command(const VectorXd& s) { state_.tail(n_) = s; }
  void scale(double factor) { state_ *= factor; }

 private:
  Eigen::Index n_;
  std::vector<MatrixXd> steps_;
  VectorXd state_;
};

/// What was captured, and when; or what was asked for, and from when on.
struct Delayed {
  std::int64_t at;
  VectorXd value;
};

/// Times are instants of the grid.
class Loop {
 public:
  Loop(const BendingPlane& plane, const LoopSampling& sampling, double factor,
       bool gravity_fed_back)
      : step_s_(sampling.control_period_s / kGrid),
        frame_steps_(std::max(1.0, sampling.frame_period_s / step_s_)),
        latency_(std::llround(sampling.frame_latency_s / step_s_)),
        dead_(std::llround(sampling.dead_time_s / step_s_)),
        arm_(plane, sampling.valve_lag_s, step_s_),
        filter_(sampling.filter_bandwidth_radps, step_s_, frame_steps_, plane.kp.rows()),
        kd_(factor * plane.kd),
        value_gain_(-factor * plane.kp) {
    if (gravity_fed_back) value_gain_ += plane.gravity_slope;
  }

  /// Root mean square of the deviation at the ticks of the next `seconds`.
  double run(double seconds) {
    const std::int64_t end = now_ + std::max<std::int64_t>(kGrid, std::llround(seconds / step_s_));
    double sum = 0.0;
    int count = 0;
    while (now_ < end) {
      const std::int64_t force = commands_.empty() ? tick_ : commands_[0].at;
      const std::int64_t next = std::min({capture(), tick_, force});
      arm_.advance(next - now_);
      now_ = next;
      if (now_ == capture()) {
        frames_.push_back({now_, arm_.deviation()});
        ++captures_;
      }
      if (now_ == tick_) {
        sum += arm_.deviation().squaredNorm();
        ++count;
        decide();
      }
      while (!commands_.empty() && commands_[0].at <= now_) {
        arm_.command(commands_[0].value);
        commands_.pop_front();
      }
    }
    return std::sqrt(sum / std::max(1, count));
  }

  /// The loop is linear: a state that has become large or small may be rescaled.
  void scale(double factor) {
    arm_.scale(factor);
    filter_.scale(factor);
    for (std::deque<Delayed>* line : {&frames_, &commands_}) {
      for (Delayed& each : *line) each.value *= factor;
    }
  }

 private:
  std::int64_t capture() const {
    return std::llround(static_cast<double>(captures_) * frame_steps_);
  }

  void decide() {
    for (; !frames_.empty() && frames_[0].at + latency_ <= now_; frames_.pop_front()) {
      filter_.update(frames_[0].at, frames_[0].value);
    }
    const double act = static_cast<double>(now_) + 0.5 * kGrid;
    commands_.push_back({now_ + dead_, value_gain_ * filter_.value(act) - kd_ * filter_.rate(act)});
    tick_ += kGrid;
  }

  double step_s_, frame_steps_;
  std::int64_t latency_, dead_;
  HeldArm arm_;
  SteadyFilter filter_;
  MatrixXd kd_, value_gain_;
  std::deque<Delayed> frames_, commands_;
  std::int64_t now_ = 0, tick_ = 0, captures_ = 0;
};

}  // namespace

BendingPlane reduced(const BendingPlane& plane, int modes) {
  const MatrixXd inertia = plane.inverse_inertia.llt().solve(
      MatrixXd::Identity(plane.stiffness.rows(), plane.stiffness.cols()));
  const MatrixXd stiffness = plane.stiffness + plane.gravity_slope;
  const MatrixXd shapes = symmetric_modes(stiffness, inertia).vectors;
  MatrixXd V(stiffness.rows(), modes);
  V << shapes.leftCols(modes / 2), shapes.rightCols(modes - modes / 2);
  const auto part = [&](const MatrixXd& matrix) { return MatrixXd(V.transpose() * matrix * V); };
  return {MatrixXd::Identity(modes, modes),
          part(plane.gravity_slope),
          part(plane.stiffness),
          part(plane.damping),
          part(plane.kp),
          part(plane.kd)};
}

double loop_growth_1ps(const BendingPlane& plane, const LoopSampling& sampling, double factor,
                       bool gravity_fed_back) {
  // Short windows, so that not even a violent instability overflows in one; many, so that it does
  // not matter which part of an oscillation falls into one: the slope of a line through all.
  constexpr int kSettling = 12, kMeasured = 40;
  Loop loop(plane, sampling, factor, gravity_fed_back);
  const double window_s = std::max(0.25, 4.0 * sampling.control_period_s);
  double grown = 0.0, slope = 0.0, weight = 0.0;
  double before = loop.run(window_s);
  for (int k = 0; k < kSettling + kMeasured; ++k) {
    loop.scale(1.0 / before);
    before = loop.run(window_s);
    if (!std::isfinite(before)) return std::numeric_limits<double>::infinity();
    if (k < kSettling) continue;
    grown += std::log(before);
    const double at = k - kSettling - 0.5 * (kMeasured - 1);
    slope += at * grown;
    weight += at * at;
  }
  return slope / (weight * window_s);
}

}  // namespace softarm
