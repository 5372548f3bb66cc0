// An arm for tests of the observer: (16) by explicit Runge-Kutta steps on forward_dynamics, another
// route than the observer's implicit steps; and what motion capture sees of it.
#pragma once

#include <Eigen/Dense>
#include <random>

#include "frames.hpp"
#include "softarm/estimation/model_observer.hpp"
#include "softarm/model/actuation_matrix.hpp"
#include "softarm/model/dynamics.hpp"

namespace softarm::test {

class TrueArm {
 public:
  TrueArm(const ArmParameters& arm, double valve_lag_s, unsigned seed = 1)
      : arm_(arm), lag_s_(valve_lag_s), workspace_(arm), random_(seed) {
    u = velocity = tau = command = disturbance_nm = Eigen::VectorXd::Zero(arm.dof());
    gain = Eigen::VectorXd::Ones(arm.dof());
  }

  void advance(double duration_s) {
    const int steps = static_cast<int>(std::ceil(duration_s / longest_step_s));
    const double h = duration_s / steps;
    for (int k = 0; k < steps; ++k) {
      const auto [k1u, k1v] = rate(u, velocity, 0.0);
      const auto [k2u, k2v] = rate(u + 0.5 * h * k1u, velocity + 0.5 * h * k1v, 0.5 * h);
      const auto [k3u, k3v] = rate(u + 0.5 * h * k2u, velocity + 0.5 * h * k2v, 0.5 * h);
      const auto [k4u, k4v] = rate(u + h * k3u, velocity + h * k3v, h);
      u += h / 6.0 * (k1u + 2.0 * k2u + 2.0 * k3u + k4u);
      velocity += h / 6.0 * (k1v + 2.0 * k2v + 2.0 * k3v + k4v);
      tau = torque(h);
    }
  }

  /// Every body turned by its own noise.
  MocapFrame frame(std::int64_t number, std::int64_t capture_ns, double orientation_noise_rad) {
    MocapFrame out = frame_of(arm_, u);
    out.frame_number = number;
    out.capture_ns = capture_ns;
    for (int i = base_noise ? 0 : 1; i <= arm_.size(); ++i) {
      const Eigen::Vector3d by = Eigen::Vector3d::NullaryExpr(
          [&](Eigen::Index) { return orientation_noise_rad * normal_(random_); });
      Eigen::Quaterniond& q = out.body[static_cast<std::size_t>(i)].orientation;
      if (by.norm() > 0.0)
        q = q * Eigen::Quaterniond(Eigen::AngleAxisd(by.norm(), by.normalized()));
    }
    return out;
  }

  /// The motion as it is: the reference of a loop that follows it exactly.
  KnownMotion motion() {
    KnownMotion out;
    out.u_rad = u;
    out.velocity_radps = velocity;
    out.acceleration_radps2 = rate(u, velocity, 0.0).second;
    out.source = 1;
    return out;
  }

  double normal() { return normal_(random_); }

  Eigen::VectorXd u, velocity, tau, command, disturbance_nm;
  Eigen::VectorXd gain;  ///< on the moment, a coordinate of tau
  double longest_step_s = 2.5e-4;
  bool base_noise = true;

 private:
  Eigen::VectorXd torque(double after_s) const {
    if (lag_s_ <= 0.0) return command;
    return command + std::exp(-after_s / lag_s_) * (tau - command);
  }
  std::pair<Eigen::VectorXd, Eigen::VectorXd> rate(const Eigen::VectorXd& at,
                                                   const Eigen::VectorXd& speed, double after_s) {
    Eigen::VectorXd force(at.size()), acceleration(at.size());
    apply_actuation(arm_, at, torque(after_s).cwiseProduct(gain), force);
    force += disturbance_nm;
    forward_dynamics(arm_, workspace_, at, speed, force, acceleration);
    return {speed, acceleration};
  }

  ArmParameters arm_;
  double lag_s_;
  DynamicsWorkspace workspace_;
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

/// A motion that bends every segment its own way, and the torque that it takes on `arm`.
class SmoothMotion {
 public:
  SmoothMotion(const ArmParameters& arm, double amplitude_rad)
      : arm_(arm), amplitude_rad_(amplitude_rad), workspace_(arm) {}

  KnownMotion at(double t_s) const {
    KnownMotion out;
    const int dof = arm_.dof();
    out.u_rad.resize(dof);
    out.velocity_radps.resize(dof);
    out.acceleration_radps2.resize(dof);
    for (int j = 0; j < dof; ++j) {
      const double rate = 2.0 + 0.3 * (j % 5), phase = 1.1 * j;
      // Elongations are in m: 9 mm where bends are 0.3 rad.
      const double size = arm_.extensible && j % 3 == 2 ? 0.03 * amplitude_rad_ : amplitude_rad_;
      out.u_rad[j] = size * std::sin(rate * t_s + phase);
      out.velocity_radps[j] = size * rate * std::cos(rate * t_s + phase);
      out.acceleration_radps2[j] = -rate * rate * out.u_rad[j];
    }
    out.source = 1;
    return out;
  }

  Eigen::VectorXd torque(double t_s) {
    const KnownMotion motion = at(t_s);
    Eigen::VectorXd force(arm_.dof()), tau(arm_.dof());
    inverse_dynamics(arm_, workspace_, motion.u_rad, motion.velocity_radps, motion.velocity_radps,
                     motion.acceleration_radps2, {}, force);
    add_impedance(arm_, motion.u_rad, motion.velocity_radps, force);
    solve_actuation(arm_, motion.u_rad, force, tau);
    return tau;
  }

 private:
  ArmParameters arm_;
  double amplitude_rad_;
  DynamicsWorkspace workspace_;
};

}  // namespace softarm::test
