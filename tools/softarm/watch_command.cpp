// softarm watch: looks at a running arm over LCM, and records it in the same files as `softarm
// run`.
#include <fmt/format.h>

#include <deque>
#include <memory>
#include <optional>

#include "experiment_log.hpp"
#include "program.hpp"
#include "progress.hpp"
#include "signals.hpp"
#include "softarm/commands.hpp"
#include "softarm/config/load.hpp"
#include "softarm/daemon/realtime.hpp"
#include "softarm/model/kinematics.hpp"
#include "softarm/transport/lcm_node.hpp"
#include "softarm/transport/message_decoding.hpp"
#include "tracking_summary.hpp"

namespace softarm {
namespace {

constexpr std::int64_t kSilence_ns = 10'000'000'000;  ///< without any status: nobody is there
constexpr std::int64_t kTruthPatience_us =
    100'000;                                ///< how long a row waits for the plant's word on it
constexpr std::size_t kWaitingRows = 4096;  ///< more than the patience lasts at any rate

struct WatchOptions {
  std::string config;
  std::string out;
  double duration_s = 0.0;
};

using softarm_messages::controller_status_t;
using softarm_messages::plant_state_t;
using softarm_messages::timing_t;

SegmentVector flatten(const std::vector<std::vector<float>>& pairs) {
  SegmentVector flat(static_cast<Eigen::Index>(2 * pairs.size()));
  for (std::size_t i = 0; i < pairs.size(); ++i)
    for (std::size_t axis = 0; axis < 2; ++axis)
      flat[static_cast<Eigen::Index>(2 * i + axis)] = pairs[i][axis];
  return flat;
}

template <class Vector>
Vector to_vector(const std::vector<float>& values) {
  return Eigen::Map<const Eigen::VectorXf>(values.data(), static_cast<Eigen::Index>(values.size()))
      .cast<double>();
}

/// The plant's state between two of its reports.
class TruthTrack {
 public:
  void add(const plant_state_t& state) {
    before_ = std::move(after_);
    after_ = state;
  }
  bool reaches(std::int64_t time_us) const { return after_ && after_->time_us >= time_us; }

  void fill(std::int64_t time_us, LogRow& row) const {
    if (!before_ || !after_ || time_us < before_->time_us || time_us > after_->time_us) return;
    const auto span =
        static_cast<double>(std::max<std::int64_t>(1, after_->time_us - before_->time_us));
    const double s = static_cast<double>(time_us - before_->time_us) / span;
    // Cubic through both ends with the velocities told there: exact to h^4/384 of the fourth
    // derivative.
    const double h = 1e-6 * span;
    const double weights[] = {(1 + 2 * s) * (1 - s) * (1 - s), h * s * (1 - s) * (1 - s),
                              s * s * (3 - 2 * s), h * s * s * (s - 1)};
    const auto pair = [&](const std::vector<std::vector<double>>& from, std::size_t i,
                          std::size_t axis) { return from[i][axis]; };
    row.truth.resize(static_cast<Eigen::Index>(2 * after_->u_rad.size()));
    for (std::size_t i = 0; i < after_->u_rad.size(); ++i)
      for (std::size_t axis = 0; axis < 2; ++axis)
        row.truth[static_cast<Eigen::Index>(2 * i + axis)] =
            weights[0] * pair(before_->u_rad, i, axis) +
            weights[1] * pair(before_->velocity_radps, i, axis) +
            weights[2] * pair(after_->u_rad, i, axis) +
            weights[3] * pair(after_->velocity_radps, i, axis);
    row.real = to_vector<PressureVector>(after_->pressure_bar);
    Eigen::Vector3d tip;
    for (int axis = 0; axis < 3; ++axis)
      tip[axis] = (1 - s) * before_->tip_m[axis] + s * after_->tip_m[axis];
    row.tip = tip;
  }

 private:
  std::optional<plant_state_t> before_, after_;
};

class Watch {
 public:
  Watch(const Experiment& experiment, const WatchOptions& options)
      : experiment_(experiment),
        options_(options),
        node_(experiment.daemon.lcm.url),
        summary_(experiment.arm.size(), experiment.run.tracking_from_s) {
    if (!options.out.empty()) log_.emplace(options.out, experiment);
    const LcmSettings& lcm = experiment.daemon.lcm;
    node_.subscribe(lcm.status_channel, 1024, [this](const ReceivedMessage& p) { take_status(p); });
    node_.subscribe(lcm.plant_channel, 1024, [this](const ReceivedMessage& p) {
      // Of another arm on the channel nothing can be told.
      if (decode(p.bytes, plant_message_) && plant_message_.num_segments == experiment_.arm.size())
        truth_.add(plant_message_);
    });
    node_.subscribe(lcm.timing_channel, 8, [this](const ReceivedMessage& p) {
      timing_received_ |= decode(p.bytes, timing_);
    });
  }

