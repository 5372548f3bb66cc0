#include <fmt/format.h>

#include <algorithm>

#include "config/checks.hpp"
#include "softarm/actuation/pressure_allocator.hpp"
#include "softarm/base/time.hpp"
#include "softarm/config/load.hpp"
#include "softarm/control/control_laws.hpp"
#include "softarm/runtime/safety_monitor.hpp"

namespace softarm {

std::vector<std::string> reaction_times(const Experiment& experiment) {
  const SafetySettings& safety = experiment.safety;
  const double tick_s = 1.0 / experiment.rate_hz;
  const SafetyThresholds resolved = resolve_thresholds(safety, tick_s);
  const bool torque = experiment.actuation.kind == ActuationKind::torque;
  const ActuationSettings& actuation = experiment.actuation;
  std::vector<std::string> lines;
  const auto line = [&](auto format, const auto&... values) {
    lines.push_back(fmt::format(format, values...));
  };
  line(FMT_STRING("Times that follow from this configuration:"));
  line(FMT_STRING("  without a new frame: HOLD after {:.4g} s, VENT after {:.4g} s ({:.4g} and "
                  "{:.4g} declared frame periods)"),
       to_seconds(resolved.hold_after_ns), to_seconds(resolved.vent_after_ns),
       to_seconds(resolved.hold_after_ns) / safety.frame_period_s,
       to_seconds(resolved.vent_after_ns) / safety.frame_period_s);
  line(
      FMT_STRING("  a vent takes at most {:.4g} s from full {}, a frame may be up to {:.4g} s old"),
      std::max(actuation.max_pressure_bar, -actuation.min_pressure_bar) / actuation.vent_bar_per_s,
      torque ? "torque" : "pressure", safety.max_latency_s);
  line(FMT_STRING("  good frames before ACTIVE: {}, that is {:.4g} s"), safety.good_frames,
       safety.good_frames * safety.frame_period_s);
  line(FMT_STRING("  without a new command the valve side vents after {:.4g} s ({:.0f} ticks)"),
       safety.command_validity_s, safety.command_validity_s / tick_s);
  if (safety.valve_readback)
    line(FMT_STRING("  without a measured pressure: FAULT after {:.4g} s; one that does not "
                    "follow: FAULT after at most {:.4g} s"),
         safety.valve_silence_s, 2.0 * safety.pressure_settling_s);
  if (safety.deadman)
    line(FMT_STRING("  without a go of the dead-man input: VENT after {:.4g} s"),
         safety.deadman_timeout_s);
  if (experiment.control.law.get_if<ExternalLaw>() != nullptr)
    line(FMT_STRING("  without an answer of the law: HOLD at most {:.4g} s after the state that "
                    "the newest answers, VENT {:.4g} s later"),
         safety.law_validity_s, safety.law_vent_after_s);
  line(FMT_STRING(
           "  ticks missed in a row, under SCHED_FIFO: HOLD after {:.4g} s, VENT after {:.4g} s"),
       safety.hold_overruns * tick_s, safety.vent_overruns * tick_s);
  if (drives_real_valves(experiment))
    line(FMT_STRING("  without a write the terminal vents by itself after {:.4g} s; arming is {}"),
         experiment.valves.failsafe_timeout_s,
         safety.arming == Arming::explicit_ ? "explicit" : "automatic");
  return lines;
}

}  // namespace softarm
