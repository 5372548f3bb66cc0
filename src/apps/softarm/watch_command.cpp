// softarm watch: looks at a running arm over LCM, and records it in the same files as `softarm
// run`.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "apps/program.hpp"
#include "apps/progress.hpp"
#include "apps/signals.hpp"
#include "apps/softarm/commands.hpp"
#include "softarm/base/clock.hpp"
#include "softarm/base/time.hpp"
#include "softarm/config/load.hpp"
#include "softarm/recording/status_record.hpp"
#include "softarm/transport/lcm_node.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {
namespace {

constexpr std::int64_t kSilence_ns = 10'000'000'000;  ///< without any status: nobody is there

struct WatchOptions {
  std::string config;
  std::string out;
  double duration_s = 0.0;
};

/// One line, for where there is no terminal.
std::string progress_text(const StatusRecord& record, double duration_s) {
  const auto& status = record.status();
  std::string text = fmt::format("{:6.1f} s {:<11} frame age {:4.1f} ms ", record.time_s(),
                                 name(static_cast<Mode>(status.mode)), 1e3 * status.frame_age_s);
  if (static_cast<Mode>(status.mode) != Mode::active)
    text += fmt::format(" ({})", name(static_cast<Reason>(status.reason)));
  if ((status.flags & status.SHADOW) != 0) text += " shadow";
  if (duration_s > 0.0) text += fmt::format(" {:3.0f} %", 100.0 * record.active_s() / duration_s);
  const int shown = std::min<int>(status.num_segments, 4);
  for (std::size_t i = 0; i < static_cast<std::size_t>(shown); ++i)
    text += fmt::format("  theta{} {:.3f} rad", i + 1, status.theta_rad[i]);
  return text;
}

/// Everything at a glance, on a terminal: redrawn in place, and left standing at the end.
class LiveView {
 public:
  explicit LiveView(const Experiment& experiment) : experiment_(experiment) {}

  bool due() const {
    return isatty(STDERR_FILENO) != 0 && monotonic_now_ns() - drawn_ns_ >= kPeriod_ns;
  }

  void draw(const StatusRecord& record) {
    const auto& status = record.status();
    update_rates(record);
    std::string text = fmt::format(
        "{:.1f} s   {} ({}){}{}\nstatus {:.1f} Hz   frames {:.1f} Hz, {:.1f} ms old\n"
        "frames {} accepted, {} rejected, {} repeated, {} missing   ticks {} missed   messages {} "
        "malformed\n",
        record.time_s(), name(static_cast<Mode>(status.mode)),
        name(static_cast<Reason>(status.reason)), flag_text(status.flags),
        status.version.empty() ? "" : "   softarmd " + status.version, status_hz_, frames_hz_,
        1e3 * status.frame_age_s, status.frames_accepted, status.frames_rejected,
        status.frames_repeated, status.frames_missing, status.overruns, status.messages_malformed);
    const bool torque = experiment_.actuation.kind == ActuationKind::torque;
    text += fmt::format("segment   theta [rad]   phi [rad]   error of u [mrad]   {}\n",
                        torque ? "moments [N m]" : "pressures [bar]");
    for (int i = 0; i < std::min<int>(status.num_segments, kShownSegments); ++i)
      text += segment_text(status, static_cast<std::size_t>(i));
    if (status.num_segments > kShownSegments)
      text += fmt::format("... {} segments more\n", status.num_segments - kShownSegments);
    if (lines_ > 0) fmt::print(stderr, "\033[{}A\033[J", lines_);
    fmt::print(stderr, "{}", text);
    lines_ = std::count(text.begin(), text.end(), '\n');
    drawn_ns_ = monotonic_now_ns();
  }

 private:
  static constexpr std::int64_t kPeriod_ns = 200'000'000;
  static constexpr std::int64_t kRateSpan_ns = 1'000'000'000;
  static constexpr int kShownSegments = 12;

