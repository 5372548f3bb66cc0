// What a replay found, for people.
#pragma once

#include <string>

#include "softarm/recording/replay.hpp"
#include "softarm/transport/event_log.hpp"

namespace softarm {

/// Every tick was in an undamaged log, and every command and status is the same, bit for bit.
bool is_identical(const ReplaySummary& summary, const EventLogReader& log);

/// Counts, gaps, the first difference and the verdict, in lines.
/// @param log_name of what `log` has read
std::string replay_text(const ReplaySummary& summary, const EventLogReader& log,
                        const std::string& log_name);

}  // namespace softarm
