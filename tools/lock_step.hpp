// The daemon's pipeline and the simulated arm in one process: deterministic, as fast as the machine
// allows.
#pragma once

#include <cstdint>
#include <vector>

#include "log_row.hpp"
#include "softarm/config/experiment.hpp"
#include "softarm/daemon/control_pipeline.hpp"
#include "softarm/daemon/histogram.hpp"
#include "softarm/plant/simulated_arm.hpp"

namespace softarm {

/// Ticks at whole control periods; captures, arrivals and expiries at their own times between them.
class LockStep {
 public:
  /// Keeps its own copy of the experiment. @throws as ControlPipeline and SimulatedArm
  explicit LockStep(const Experiment& experiment);

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

  Experiment experiment_;
  ControlPipeline pipeline_;
  SimulatedArm arm_;
  std::vector<MocapFrame> frames_;
  std::vector<double> pressures_;
  PressureVector measured_;
  std::int64_t ticks_ = 0;
  DurationHistogram tick_times_;
};

/// What a pipeline knows of its tick; the plant's truth is not its to tell.
void fill_from_pipeline(const ControlPipeline& pipeline, const ArmParameters& arm, LogRow& row);

}  // namespace softarm
