// The daemon's pipeline and the simulated arm in one process: deterministic, as fast as the machine
// allows.
#pragma once

#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "softarm/base/histogram.hpp"
#include "softarm/runtime/control_pipeline.hpp"
#include "softarm/runtime/log_row.hpp"
#include "softarm/runtime/settings.hpp"
#include "softarm/simulation/simulated_arm.hpp"
#include "softarm/simulation/simulated_operator.hpp"

namespace softarm {

/// Ticks at whole control periods; captures, arrivals and expiries at their own times between them.
/// Where arming is explicit the arm is armed once, at the start: see SimulatedOperator.
class LockStep {
 public:
  /// @throws as ControlPipeline and SimulatedArm
  LockStep(const PipelineSettings& settings, const PlantSettings& plant);

  /// Answers the tick with which it is called; false: it does not. Called after every tick whose
  /// output has a `law`; the answer comes with the next tick, as that of a process that answers
  /// within a period. state_ns and arrival_ns are filled in.
  using Law = std::function<bool(const TickOutput&, LawInput&)>;
  /// The law of an experiment with control.law: external.
  void set_law(Law law) { external_ = std::move(law); }

  /// One tick at the next period. Where it is `logged` it leaves the plant, and `row`, in the
  /// middle of that period: there the tick's reference belongs. Otherwise the row stays as it was.
  /// Always true: an arm does not come to an end. @throws PlantError
  bool step(LogRow& row, bool logged = true);

  const ControlPipeline& pipeline() const { return pipeline_; }
  const SimulatedArm& arm() const { return arm_; }
  const DurationHistogram& tick_times() const {
    return tick_times_;
  }  ///< wall clock, of the pipeline alone

 private:
  void fill(LogRow& row) const;

  ArmParameters model_;
  std::int64_t validity_ns_;
  ControlPipeline pipeline_;
  SimulatedArm arm_;
  SimulatedOperator operator_;
  std::vector<MocapFrame> frames_;
  PressureVector measured_;
  std::int64_t ticks_ = 0;
  Law external_;
  LawInput answer_;
  bool answered_ = false;
  DurationHistogram tick_times_;
};

}  // namespace softarm
