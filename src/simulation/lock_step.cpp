#include "softarm/simulation/lock_step.hpp"

#include "softarm/base/clock.hpp"
#include "softarm/base/time.hpp"
#include "softarm/runtime/log_row.hpp"
#include "softarm/runtime/settings.hpp"

namespace softarm {

LockStep::LockStep(const PipelineSettings& settings, const PlantSettings& plant)
    : model_(settings.arm),
      validity_ns_(to_ns(settings.safety.command_validity_s)),
      pipeline_(settings),
      arm_(plant, 0) {}

bool LockStep::step(LogRow& row, bool logged) {
  const std::int64_t now_ns = ticks_++ * pipeline_.period_ns();
  arm_.advance_to(now_ns);
  frames_.clear();
  for (MocapFrame frame; arm_.receive(frame);) frames_.push_back(frame);

  const std::int64_t before_ns = monotonic_now_ns();
  TickInput input;
  input.now_ns = now_ns;
  input.frames = frames_;
  if (answered_) input.law = &answer_;
  operator_.attend(pipeline_.output(), input);
  measured_ = arm_.measured_pressures_bar().cast<float>().cast<double>();  // as valves publish them
  input.newest_measurement_ns = now_ns;
  input.measured_bar = &measured_;
  const TickOutput& output = pipeline_.tick(input);
  tick_times_.add_ns(monotonic_now_ns() - before_ns);

  answered_ = external_ && output.law != nullptr && external_(output, answer_);
  answer_.state_ns = now_ns;
  answer_.arrival_ns = now_ns + pipeline_.period_ns();

  arm_.command(output.pressure_bar, validity_ns_, now_ns);
  if (logged) {
    arm_.advance_to(now_ns + pipeline_.period_ns() / 2);
    fill(row);
  }
  return true;
}

void LockStep::fill(LogRow& row) const {
  fill_from_pipeline(pipeline_, model_, row);
  row.t_s = to_seconds(arm_.time_ns());
  row.truth = arm_.plant().u_rad();
  row.real = arm_.measured_pressures_bar();
  row.tip = arm_.plant().tip_m();
  row.coordinates = arm_.plant().coordinates();
  row.elongation_truth = arm_.plant().elongation_m();
}

}  // namespace softarm
