// What the driver of a valve terminal reports, as plain values.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "softarm/actuation/pressure_allocator.hpp"
#include "softarm/valves/valve_guard.hpp"

namespace softarm {

/// Why pressures are not what was commanded (valves_status_t).
struct ValvesStatus {
  std::int64_t time_us = 0;    ///< the driver's monotonic clock
  std::int64_t sequence = -1;  ///< of the command whose set points are written; -1: none
  ValveState state = ValveState::disconnected;
  ValveReason reason = ValveReason::none;
  int chamber = -1;  ///< that the reason is about; -1: none
  // Since the start of the driver.
  std::int64_t cycles = 0;  ///< writes and reads that went well
  std::int64_t connections = 0;
  std::int64_t connections_lost = 0;
  std::int64_t exceptions = 0;        ///< exception replies of the terminal
  std::int64_t no_answers = 0;        ///< too late, or not to the question
  std::int64_t times_degraded = 0;    ///< it did not trust the terminal, and wrote zeros
  std::int64_t late_cycles = 0;       ///< missed and skipped
  std::int64_t commands_refused = 0;  ///< malformed, of another arm, or hostile
  PressureVector set_point_bar;       ///< written last
  PressureVector actual_bar;          ///< read back last
};

/// False, and `out` unspecified, unless `bytes` are exactly one valves_status_t.
bool decode(std::span<const std::byte> bytes, ValvesStatus& out);

}  // namespace softarm
