// softarm report: evaluates a recorded LCM log (lcm-logger) of a run, with the same files and plots
// as `softarm run`; or puts the summaries of a folder of runs into one table.
#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "apps/program.hpp"
#include "apps/progress.hpp"
#include "apps/softarm/commands.hpp"
#include "apps/softarm/learned_output.hpp"
#include "apps/softarm/plots.hpp"
#include "softarm/config/load.hpp"
#include "softarm/recording/runs_table.hpp"
#include "softarm/recording/status_record.hpp"
#include "softarm/transport/event_log.hpp"

namespace softarm {
namespace {

struct ReportOptions {
  std::string log;
  std::string config;
  std::string out = "out";
  std::string learned;
  bool plots = true;
};

int report(const ReportOptions& options) {
  const Experiment experiment = load_experiment(options.config);
  EventLogReader log(std::filesystem::path(options.log));
  const auto size = static_cast<double>(std::filesystem::file_size(options.log));
  StatusRecord record(experiment, options.out, {options.log});
  LearnedOutput learned(options.learned, experiment, options.config, {options.log});
  Progress progress;
  for (LogEvent event; record.failure().empty() && log.next(event);) {
    record.take(event.channel, event.data);
    if (progress.due()) {
      progress.update(fmt::format("{:3.0f} % of {}, {:.0f} s",
                                  100.0 * static_cast<double>(log.position()) / size, options.log,
                                  record.time_s()));
    }
  }
  record.close();
  if (record.rows() == 0)
    return fail(
        "softarm", kExitData,
        fmt::format("{} holds no status of an arm of {} segments on channel {}; "
                    "daemon.lcm.status_channel is the one expected",
                    options.log, experiment.arm.size(), experiment.transport.lcm.status_channel));
  if (record.status().configuration_hash != experiment.hash) {
    say(fmt::format(
        "softarm: warning: the log was made with configuration {:016x}, {} is {:016x}: what the "
        "report takes from the configuration may differ from what was in force\n",
        record.status().configuration_hash, options.config, experiment.hash));
  }
  fmt::print("{}log, summary and timing are in {}\n", record.table(), options.out);
  if (options.plots) draw_plots(options.out);
  std::string failure = learned.write(record.summary().observer(), options.log);
  if (!record.failure().empty()) failure = record.failure();
  if (!failure.empty()) return fail("softarm", kExitFailure, failure);
  if (log.damage_count() > 0)
    return fail("softarm", kExitData, options.log + ": " + log.damage_text());
  return kExitOk;
}

int tabulate(const std::string& folder) {
  const RunsTable table = runs_table(folder);
  fmt::print("{}", table.text);
  for (const auto& file : table.unreadable)
    print_error("softarm",
                file.string() + ": expected the summary of a run, got none that can be read");
  return table.unreadable.empty() ? kExitOk : kExitFailure;
}

}  // namespace

void add_report_command(CLI::App& app) {
  auto options = std::make_shared<ReportOptions>();
  CLI::App* command = app.add_subcommand(
      "report", "Tables and plots of a recorded LCM log, or one table of a folder of runs");
  command->add_option("LOG", options->log, "log of lcm-logger, or a folder of runs")->required();
  command->add_option("CONFIG", options->config, "the experiment that the log was recorded of");
  command
      ->add_option("--out", options->out, "folder for log.csv, summary.json, timing.json and plots")
      ->capture_default_str();
  add_learned_option(*command, options->learned);
  command->add_flag("!--no-plots", options->plots, "do not draw the plots");
  run_where_given(*command, [options]() -> int {
    if (std::filesystem::is_directory(options->log)) return tabulate(options->log);
    if (options->config.empty()) throw CLI::RequiredError("CONFIG");
    return report(*options);
  });
}

}  // namespace softarm