  static std::string flag_text(std::int16_t flags) {
    using Status = softarm_messages::controller_status_t;
    constexpr std::pair<std::int16_t, const char*> kNames[] = {
        {Status::SATURATED, "saturated"},
        {Status::SLEW_LIMITED, "slew limited"},
        {Status::REFERENCE_LIMITED, "reference limited"},
        {Status::SOFT_LIMIT, "soft limit"},
        {Status::SHADOW, "shadow"},
        {Status::ARMED, "armed"},
        {Status::BOUNDED, "bounded"}};
    std::string text;
    for (const auto& [flag, name] : kNames)
      if ((flags & flag) != 0) text += fmt::format("   {}", name);
    return text;
  }

  std::string segment_text(const softarm_messages::controller_status_t& status,
                           std::size_t i) const {
    std::string text =
        fmt::format("{:7}   {:11.3f}   {:+9.3f}   ", i + 1, status.theta_rad[i], status.phi_rad[i]);
    if (static_cast<Mode>(status.mode) == Mode::active) {
      const auto off = [&](std::size_t axis) {
        return status.reference_u_rad[i][axis] - status.u_rad[i][axis];
      };
      text += fmt::format("{:17.2f}  ", 1e3F * std::hypot(off(0), off(1)));
    } else {
      text += fmt::format("{:>17}  ", "-");
    }
    const auto& segments = experiment_.actuation.segments;
    std::size_t chamber = 0;
    for (std::size_t before = 0; before < i && before < segments.size(); ++before)
      chamber += segments[before].size();
    const std::size_t end = i < segments.size() ? chamber + segments[i].size() : chamber;
    for (; chamber < std::min(end, status.pressure_bar.size()); ++chamber)
      text += fmt::format(" {:6.3f}", status.pressure_bar[chamber]);
    return text + "\n";
  }

  void update_rates(const StatusRecord& record) {
    const std::int64_t now_ns = monotonic_now_ns();
    const std::int64_t span_ns = now_ns - counted_ns_;
    if (span_ns < kRateSpan_ns) return;
    if (counted_ns_ > 0) {
      const double span_s = to_seconds(span_ns);
      status_hz_ = static_cast<double>(record.rows() - rows_) / span_s;
      frames_hz_ = static_cast<double>(record.status().frames_accepted - frames_) / span_s;
    }
    counted_ns_ = now_ns;
    rows_ = record.rows();
    frames_ = record.status().frames_accepted;
  }

  const Experiment& experiment_;
  std::int64_t drawn_ns_ = 0, counted_ns_ = 0, rows_ = 0;
  std::int32_t frames_ = 0;
  double status_hz_ = 0.0, frames_hz_ = 0.0;
  std::ptrdiff_t lines_ = 0;
};

int watch(const WatchOptions& options) {
  const Experiment experiment = load_experiment(options.config);
  catch_stop_signals();
  const LcmSettings& lcm = experiment.transport.lcm;
  LcmNode node(lcm.url);
  StatusRecord record(experiment, options.out);
  std::int64_t last_status_ns = monotonic_now_ns();
  for (const std::string& channel : {lcm.status_channel, lcm.plant_channel, lcm.timing_channel}) {
    node.subscribe(channel, 1024, [&, channel](const ReceivedMessage& packet) {
      if (record.take(channel, packet.bytes)) last_status_ns = monotonic_now_ns();
    });
  }

  Progress progress(true);
  LiveView view(experiment);
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
    if (options.duration_s > 0.0 && record.rows() > 0 &&
        static_cast<Mode>(record.status().mode) == Mode::fault) {
      print_error(
          "softarm",
          fmt::format("the arm is in FAULT ({}) after {:.1f} of {:.1f} s of ACTIVE: mend what is "
                      "wrong, `softarm disarm` and `softarm arm`, then watch again",
                      name(static_cast<Reason>(record.status().reason)), record.active_s(),
                      options.duration_s));
      record.close();
      return kExitFailure;
    }
    if (record.rows() > 0 && view.due()) view.draw(record);
    if (record.rows() > 0 && isatty(STDERR_FILENO) == 0 && progress.due())
      progress.update(progress_text(record, options.duration_s));
  }
  record.close();
  if (record.rows() == 0) {
    print_error("softarm", fmt::format("no status on {}", lcm.status_channel));
    return kExitFailure;
  }
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
