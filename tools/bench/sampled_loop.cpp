#include "bench/sampled_loop.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <cmath>
#include <deque>
#include <limits>
#include <map>
#include <stdexcept>
#include <unsupported/Eigen/MatrixFunctions>

#include "softarm/control/gain_check.hpp"
#include "softarm/model/dynamics.hpp"

namespace softarm {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

std::int64_t to_ns(double time_s) { return std::llround(1e9 * time_s); }

/// The third-order filter on one number a row: the fit (value, rate, curvature) in scaled time.
class SteadyFilter {
 public:
  SteadyFilter(double bandwidth_radps, double frame_s, Eigen::Index rows)
      : bandwidth_(bandwidth_radps), fit_(MatrixXd::Zero(3, rows)) {
    // The information of the fit, sum over the past of w b b', b = (1, -a, a^2 / 2), w = e^-a.
    const double step = bandwidth_radps * frame_s;
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
    for (double a = 0.0; a < 60.0; a += step) {
      const Eigen::Vector3d b(1.0, -a, 0.5 * a * a);
      information += std::exp(-a) * b * b.transpose();
    }
    gain_ = information.inverse().col(0);
  }

  void update(std::int64_t capture_ns, const VectorXd& measured) {
    fit_ = carried(capture_ns);
    fit_ += gain_ * (measured.transpose() - fit_.row(0)).eval();
    newest_ns_ = capture_ns;
  }
  VectorXd value(std::int64_t at_ns) const { return carried(at_ns).row(0); }
  VectorXd rate(std::int64_t at_ns) const { return bandwidth_ * carried(at_ns).row(1); }
  void scale(double factor) { fit_ *= factor; }

 private:
  MatrixXd carried(std::int64_t at_ns) const {
    const double h = bandwidth_ * 1e-9 * static_cast<double>(at_ns - newest_ns_);
    Eigen::Matrix3d carry;
    carry << 1.0, h, 0.5 * h * h, 0.0, 1.0, h, 0.0, 0.0, 1.0;
    return carry * fit_;
  }

  double bandwidth_;
  Eigen::Vector3d gain_;
  MatrixXd fit_;
  std::int64_t newest_ns_ = 0;
};

/// Arm and valves between events, exactly: x = (e, e', f) and the held command s.
class HeldArm {
 public:
  HeldArm(const PlantSettings& plant, const VectorXd& u) : dof_(plant.arm.dof()) {
    const ArmParameters& arm = plant.arm;
    DynamicsWorkspace workspace(arm);
    MatrixXd B(dof_, dof_), C(dof_, dof_);
    VectorXd G(dof_);
    const VectorXd zero = VectorXd::Zero(dof_);
    dynamics_matrices(arm, workspace, u, zero, B, C, G);
    MatrixXd stiffness = gravity_slope(arm, u), damping = MatrixXd::Zero(dof_, dof_);
    for (Eigen::Index i = 0; i < dof_; ++i) {
      const SegmentParameters& segment = arm.segments[static_cast<std::size_t>(i / 2)];
      stiffness(i, i) += segment.stiffness_nm_per_rad;
      damping(i, i) += segment.damping_nms_per_rad;
    }
    const bool lag = plant.valves.lag_s > 0.0;
    const MatrixXd mobility = B.llt().solve(MatrixXd::Identity(dof_, dof_));
    rates_ = MatrixXd::Zero(4 * dof_, 4 * dof_);
    rates_.block(0, dof_, dof_, dof_).setIdentity();
    rates_.block(dof_, 0, dof_, dof_) = -mobility * stiffness;
    rates_.block(dof_, dof_, dof_, dof_) = -mobility * damping;
    rates_.block(dof_, (lag ? 2 : 3) * dof_, dof_, dof_) = mobility;
    if (lag) {
      rates_.block(2 * dof_, 2 * dof_, dof_, dof_).diagonal().setConstant(-1 / plant.valves.lag_s);
      rates_.block(2 * dof_, 3 * dof_, dof_, dof_).diagonal().setConstant(1 / plant.valves.lag_s);
    }
    state_ = VectorXd::Zero(4 * dof_);
    // Every mode of both bending planes gets its share.
    for (Eigen::Index i = 0; i < dof_; ++i) state_[i] = 1.0 + 0.37 * static_cast<double>(i);
  }

  void advance(std::int64_t step_ns) {
    if (step_ns <= 0) return;
    auto [entry, is_new] = steps_.try_emplace(step_ns);
    if (is_new) entry->second = (1e-9 * static_cast<double>(step_ns) * rates_).exp();
    state_ = (entry->second * state_).eval();
  }
  VectorXd deviation() const { return state_.head(dof_); }
  void command(const VectorXd& s) { state_.tail(dof_) = s; }
  void scale(double factor) { state_ *= factor; }

