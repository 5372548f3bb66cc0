// softarm watch: looks at a running arm over LCM, and records it in the same files as `softarm
// run`.
#include <fmt/format.h>

#include <memory>

#include "program.hpp"
#include "progress.hpp"
#include "signals.hpp"
#include "softarm/commands.hpp"
#include "softarm/config/load.hpp"
#include "softarm/daemon/realtime.hpp"
#include "softarm/transport/lcm_node.hpp"
#include "status_record.hpp"

namespace softarm {
namespace {

constexpr std::int64_t kSilence_ns = 10'000'000'000;  ///< without any status: nobody is there

struct WatchOptions {
  std::string config;
  std::string out;
  double duration_s = 0.0;
};

std::string progress_text(const StatusRecord& record, double duration_s) {
  const auto& status = record.status();
  std::string text = fmt::format("{:6.1f} s {:<11} frame age {:4.1f} ms ", record.time_s(),
                                 name(static_cast<Mode>(status.mode)), 1e3 * status.frame_age_s);
  if (static_cast<Mode>(status.mode) != Mode::active)
    text += fmt::format(" ({})", name(static_cast<Reason>(status.reason)));
  if (duration_s > 0.0) text += fmt::format(" {:3.0f} %", 100.0 * record.active_s() / duration_s);
  const int shown = std::min<int>(status.num_segments, 4);
  for (std::size_t i = 0; i < static_cast<std::size_t>(shown); ++i)
    text += fmt::format("  theta{} {:.3f} rad", i + 1, status.theta_rad[i]);
  return text;
}

int watch(const WatchOptions& options) {
  const Experiment experiment = load_experiment(options.config);
  catch_stop_signals();
  const LcmSettings& lcm = experiment.daemon.lcm;
  LcmNode node(lcm.url);
  StatusRecord record(experiment, options.out);
  std::int64_t last_status_ns = monotonic_now_ns();
  for (const std::string& channel : {lcm.status_channel, lcm.plant_channel, lcm.timing_channel}) {
    node.subscribe(channel, 1024, [&, channel](const ReceivedMessage& packet) {
      if (record.take(channel, packet.bytes)) last_status_ns = monotonic_now_ns();
    });
  }

  Progress progress(true);
  const auto done = [&] {
    return options.duration_s > 0.0 && record.active_s() >= options.duration_s;
  };
  while (stop_requested == 0 && !done()) {
    node.wait_until(monotonic_now_ns() + 100'000'000);
    record.write_rows(false);
    if (monotonic_now_ns() - last_status_ns > kSilence_ns) {
      print_error("softarm",
                  fmt::format("no status on {} for {} s: is softarmd {} running?",
                              lcm.status_channel, kSilence_ns / 1'000'000'000, options.config));
      record.close();
      return kExitFailure;
    }
    if (record.rows() > 0 && progress.due())
      progress.update(progress_text(record, options.duration_s));
  }
  record.close();
  fmt::print("{}", record.table());
  return kExitOk;
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
  command->callback([options] {
    if (const int code = watch(*options); code != kExitOk) throw CLI::RuntimeError(code);
  });
}

}  // namespace softarm
