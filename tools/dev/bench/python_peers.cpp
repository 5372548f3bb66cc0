#include "dev/bench/python_peers.hpp"

#include <memory>

#include "dev/bench/interleaved.hpp"
#include "softarm/base/histogram.hpp"
#include "softarm/control/curvature_controller.hpp"
#include "softarm/model/derivatives.hpp"
#include "softarm/model/dynamics.hpp"
#include "softarm/model/statics.hpp"
#include "softarm/simulation/lock_step.hpp"

namespace softarm {

namespace {

/// One arm with what its four functions need.
struct DerivativeTrial {
  DerivativeTrial(bool stretching, int segments)
      : arm(arm_of(stretching, segments)),
        workspace(arm),
        derivatives(arm),
        u(Eigen::VectorXd::LinSpaced(arm.dof(), -0.5, 0.6)),
        force(0.1 * u),
        out(arm.dof()),
        by_u(arm.dof(), arm.dof()),
        by_velocity(by_u),
        by_force(by_u) {
    for (int k = 2; stretching && k < arm.dof(); k += 3) u(k) *= 0.01;
  }

  static ArmParameters arm_of(bool stretching, int segments) {
    SegmentParameters segment;
    segment.axial_stiffness_n_per_m = stretching ? 300.0 : 0.0;
    ArmParameters arm;
    arm.extensible = stretching;
    arm.segments.assign(static_cast<std::size_t>(segments), segment);
    return arm;
  }

  void add_to(InterleavedTiming& timing) {
    const auto add = [&timing](auto call) {
      timing.add([call](int calls) {
        for (int k = 0; k < calls; ++k) call();
      });
    };
    add([this] { forward_dynamics(arm, workspace, u, u, force, out); });
    add([this] { derivatives.forward_dynamics(u, u, force, out, by_u, by_velocity, by_force); });
    add([this] { static_moments(arm, workspace, u, out); });
    add([this] { derivatives.static_stiffness(u, by_u); });
  }

  ArmParameters arm;
  DynamicsWorkspace workspace;
  ModelDerivatives derivatives;
  Eigen::VectorXd u, force, out;
  Eigen::MatrixXd by_u, by_velocity, by_force;
};

}  // namespace

std::vector<DerivativeCost> time_derivatives() {
  constexpr double kSeconds = 3.0;
  InterleavedTiming timing;
  std::vector<DerivativeCost> costs;
  std::vector<std::unique_ptr<DerivativeTrial>> trials;
  for (const bool stretching : {false, true}) {
    for (const int segments : {1, 3, 5, 10}) {
      costs.push_back({.stretching = stretching, .segments = segments});
      trials.push_back(std::make_unique<DerivativeTrial>(stretching, segments));
      trials.back()->add_to(timing);
    }
  }
  timing.measure(kSeconds, [](double) {});
  for (std::size_t k = 0; k < costs.size(); ++k) {
    const std::size_t first = 4 * k;
    costs[k].forward_us = 1e-3 * timing.time(first).median_ns;
    costs[k].derivatives_us = 1e-3 * timing.time(first + 1).median_ns;
    costs[k].forward_ratio = timing.ratio(first + 1, first);
    costs[k].static_ratio = timing.ratio(first + 3, first + 2);
  }
  return costs;
}

PythonPeers time_python_peers(const Experiment& experiment) {
  constexpr double kSeconds = 2.0;
  constexpr int kTicks = 2000;
  const Eigen::Index dof = experiment.arm.dof();
  CurvatureController controller(experiment.arm, experiment.control);
  ControlOutput out;
  ReferenceWindow window;
  const SegmentVector state = SegmentVector::Constant(dof, 0.2);
  window.now.u = window.now.velocity = window.now.acceleration = state;

  ArmParameters arm;
  arm.segments.assign(3, SegmentParameters{});
  DynamicsWorkspace workspace(arm);
  ModelDerivatives derivatives(arm);
  const Eigen::VectorXd u = Eigen::VectorXd::LinSpaced(6, -0.5, 0.6), force = 0.1 * u;
  Eigen::VectorXd acceleration(6);
  Eigen::MatrixXd by_u(6, 6), by_velocity(6, 6), by_force(6, 6);

  InterleavedTiming timing;
  timing.add([&](int calls) {
    for (int k = 0; k < calls; ++k) controller.compute(state, state, window, out);
  });
  timing.add([&](int calls) {
    for (int k = 0; k < calls; ++k) forward_dynamics(arm, workspace, u, u, force, acceleration);
  });
  timing.add([&](int calls) {
    for (int k = 0; k < calls; ++k)
      derivatives.forward_dynamics(u, u, force, acceleration, by_u, by_velocity, by_force);
  });
  timing.measure(kSeconds, [](double) {});

  LockStep loop(experiment, experiment.plant);
  LogRow row;
  for (int k = 0; k < kTicks; ++k) loop.step(row, false);
  return {.controller_us = 1e-3 * timing.time(0).median_ns,
          .tick_us = quantile_us(loop.tick_times().counts(), 0.5),
          .forward_us = 1e-3 * timing.time(1).median_ns,
          .derivatives_us = 1e-3 * timing.time(2).median_ns};
}

}  // namespace softarm