 private:
  Eigen::Index dof_;
  MatrixXd rates_;
  VectorXd state_;
  std::map<std::int64_t, MatrixXd> steps_;
};

struct Frame {
  std::int64_t capture_ns, arrival_ns;
  VectorXd measured;
};
struct Command {
  std::int64_t in_force_ns;
  VectorXd force;
};

class Loop {
 public:
  Loop(const Experiment& experiment, const VectorXd& u)
      : arm_(experiment.plant, u),
        filter_(experiment.estimation.filter_bandwidth_radps, 1.0 / experiment.plant.mocap.rate_hz,
                u.size()),
        period_ns_(to_ns(1.0 / experiment.daemon.rate_hz)),
        frame_s_(1.0 / experiment.plant.mocap.rate_hz),
        latency_ns_(to_ns(experiment.plant.mocap.latency_s)),
        dead_ns_(to_ns(experiment.plant.valves.dead_time_s)),
        kp_(Eigen::Map<const VectorXd>(experiment.control.kp.data(), u.size())),
        kd_(VectorXd::Zero(u.size())),
        slope_(gravity_slope(experiment.arm, u)) {
    if (!experiment.control.kd.empty()) {
      kd_ = Eigen::Map<const VectorXd>(experiment.control.kd.data(), u.size());
    }
    if (!experiment.control.terms.gravity) slope_.setZero();
  }

  /// Root mean square of the deviation at the frames of the next `seconds`.
  double run(double seconds) {
    const std::int64_t end_ns = now_ns_ + to_ns(seconds);
    double sum = 0.0;
    int count = 0;
    while (now_ns_ < end_ns) {
      const std::int64_t force_ns =
          commands_.empty() ? std::numeric_limits<std::int64_t>::max() : commands_[0].in_force_ns;
      const std::int64_t next_ns = std::min({capture_ns(), tick_ns_, force_ns});
      arm_.advance(next_ns - now_ns_);
      now_ns_ = next_ns;
      if (now_ns_ == capture_ns()) {
        frames_.push_back({now_ns_, now_ns_ + latency_ns_, arm_.deviation()});
        sum += frames_.back().measured.squaredNorm();
        ++count;
        ++captures_;
      }
      if (now_ns_ == tick_ns_) tick();
      while (!commands_.empty() && commands_[0].in_force_ns <= now_ns_) {
        arm_.command(commands_[0].force);
        commands_.pop_front();
      }
    }
    return std::sqrt(sum / std::max(1, count));
  }

  /// The loop is linear: what has become large or small may be measured anew.
  void scale(double factor) {
    arm_.scale(factor);
    filter_.scale(factor);
    for (Frame& frame : frames_) frame.measured *= factor;
    for (Command& command : commands_) command.force *= factor;
  }

 private:
  std::int64_t capture_ns() const { return to_ns(static_cast<double>(captures_) * frame_s_); }

  void tick() {
    while (!frames_.empty() && frames_[0].arrival_ns <= now_ns_) {
      filter_.update(frames_[0].capture_ns, frames_[0].measured);
      frames_.pop_front();
    }
    const std::int64_t act_ns = now_ns_ + period_ns_ / 2;
    const VectorXd e = filter_.value(act_ns);
    const VectorXd force =
        slope_ * e - kp_.cwiseProduct(e) - kd_.cwiseProduct(filter_.rate(act_ns));
    commands_.push_back({now_ns_ + dead_ns_, force});
    tick_ns_ += period_ns_;
  }

  HeldArm arm_;
  SteadyFilter filter_;
  std::int64_t period_ns_;
  double frame_s_;
  std::int64_t latency_ns_, dead_ns_;
  VectorXd kp_, kd_;
  MatrixXd slope_;
  std::deque<Frame> frames_;
  std::deque<Command> commands_;
  std::int64_t now_ns_ = 0, tick_ns_ = 0, captures_ = 0;
};

}  // namespace

double loop_growth_1ps(const Experiment& experiment, const VectorXd& u_rad) {
  if (u_rad.size() != experiment.arm.dof()) {
    throw std::invalid_argument(
        fmt::format("loop: expected {} numbers, got {}", experiment.arm.dof(), u_rad.size()));
  }
  // Short windows, so that not even a violent instability overflows in one; many, so that it does
  // not matter which part of an oscillation falls into one: the slope of a line through all.
  constexpr int kSettling = 12, kMeasured = 40;
  constexpr double kWindow_s = 0.25;
  Loop loop(experiment, u_rad);
  double grown = 0.0, slope = 0.0, weight = 0.0;
  double before = loop.run(kWindow_s);
  for (int k = 0; k < kSettling + kMeasured; ++k) {
    loop.scale(1.0 / before);
    before = loop.run(kWindow_s);
    if (!std::isfinite(before)) return std::numeric_limits<double>::infinity();
    if (k < kSettling) continue;
    grown += std::log(before);
    const double at = k - kSettling - 0.5 * (kMeasured - 1);
    slope += at * grown;
    weight += at * at;
  }
  return slope / (weight * kWindow_s);
}

double largest_sampled_factor(const Experiment& experiment, const VectorXd& u_rad, double upper) {
  const auto stable = [&](double factor) {
    Experiment scaled = experiment;
    for (double& gain : scaled.control.kp) gain *= factor;
    for (double& gain : scaled.control.kd) gain *= factor;
    return loop_growth_1ps(scaled, u_rad) < 0.0;
  };
  if (stable(upper)) return upper;
  double low = 1e-3, high = upper;
  if (!stable(low)) return 0.0;
  while (high > 1.001 * low) {
    const double middle = std::sqrt(low * high);
    (stable(middle) ? low : high) = middle;
  }
  return low;
}

}  // namespace softarm
