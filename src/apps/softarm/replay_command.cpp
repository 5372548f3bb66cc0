// softarm replay: does the pipeline say again, bit for bit, what a log says it said?
#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include "apps/program.hpp"
#include "apps/progress.hpp"
#include "apps/softarm/commands.hpp"
#include "softarm/base/json_writer.hpp"
#include "softarm/base/version.hpp"
#include "softarm/config/load.hpp"
#include "softarm/recording/replay.hpp"

namespace softarm {
namespace {

struct ReplayOptions {
  std::string log, config;
  bool any_configuration = false;
  bool json = false;
};

int exit_code(const ReplaySummary& summary, const EventLogReader& log) {
  if (summary.different()) return kExitDifferent;
  return summary.complete() && log.damage_count() == 0 ? kExitOk : kExitData;
}

void say_counts(const ReplaySummary& summary) {
  const auto line = [](const char* what, const ReplayCount& count) {
    fmt::print("  {:<34} {:>10} compared, {} different\n", what, count.compared, count.different);
  };
  fmt::print("{} ticks of {} {} of the daemon, {:.3f} s\n", summary.ticks, summary.runs,
             summary.runs == 1 ? "run" : "runs", summary.duration_s);
  line("commands as decided (double)", summary.records);
  line("commands as sent", summary.commands);
  line("statuses", summary.statuses);
  if (summary.after_gap.compared > 0) line("commands after a gap, no proof", summary.after_gap);
}

void say_gaps(const ReplaySummary& summary) {
  for (const ReplayGap& gap : summary.gaps)
    fmt::print("gap: ticks {} to {} are not in the log ({} of them, before {:.3f} s, byte {})\n",
               gap.first, gap.last, gap.last - gap.first + 1, gap.time_s, gap.position);
  if (summary.gap_count > static_cast<std::int64_t>(summary.gaps.size()))
    fmt::print("gaps: {} in all, {} ticks\n", summary.gap_count, summary.missing_ticks);
  if (summary.gap_count == 0) return;
  fmt::print("The pipeline's state after a gap is not known, so nothing after it is proof. {}\n",
             summary.agrees_again < 0
                 ? "Commands did not come to agree again."
                 : fmt::format("Commands agree again from tick {} on.", summary.agrees_again));
  if (summary.gaps.front().first == 1)
    fmt::print("The first ticks are missing: start lcm-logger before the daemon.\n");
}

void say_difference(const ReplayDifference& first) {
  fmt::print("first difference: tick {} of run {}, {:.6f} s after its first, byte {} of the log\n",
             first.tick, first.run, first.time_s, first.position);
  for (const FieldDifference& each : first.fields)
    fmt::print("  {}{}: recorded {}, replayed {}\n", each.field,
               each.unit.empty() ? "" : fmt::format(" [{}]", each.unit), each.recorded,
               each.replayed);
}

void say_report(const ReplayOptions& options, const ReplaySummary& summary,
                const EventLogReader& log) {
  say_counts(summary);
  if (log.damage_count() > 0 || summary.malformed > 0) {
    for (const LogDamage& each : log.damages())
      fmt::print("damage: bytes {} to {} of {} hold no whole message\n", each.begin, each.end,
                 options.log);
    fmt::print(
        "{} damaged stretches, {} bytes; {} messages on our channels that are none; what "
        "precedes and follows them was used\n",
        log.damage_count(), log.damaged_bytes(), summary.malformed);
  }
  say_gaps(summary);
  if (summary.different()) {
    say_difference(summary.first);
    fmt::print("DIFFERENT\n");
  } else {
    fmt::print("{}\n", exit_code(summary, log) == kExitOk
                           ? "IDENTICAL: every command and status, bit for bit"
                       : summary.records.compared + summary.commands.compared == 0
                           ? "INCOMPLETE: nothing could be compared"
                           : "INCOMPLETE: what could be compared is identical, bit for bit");
  }
}

void write_count(JsonWriter& json, const char* name, const ReplayCount& count) {
  json.key(name);
  json.open_object();
  json.member("compared", count.compared);
  json.member("different", count.different);
  json.close_object();
}

void write_difference(JsonWriter& json, const ReplaySummary& summary) {
  json.key("first_difference");
  if (!summary.different()) return json.null();
  json.open_object();
  json.member("run", summary.first.run);
  json.member("tick", summary.first.tick);
  json.member("time_s", summary.first.time_s);
  json.member("position", summary.first.position);
  json.key("fields");
  json.open_array();
  for (const FieldDifference& each : summary.first.fields) {
    json.open_object();
    json.member("field", each.field);
    json.member("unit", each.unit);
    json.member("recorded", each.recorded);
    json.member("replayed", each.replayed);
    json.close_object();
  }
  json.close_array();
  json.close_object();
}

std::string json_report(const ReplaySummary& summary, const EventLogReader& log) {
  JsonWriter json;
  json.open_object();
  json.member("identical", exit_code(summary, log) == kExitOk);
  json.member("runs", summary.runs);
  json.member("ticks", summary.ticks);
  json.member("duration_s", summary.duration_s);
  write_count(json, "commands_decided", summary.records);
  write_count(json, "commands_sent", summary.commands);
  write_count(json, "statuses", summary.statuses);
  write_count(json, "after_gap", summary.after_gap);
  json.member("missing_ticks", summary.missing_ticks);
  json.member("gaps", summary.gap_count);
  json.member("damages", log.damage_count());
  json.member("damaged_bytes", log.damaged_bytes());
  json.member("malformed", summary.malformed);
  json.member("recorded_build", summary.recorded_build);
  json.member("same_build", !summary.other_build);
  write_difference(json, summary);
  json.close_object();
  return json.text();
}

int replay(const ReplayOptions& options) {
  const Experiment experiment = load_experiment(options.config);
  if (experiment.transport.lcm.tick_channel.empty()) {
    print_error("softarm", fmt::format("{}: daemon.lcm.tick_channel is empty, so nothing was "
                                       "recorded that could be replayed",
                                       options.config));
    return kExitConfiguration;
  }
  std::ifstream file(options.log, std::ios::binary);
  std::error_code error;
  const auto size = static_cast<double>(std::filesystem::file_size(options.log, error));
  if (!file || error) {
    print_error("softarm", fmt::format("{} cannot be read", options.log));
    return kExitFailure;
  }
  EventLogReader log(file);
  Replay replay(experiment, build_text(), options.any_configuration);
  try {
    Progress progress(true);
    for (LogEvent event; log.next(event);) {
      replay.take(event);
      if (progress.due())
        progress.update(fmt::format("replay: {} ticks, {:.0f} % of the log", replay.summary().ticks,
                                    100.0 * static_cast<double>(log.position()) / size));
    }
    replay.finish();
  } catch (const OtherConfiguration& other) {
    print_error("softarm", fmt::format("{}: {}", options.config, other.what()));
    return kExitConfiguration;
  }
  const ReplaySummary& summary = replay.summary();
  if (summary.other_build)
    say(
        fmt::format("softarm: warning: another build made the recording, bits may differ\n"
                    "  recorded by {}\n  replayed by {}\n",
                    summary.recorded_build, build_text()));
  if (options.json) {
    fmt::print("{}\n", json_report(summary, log));
  } else {
    say_report(options, summary, log);
  }
  if (summary.ticks == 0)
    print_error("softarm",
                fmt::format("{} holds no record of a tick on channel {}: {}", options.log,
                            experiment.transport.lcm.tick_channel,
                            summary.malformed > 0
                                ? "what is there was malformed, or recorded by another version"
                                : "was lcm-logger started before the daemon, and is this the "
                                  "daemon's configuration?"));
  return exit_code(summary, log);
}

}  // namespace

void add_replay_command(CLI::App& app) {
  auto options = std::make_shared<ReplayOptions>();
  CLI::App* command = app.add_subcommand(
      "replay",
      "Run the pipeline on what a log of lcm-logger recorded; is every command the same?");
  command->add_option("LOG", options->log, "log of lcm-logger, with what the daemon said")
      ->required();
  command->add_option("CONFIG", options->config, "the daemon's configuration")->required();
  command->add_flag("--any-configuration", options->any_configuration,
                    "go on where the log was recorded with another configuration");
  command->add_flag("--json", options->json, "print the result as JSON");
  command->footer(
      "Exit code: 0 every command identical, 2 one differs, 65 the log is damaged, has gaps or no "
      "ticks (what could be compared is identical), 78 another configuration.");
  command->callback([options] {
    if (const int code = replay(*options); code != kExitOk) throw CLI::RuntimeError(code);
  });
}

}  // namespace softarm
