#include "softarm/recording/replay_text.hpp"

#include <fmt/format.h>

namespace softarm {
namespace {

std::string counts_text(const ReplaySummary& summary) {
  std::string text =
      fmt::format("{} ticks of {} {} of the daemon, {:.3f} s\n", summary.ticks, summary.runs,
                  summary.runs == 1 ? "run" : "runs", summary.duration_s);
  const auto add = [&](const char* what, const ReplayCount& count) {
    text += fmt::format("  {:<34} {:>10} compared, {} different\n", what, count.compared,
                        count.different);
  };
  add("commands as decided (double)", summary.records);
  add("commands as sent", summary.commands);
  add("statuses", summary.statuses);
  if (summary.after_gap.compared > 0) add("commands after a gap, no proof", summary.after_gap);
  return text;
}

std::string damage_text(const ReplaySummary& summary, const EventLogReader& log,
                        const std::string& log_name) {
  if (log.damage_count() == 0 && summary.malformed == 0) return "";
  std::string text;
  for (const LogDamage& each : log.damages())
    text += fmt::format("damage: bytes {} to {} of {} hold no whole message\n", each.begin,
                        each.end, log_name);
  return text + fmt::format(
                    "{} damaged stretches, {} bytes; {} messages on our channels that could not be "
                    "decoded; "
                    "what precedes and follows them was used\n",
                    log.damage_count(), log.damaged_bytes(), summary.malformed);
}

std::string gaps_text(const ReplaySummary& summary) {
  std::string text;
  for (const ReplayGap& gap : summary.gaps)
    text += fmt::format(
        "gap: ticks {} to {} are not in the log ({} of them, before {:.3f} s, byte {})\n",
        gap.first, gap.last, gap.last - gap.first + 1, gap.time_s, gap.position);
  if (summary.gap_count > static_cast<std::int64_t>(summary.gaps.size()))
    text += fmt::format("gaps: {} in all, {} ticks\n", summary.gap_count, summary.missing_ticks);
  if (summary.gap_count == 0) return text;
  text += fmt::format(
      "The pipeline's state after a gap is not known, so nothing after it is proof. {}\n",
      summary.agrees_again < 0
          ? "Commands did not come to agree again."
          : fmt::format("Commands agree again from tick {} on.", summary.agrees_again));
  if (summary.gaps.front().first == 1)
    text += "The first ticks are missing: start lcm-logger before the daemon.\n";
  return text;
}

std::string difference_text(const ReplayDifference& first) {
  std::string text = fmt::format(
      "first difference: tick {} of run {}, {:.6f} s after its first, byte {} of the log\n",
      first.tick, first.run, first.time_s, first.position);
  for (const FieldDifference& each : first.fields)
    text += fmt::format("  {}{}: recorded {}, replayed {}\n", each.field,
                        each.unit.empty() ? "" : fmt::format(" [{}]", each.unit), each.recorded,
                        each.replayed);
  return text + "DIFFERENT\n";
}

}  // namespace

bool is_identical(const ReplaySummary& summary, const EventLogReader& log) {
  return summary.complete() && log.damage_count() == 0;
}

std::string replay_text(const ReplaySummary& summary, const EventLogReader& log,
                        const std::string& log_name) {
  const std::string text =
      counts_text(summary) + damage_text(summary, log, log_name) + gaps_text(summary);
  if (summary.different()) return text + difference_text(summary.first);
  if (is_identical(summary, log))
    return text + "IDENTICAL: every command and status, bit for bit\n";
  return text + (summary.records.compared + summary.commands.compared == 0
                     ? "INCOMPLETE: nothing could be compared\n"
                     : "INCOMPLETE: what could be compared is identical, bit for bit\n");
}

}  // namespace softarm
