#include "dev/bench/python_peers.hpp"

#include "dev/bench/interleaved.hpp"
#include "softarm/base/histogram.hpp"
#include "softarm/control/curvature_controller.hpp"
#include "softarm/model/derivatives.hpp"
#include "softarm/model/dynamics.hpp"
#include "softarm/simulation/lock_step.hpp"

namespace softarm {

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
