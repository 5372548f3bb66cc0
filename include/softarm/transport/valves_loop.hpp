// The valve driver in real time: the loop of softarm-valves.
#pragma once

#include <cstdint>
#include <functional>

#include "softarm/transport/valves_link.hpp"

namespace softarm {

/// Runs the driver's cycle at its rate and counts late cycles. Use from one thread.
class ValvesLoop {
 public:
  /// Passed to the callback after each cycle.
  struct Report {
    std::int64_t now_ns;          ///< CLOCK_MONOTONIC at the start of the cycle
    std::int64_t since_start_ns;  ///< since the start of run()
    bool changed;                 ///< state, reason or chamber have changed
    bool on_time;                 ///< the next cycle's deadline was kept
  };

  /// @param driver  must outlive this  @throws TransportError
  ValvesLoop(const LcmSettings& lcm, double rate_hz, ValveDriver& driver);

  /// Cycles until `stop_requested` returns true and zero pressure is confirmed or cannot be;
  /// returns whether it was confirmed. Neither allocates nor throws as long as the callbacks do
  /// not.
  bool run(const std::function<bool()>& stop_requested,
           const std::function<void(const Report&)>& after_cycle);

  /// Cycles missed and skipped.
  std::int64_t late_cycles() const noexcept { return late_cycles_; }
  /// Commands that were malformed or for another arm.
  std::int64_t refused() const noexcept { return link_.refused(); }

 private:
  ValveDriver& driver_;
  ValvesLink link_;
  std::int64_t period_ns_;
  std::int64_t late_cycles_ = 0;
};

}  // namespace softarm
