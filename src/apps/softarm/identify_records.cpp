// softarm identify: the motions to identify from.
#include <fmt/format.h>

#include <algorithm>

#include "apps/program.hpp"
#include "apps/progress.hpp"
#include "apps/signals.hpp"
#include "apps/softarm/identify_parts.hpp"
#include "softarm/commissioning/identification/live_experiment.hpp"

namespace softarm {
namespace {

MotionRecord play(const Experiment& experiment, const IdentifyCommand& command) {
  catch_stop_signals();
  ignore_broken_pipes();
  Progress progress(true);
  const LiveOutcome outcome = play_steps(
      experiment, command.plan, [] { return stop_requested != 0; },
      [&](const std::string& text) { progress.update(text); });
  release_stop_signals();  // the arm no longer moves
  if (!outcome.aborted.empty())
    throw std::runtime_error("vented, nothing identified: " + outcome.aborted);
  return outcome.record;
}

}  // namespace

MotionRecord record_of(const Experiment& experiment, const std::string& log,
                       IdentifyCommand& command) {
  const LoggedMotion logged = read_log(experiment, log, command.input);
  if (!logged.damage.empty())
    command.damage +=
        fmt::format("{}{}: {}", command.damage.empty() ? "" : "; ", log, logged.damage);
  if (!logged.notes.empty()) say(fmt::format("softarm: warning: {}: {}\n", log, logged.notes));
  MotionRecord record = logged.record;
  const double end_s = record.time_s[record.time_s.size() - 1] + 1e-6;
  const double to_s = command.to_s > 0.0 ? std::min(command.to_s, end_s) : end_s;
  record = record.part(command.from_s, to_s, 0.0);
  record.scored_from_s = std::max(logged.record.scored_from_s, command.from_s + command.skip_s);
  if (command.apart_s > 0.0) record = record.thinned(command.apart_s);
  return record;
}

std::vector<MotionRecord> records_of(const Experiment& experiment, IdentifyCommand& command) {
  if (command.live) return {play(experiment, command)};
  if (command.logs.empty()) return {record_step_response(experiment, command.plan)};
  std::vector<MotionRecord> records;
  for (const std::string& log : command.logs)
    records.push_back(record_of(experiment, log, command));
  return records;
}

}  // namespace softarm