  int run() {
    Progress progress(true);
    last_status_ns_ = monotonic_now_ns();
    while (stop_requested == 0 && !done()) {
      node_.wait_until(monotonic_now_ns() + 100'000'000);
      write_rows(false);
      if (monotonic_now_ns() - last_status_ns_ > kSilence_ns) {
        print_error("softarm", fmt::format("no status on {} for {} s: is softarmd {} running?",
                                           experiment_.daemon.lcm.status_channel,
                                           kSilence_ns / 1'000'000'000, options_.config));
        return kExitFailure;
      }
      if (rows_seen_ > 0 && progress.due()) progress.update(progress_text());
    }
    write_rows(true);
    return kExitOk;
  }

  void finish() {
    if (log_) {
      log_->close();
      const std::filesystem::path out(options_.out);
      write_text(out / "summary.json", summary_.json());
      write_text(out / "timing.json", timing_text());
    }
    fmt::print("{}", summary_.table());
    if (timing_received_) fmt::print("{}", timing_table());
  }

 private:
  struct WaitingRow {
    std::int64_t time_us;
    LogRow row;
  };

  bool done() const { return options_.duration_s > 0.0 && active_s_ >= options_.duration_s; }

  void take_status(const ReceivedMessage& packet) {
    if (!decode(packet.bytes, status_) || status_.num_segments != experiment_.arm.size()) return;
    last_status_ns_ = monotonic_now_ns();
    // The reference in a status belongs to the middle of the period that begins with its tick.
    const double period_s = 1.0 / experiment_.daemon.rate_hz;
    const std::int64_t time_us = status_.time_us + static_cast<std::int64_t>(0.5e6 * period_s);
    if (rows_seen_++ == 0) start_us_ = time_us;
    if (waiting_.size() >= kWaitingRows) return;
    LogRow row;
    row.t_s = 1e-6 * static_cast<double>(time_us - start_us_);
    row.mode = static_cast<Mode>(std::clamp<int>(status_.mode, 0, static_cast<int>(Mode::fault)));
    row.reason = static_cast<Reason>(std::clamp<int>(status_.reason, 0, kReasons - 1));
    row.saturated = (status_.flags & 1) != 0;
    row.frame_age_s = status_.frame_age_s;
    row.u = flatten(status_.u_rad);
    row.velocity = flatten(status_.velocity_radps);
    row.residual_twist = to_vector<SegmentVector>(status_.residual_twist_rad);
    row.residual_length = to_vector<SegmentVector>(status_.residual_length_m);
    row.commanded = to_vector<PressureVector>(status_.pressure_bar);
    if (row.mode == Mode::active) {
      row.reference = flatten(status_.reference_u_rad);
      row.tau_actuation = flatten(status_.tau_actuation_nm);
      row.tip_reference = tip_position(experiment_.arm, row.reference);
      active_s_ += period_s;
    }
    waiting_.push_back({time_us, std::move(row)});
  }

  void write_rows(bool all) {
    const std::int64_t newest_us = waiting_.empty() ? 0 : waiting_.back().time_us;
    while (!waiting_.empty()) {
      WaitingRow& next = waiting_.front();
      if (!all && !truth_.reaches(next.time_us) && newest_us - next.time_us < kTruthPatience_us)
        return;
      truth_.fill(next.time_us, next.row);
      if (log_) log_->add(next.row);
      summary_.add(next.row, 1.0 / experiment_.daemon.rate_hz);
      waiting_.pop_front();
    }
  }

  std::string progress_text() const {
    std::string text =
        fmt::format("{:6.1f} s {:<11} frame age {:4.1f} ms ",
                    1e-6 * static_cast<double>(std::max(status_.time_us, start_us_) - start_us_),
                    name(static_cast<Mode>(status_.mode)), 1e3 * status_.frame_age_s);
    if (static_cast<Mode>(status_.mode) != Mode::active)
      text += fmt::format(" ({})", name(static_cast<Reason>(status_.reason)));
    if (options_.duration_s > 0.0)
      text += fmt::format(" {:3.0f} %", 100.0 * active_s_ / options_.duration_s);
    const int shown = std::min<int>(status_.num_segments, 4);
    for (std::size_t i = 0; i < static_cast<std::size_t>(shown); ++i)
      text += fmt::format("  theta{} {:.3f} rad", i + 1, status_.theta_rad[i]);
    return text;
  }

  std::string timing_text() const {
    const auto named = [this](const char* name, const std::int32_t(&counts)[32], int k) {
      TimingReport::Named result{name, {}, timing_.max_us[k]};
      std::copy(std::begin(counts), std::end(counts), result.counts.begin());
      return result;
    };
    TimingReport report{.real_time_factor = 1.0, .histograms = {}};
    if (timing_received_)
      report.histograms = {named("lateness_us", timing_.lateness_count, 0),
                           named("frame_age_us", timing_.frame_age_count, 1),
                           named("tick_us", timing_.tick_count, 2),
                           named("publish_us", timing_.publish_count, 3)};
    return timing_json(report);
  }

  std::string timing_table() const {
    DurationCounts tick, lateness;
    std::copy(std::begin(timing_.tick_count), std::end(timing_.tick_count), tick.begin());
    std::copy(std::begin(timing_.lateness_count), std::end(timing_.lateness_count),
              lateness.begin());
    return fmt::format(
        "tick p50 < {:.1f} us, p99 < {:.1f} us, max {:.0f} us; woken late p50 < {:.0f} us, p99 < "
        "{:.0f} us, max {:.0f} us; "
        "{} of {} deadlines missed\n",
        quantile_us(tick, 0.5), quantile_us(tick, 0.99), timing_.max_us[2],
        quantile_us(lateness, 0.5), quantile_us(lateness, 0.99), timing_.max_us[0],
        timing_.overruns, timing_.ticks + timing_.overruns);
  }

  const Experiment& experiment_;
  const WatchOptions& options_;
  LcmNode node_;
  TrackingSummary summary_;
  std::optional<ExperimentLog> log_;
  TruthTrack truth_;
  std::deque<WaitingRow> waiting_;
  controller_status_t status_{};
  plant_state_t plant_message_{};
  timing_t timing_{};
  bool timing_received_ = false;
  std::int64_t last_status_ns_ = 0;
  std::int64_t start_us_ = 0;
  std::int64_t rows_seen_ = 0;
  double active_s_ = 0.0;
};

int watch(const WatchOptions& options) {
  const Experiment experiment = load_experiment(options.config);
  catch_stop_signals();
  Watch watch(experiment, options);
  const int code = watch.run();
  watch.finish();
  return code;
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
