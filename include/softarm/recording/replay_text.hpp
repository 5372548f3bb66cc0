// The result of a replay as text.
#pragma once

#include <string>

#include "softarm/recording/replay.hpp"
#include "softarm/transport/event_log.hpp"

namespace softarm {

/// Whether every tick was in an undamaged log, and every command and status is the same, bit for
/// bit.
bool is_identical(const ReplaySummary& summary, const EventLogReader& log);

/// Counts, gaps, the first difference and the verdict, in lines.
/// @param log_name  file name of `log`
std::string replay_text(const ReplaySummary& summary, const EventLogReader& log,
                        const std::string& log_name);

}  // namespace softarm
