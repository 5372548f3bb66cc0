// softarm replay: checks that the pipeline gives again, bit for bit, what a log recorded of it.
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "apps/program.hpp"
#include "apps/progress.hpp"
#include "apps/softarm/commands.hpp"
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

using Json = nlohmann::ordered_json;

Json json_of(const ReplayCount& count) {
  return {{"compared", count.compared}, {"different", count.different}};
}

Json json_of(const ReplayDifference& first) {
  Json fields = Json::array();
  for (const FieldDifference& each : first.fields)
    fields.push_back({{"field", each.field},
                      {"unit", each.unit},
                      {"recorded", each.recorded},
                      {"replayed", each.replayed}});
  return {{"run", first.run},
          {"tick", first.tick},
          {"time_s", first.time_s},
          {"position", first.position},
          {"fields", std::move(fields)}};
}

std::string json_report(const ReplaySummary& summary, const EventLogReader& log) {
  const Json json{
      {"identical", is_identical(summary, log)},
      {"runs", summary.runs},
      {"ticks", summary.ticks},
      {"duration_s", summary.duration_s},
      {"commands_decided", json_of(summary.records)},
      {"commands_sent", json_of(summary.commands)},
      {"statuses", json_of(summary.statuses)},
      {"after_gap", json_of(summary.after_gap)},
      {"missing_ticks", summary.missing_ticks},
      {"gaps", summary.gap_count},
      {"damages", log.damage_count()},
      {"damaged_bytes", log.damaged_bytes()},
      {"malformed", summary.malformed},
      {"recorded_build", summary.recorded_build},
      {"same_build", !summary.other_build},
      {"first_difference", summary.different() ? json_of(summary.first) : Json(nullptr)}};
  // The record may contain any bytes.
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

int replay(const ReplayOptions& options) {
  const Experiment experiment = load_experiment(options.config);
  if (experiment.transport.lcm.tick_channel.empty())
    return fail("softarm", kExitConfiguration,
                fmt::format("{}: daemon.lcm.tick_channel is empty, so nothing was "
                            "recorded that could be replayed",
                            options.config));
  EventLogReader log(std::filesystem::path(options.log));
  const auto size = static_cast<double>(std::filesystem::file_size(options.log));
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
    return fail("softarm", kExitConfiguration, fmt::format("{}: {}", options.config, other.what()));
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
      "Run the pipeline again on a log of lcm-logger, and check that every command is the same");
  command->add_option("LOG", options->log, "log of lcm-logger, with the daemon's messages")
      ->required();
  command->add_option("CONFIG", options->config, "the daemon's configuration")->required();
  command->add_flag("--any-configuration", options->any_configuration,
                    "go on where the log was recorded with another configuration");
  command->add_flag("--json", options->json, "print the result as JSON");
  command->footer(
      "Exit code: 0 every command identical, 2 one differs, 65 the log is damaged, has gaps or no "
      "ticks (what could be compared is identical), 78 another configuration.");
  run_where_given(*command, [options] { return replay(*options); });
}

}  // namespace softarm
