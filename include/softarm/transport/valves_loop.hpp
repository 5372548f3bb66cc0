// The valve driver in real time: what softarm-valves runs.
#pragma once

#include <cstdint>
#include <functional>

#include "softarm/transport/valves_link.hpp"

namespace softarm {

/// Keeps the rate, and the account of how well it was kept. Belongs to one thread.
class ValvesLoop {
 public:
  /// After each cycle.
  struct Report {
    std::int64_t now_ns;          ///< CLOCK_MONOTONIC at its start
    std::int64_t since_start_ns;  ///< of run()
    bool changed;                 ///< state, reason or chamber
    bool on_time;                 ///< the next cycle's deadline was kept
  };

  /// `driver` must outlive this. @throws TransportError
  ValvesLoop(const LcmSettings& lcm, double rate_hz, ValveDriver& driver);

  /// Cycles until `stop_requested` returns true and zero is confirmed, or cannot be; true if it
  /// was. Neither allocates nor throws, as long as the functions do not.
  bool run(const std::function<bool()>& stop_requested,
           const std::function<void(const Report&)>& after_cycle);

  std::int64_t late_cycles() const noexcept { return late_cycles_; }
  std::int64_t refused() const noexcept { return link_.refused(); }

 private:
  ValveDriver& driver_;
  ValvesLink link_;
  std::int64_t period_ns_;
  std::int64_t late_cycles_ = 0;
};

}  // namespace softarm
