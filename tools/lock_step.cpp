#include "lock_step.hpp"

#include <cmath>

#include "softarm/daemon/realtime.hpp"
#include "softarm/model/kinematics.hpp"

namespace softarm {

LockStep::LockStep(const Experiment& experiment)
    : experiment_(experiment), pipeline_(experiment), arm_(experiment.plant, 0) {}

bool LockStep::step(LogRow& row, bool logged) {
  const std::int64_t now_ns = ticks_++ * pipeline_.period_ns();
  arm_.advance_to(now_ns);
  frames_.clear();
  for (MocapFrame frame; arm_.receive(frame);) frames_.push_back(frame);

  const std::int64_t before_ns = monotonic_now_ns();
  TickInput input;
  input.now_ns = now_ns;
  input.frames = frames_;
  input.newest_go_ns = now_ns;  // nobody has to hold a button while nothing moves
  measured_ = arm_.measured_pressures_bar().cast<float>().cast<double>();  // as valves publish them
  input.newest_measurement_ns = now_ns;
  input.measured_bar = &measured_;
  const TickOutput& output = pipeline_.tick(input);
  tick_times_.add_ns(monotonic_now_ns() - before_ns);

  pressures_.assign(output.pressure_bar.begin(), output.pressure_bar.end());
  arm_.command({.sequence = ticks_,
                .validity_ns = std::llround(1e9 * experiment_.daemon.lcm.command_validity_s),
                .shadow = false,
                .pressure_bar = pressures_},
               now_ns);
  if (logged) {
    arm_.advance_to(now_ns + pipeline_.period_ns() / 2);
    fill(row);
  }
  return true;
}

void LockStep::fill(LogRow& row) const {
  fill_from_pipeline(pipeline_, experiment_.arm, row);
  row.t_s = 1e-9 * static_cast<double>(arm_.time_ns());
  row.truth = arm_.plant().u_rad();
  row.real = arm_.measured_pressures_bar();
  row.tip = arm_.plant().tip_m();
  row.coordinates = arm_.plant().coordinates();
}

void fill_from_pipeline(const ControlPipeline& pipeline, const ArmParameters& arm, LogRow& row) {
  const TickOutput& output = pipeline.output();
  const CurvatureEstimate& estimate = pipeline.estimate();
  row.mode = output.mode;
  row.reason = output.reason;
  row.saturated = output.saturated;
  row.frame_age_s = output.frame_age_s;
  row.u = output.motion.u_rad;
  row.velocity = output.motion.velocity_radps;
  row.reference = output.reference.u;
  row.tau_actuation = output.tau_actuation_nm;
  row.residual_twist = Eigen::Map<const Eigen::VectorXd>(estimate.twist_rad.data(), arm.size());
  row.residual_length =
      Eigen::Map<const Eigen::VectorXd>(estimate.length_error_m.data(), arm.size());
  row.commanded = output.pressure_bar;
  row.tip_reference.reset();
  row.tip_is_asked = row.reference.size() > 0 && output.reference.has_tip;
  if (row.tip_is_asked) {
    row.tip_reference = output.reference.tip.position_m;
  } else if (row.reference.size() > 0) {
    row.tip_reference = tip_position(arm, row.reference);
  }
}

}  // namespace softarm
