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
#include "softarm/recording/replay_text.hpp"

namespace softarm {
namespace {

struct ReplayOptions {
  std::string log, config;
  bool any_configuration = false;
  bool json = false;
};

int exit_code(const ReplaySummary& summary, const EventLogReader& log) {
  if (summary.different()) return kExitDifferent;
  return is_identical(summary, log) ? kExitOk : kExitData;
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
  json.member("identical", is_identical(summary, log));
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
    fmt::print("{}", replay_text(summary, log, options.log));
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
