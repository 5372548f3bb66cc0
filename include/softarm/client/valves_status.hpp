// What the driver of a valve terminal reports, as plain values.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "softarm/actuation/pressure_allocator.hpp"
#include "softarm/valves/valve_guard.hpp"

namespace softarm {

/// State and counters of the driver of a valve terminal (valves_status_t): why pressures are not
/// what was commanded.
struct ValvesStatus {
  std::int64_t time_us = 0;    ///< the driver's monotonic clock
  std::int64_t sequence = -1;  ///< of the command whose set points were written; -1: none
  ValveState state = ValveState::disconnected;
  ValveReason reason = ValveReason::none;
  int chamber = -1;  ///< chamber that the reason refers to; -1: none
  // Since the start of the driver.
  std::int64_t cycles = 0;  ///< successful writes and reads
  std::int64_t connections = 0;
  std::int64_t connections_lost = 0;
  std::int64_t exceptions = 0;        ///< exception replies of the terminal
  std::int64_t no_answers = 0;        ///< reply late, or to another request
  std::int64_t times_degraded = 0;    ///< entries into DEGRADED, where zeros are written
  std::int64_t late_cycles = 0;       ///< missed and skipped
  std::int64_t commands_refused = 0;  ///< malformed, for another arm, or hostile
  PressureVector set_point_bar;       ///< written last, bar
  PressureVector actual_bar;          ///< read back last, bar
};

/// Decodes one valves_status_t. Returns false, and leaves `out` unspecified, unless `bytes` are
/// exactly one such message.
bool decode(std::span<const std::byte> bytes, ValvesStatus& out);

}  // namespace softarm
