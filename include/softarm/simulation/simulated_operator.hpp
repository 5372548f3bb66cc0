// The operator's part of a run without an operator: in lock step and on recorded frames.
#pragma once

#include "softarm/runtime/control_pipeline.hpp"

namespace softarm {

/// Stands in for the operator of a run that moves no real arm. Holds the dead-man button. Where
/// arming is explicit, arms the arm when it waits for that, until it is ACTIVE for the first time;
/// an arm that vents later stays vented: that is a result of the run. No allocation, no clock.
class SimulatedOperator {
 public:
  /// @param previous what the tick before gave; before the first tick as constructed
  /// @param next its arm request and dead-man input are written; its time must be set
  void attend(const TickOutput& previous, TickInput& next) noexcept {
    started_ |= previous.mode == Mode::active;
    next.requests.arm = !started_ && previous.reason == Reason::waiting_for_arm;
    next.newest_go_ns = next.now_ns;
  }

 private:
  bool started_ = false;
};

}  // namespace softarm
