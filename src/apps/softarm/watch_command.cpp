// softarm watch: observes a running arm over LCM, and records it in the same files as `softarm
// run`.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <memory>

#include "apps/program.hpp"
#include "apps/progress.hpp"
#include "apps/signals.hpp"
#include "apps/softarm/commands.hpp"
#include "apps/softarm/learned_output.hpp"
#include "apps/softarm/live_view.hpp"
#include "softarm/client/operator_client.hpp"
#include "softarm/config/load.hpp"
#include "softarm/recording/status_record.hpp"

namespace softarm {
namespace {

constexpr std::int64_t kSilence_ns = 10'000'000'000;  ///< without any status: no daemon is running

struct WatchOptions {
  std::string config;
  std::string out, learned;
  double duration_s = 0.0;
};

/// One line, for output that is not a terminal.
std::string progress_text(const StatusRecord& record, double duration_s) {
  const ArmStatus& status = record.status();
  std::string text = fmt::format("{:6.1f} s {:<11} frame age {:4.1f} ms ", record.time_s(),
                                 name(status.mode), 1e3 * status.frame_age_s);
  if (status.mode != Mode::active) text += " (" + status.reason_text() + ")";
  if (status.shadow) text += " shadow";
  if (duration_s > 0.0) text += fmt::format(" {:3.0f} %", 100.0 * record.active_s() / duration_s);
  for (int i = 0; i < std::min(status.segments(), 4); ++i)
    text += fmt::format("  theta{} {:.3f} rad", i + 1, status.theta_rad[i]);
  return text;
}

int watch(const WatchOptions& options) {
  const Experiment experiment = load_experiment(options.config);
  catch_stop_signals();
  const LcmSettings& lcm = experiment.transport.lcm;
  if (const std::string warning = network_warning(lcm.url); !warning.empty())
    say(fmt::format("softarm: warning: {}\n", warning));
  OperatorClient client(lcm);
  client.listen(lcm.plant_channel);
  client.listen(lcm.timing_channel);
  client.listen(lcm.observer_channel);
  StatusRecord record(experiment, options.out);
  LearnedOutput learned(options.learned, experiment, options.config);
  std::int64_t last_status_ns = client.now_ns();
  client.on_message([&](const ArmMessage& message) {
    if (record.take(message.channel, message.bytes)) last_status_ns = client.now_ns();
  });

  Progress progress(true);
  LiveView view(experiment);
  const auto done = [&] {
    return options.duration_s > 0.0 && record.active_s() >= options.duration_s;
  };
  while (stop_requested == 0 && !done() && record.failure().empty()) {
    client.update(client.now_ns() + 100'000'000);
    if (client.now_ns() - last_status_ns > kSilence_ns) {
      print_error("softarm",
                  fmt::format("no status on {} for {} s: is softarmd {} running?",
                              lcm.status_channel, kSilence_ns / 1'000'000'000, options.config));
      record.close();
      return kExitFailure;
    }
    if (options.duration_s > 0.0 && record.rows() > 0 && record.status().mode == Mode::fault) {
      print_error(
          "softarm",
          fmt::format("the arm is in FAULT ({}) after {:.1f} of {:.1f} s of ACTIVE: fix the "
                      "cause, `softarm disarm` and `softarm arm`, then watch again",
                      name(record.status().reason), record.active_s(), options.duration_s));
      record.close();
      return kExitFailure;
    }
    if (record.rows() > 0 && view.due()) view.draw(record);
    if (record.rows() > 0 && isatty(STDERR_FILENO) == 0 && progress.due())
      progress.update(progress_text(record, options.duration_s));
  }
  record.close();
  if (record.rows() == 0)
    return fail("softarm", kExitFailure, fmt::format("no status on {}", lcm.status_channel));
  fmt::print("{}", record.table());
  std::string failure = learned.write(record.summary().observer(), "a run that was watched");
  if (!record.failure().empty()) failure = record.failure();
  if (failure.empty()) return kExitOk;
  return fail("softarm", kExitFailure, failure);
}

}  // namespace

void add_watch_command(CLI::App& app) {
  auto options = std::make_shared<WatchOptions>();
  CLI::App* command = app.add_subcommand("watch", "Watch a running arm over LCM, and record it");
  command->add_option("CONFIG", options->config, "experiment in YAML")->required();
  command->add_option("--out", options->out,
                      "folder for log.csv, summary.json and timing.json (default: no record)");
  command
      ->add_option("--duration", options->duration_s,
                   "stop after so many seconds of ACTIVE (default: at Ctrl-C)")
      ->check(positive_seconds());
  add_learned_option(*command, options->learned);
  run_where_given(*command, [options] { return watch(*options); });
}

}  // namespace softarm
