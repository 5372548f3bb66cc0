#include "softarm/recording/status_record.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "softarm/base/time.hpp"
#include "softarm/model/coordinates.hpp"
#include "softarm/model/kinematics.hpp"
#include "softarm/transport/message_decoding.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {
namespace {

/// How long a row waits for the true state from the plant.
constexpr std::int64_t kTruthPatience_us = 100'000;

}  // namespace

void TruthTrack::add(const PlantState& state) {
  before_ = std::move(after_);
  after_ = state;
}

void TruthTrack::fill(std::int64_t time_us, LogRow& row) const {
  if (!before_ || !after_ || time_us < before_->time_us || time_us > after_->time_us) return;
  const auto span =
      static_cast<double>(std::max<std::int64_t>(1, after_->time_us - before_->time_us));
  const double s = static_cast<double>(time_us - before_->time_us) / span;
  // Cubic Hermite interpolation of the states and velocities at both ends: the error is at most
  // h^4/384 times the fourth derivative.
  const double h = 1e-6 * span;
  const auto between = [&](auto PlantState::*value, auto PlantState::*rate) {
    return ((1 + 2 * s) * (1 - s) * (1 - s) * *before_.*value +
            h * s * (1 - s) * (1 - s) * *before_.*rate + s * s * (3 - 2 * s) * *after_.*value +
            h * s * s * (s - 1) * *after_.*rate)
        .eval();
  };
  row.truth = between(&PlantState::u_rad, &PlantState::velocity_radps);
  if (before_->elongation_m.size() == after_->elongation_m.size())
    row.elongation_truth = between(&PlantState::elongation_m, &PlantState::elongation_rate_mps);
  row.real = after_->pressure_bar;
  row.tip = (1 - s) * before_->tip_m + s * after_->tip_m;
}

StatusRecord::StatusRecord(const Experiment& experiment, const std::filesystem::path& folder,
                           const Files& inputs)
    : experiment_(experiment), summary_(experiment.arm.size(), experiment.run.tracking_from_s) {
  summary_.set_arm(experiment.arm);
  if (experiment.actuation.kind == ActuationKind::torque) summary_.commands_are_torques();
  if (folder.empty()) return;
  log_.emplace(folder, experiment, inputs);
  files_.emplace(folder, experiment, inputs);
}

template <class Write>
void StatusRecord::try_to(const Write& write) {
  try {
    write();
  } catch (const OutputError& error) {
    if (failure_.empty()) failure_ = error.what();
  }
}

bool StatusRecord::take(std::string_view channel, std::span<const std::byte> bytes) {
  const LcmSettings& lcm = experiment_.transport.lcm;
  bool is_status = false;
  if (channel == lcm.status_channel) {
    is_status = take_status(bytes);
  } else if (channel == lcm.plant_channel) {
    if (PlantState state; decode(bytes, state) && state.segments() == experiment_.arm.size() &&
                          is_time_us(state.time_us))
      truth_.add(state);
  } else if (channel == lcm.timing_channel) {
    timing_received_ |= decode(bytes, timing_);
  } else if (channel == lcm.observer_channel) {
    take_observer(bytes);
  }
  write_rows(false);
  return is_status;
}

bool StatusRecord::take_status(std::span<const std::byte> bytes) {
  ArmStatus newest;
  if (!decode(bytes, newest) || newest.segments() != experiment_.arm.size() ||
      !is_time_us(newest.time_us))
    return false;
  // A shadow may be recorded alone, but not beside the daemon that moves the arm.
  if (newest.shadow && commander_heard_) return false;
  commander_heard_ = !newest.shadow;
  status_ = std::move(newest);
  // The reference in a status is that of the middle of the period that begins with its tick.
  const double period_s = 1.0 / experiment_.rate_hz;
  const std::int64_t time_us = status_.time_us + static_cast<std::int64_t>(0.5e6 * period_s);
  if (rows_++ == 0) start_us_ = time_us;
  LogRow row;
  row.t_s = 1e-6 * static_cast<double>(time_us - start_us_);
  row.mode = std::clamp(status_.mode, Mode::init, Mode::fault);
  row.reason = std::clamp(status_.reason, Reason::none, static_cast<Reason>(kReasons - 1));
  row.saturated = status_.saturated;
  row.frame_age_s = status_.frame_age_s;
  row.u = status_.u_rad;
  row.velocity = status_.velocity_radps;
  row.residual_torsion = status_.torsion_rad;
  row.residual_length = status_.length_error_m;
  row.commanded = status_.pressure_bar;
  row.elongation = status_.elongation_m;
  if (row.mode == Mode::active) {
    row.reference = status_.reference_u_rad;
    row.tau_actuation = status_.tau_actuation_nm;
    row.elongation_reference = status_.reference_elongation_m;
    row.axial_force = status_.axial_force_n;
    row.tip_reference = tip_position(
        experiment_.arm, coordinates(experiment_.arm, row.reference, row.elongation_reference));
    active_s_ += period_s;
  }
  waiting_.push_back({time_us, std::move(row)});
  return true;
}

/// It follows the status of the same tick.
void StatusRecord::take_observer(std::span<const std::byte> bytes) {
  if (!decode(bytes, observer_status_) ||
      observer_status_.report.segments != experiment_.arm.size() || waiting_.empty() ||
      observer_status_.time_us != status_.time_us)
    return;
  waiting_.back().row.observer = observer_status_.report;
}

void StatusRecord::write_rows(bool all) {
  const std::int64_t newest_us = waiting_.empty() ? 0 : waiting_.back().time_us;
  while (!waiting_.empty()) {
    WaitingRow& next = waiting_.front();
    // A clock that has gone back is that of another daemon: the true state will not come.
    const std::int64_t waited_us = newest_us - next.time_us;
    const bool patient = waited_us >= 0 && waited_us < kTruthPatience_us;
    if (!all && patient && !truth_.reaches(next.time_us)) return;
    truth_.fill(next.time_us, next.row);
    if (log_ && failure_.empty()) try_to([&] { log_->add(next.row); });
    summary_.add(next.row, 1.0 / experiment_.rate_hz);
    waiting_.pop_front();
  }
}

void StatusRecord::close() {
  write_rows(true);
  if (!log_) return;
  try_to([&] { log_->close(); });
  try_to([&] { files_->write(summary_.json(), timing_text()); });
}

std::string StatusRecord::table() const {
  return summary_.table() + (timing_received_ ? timing_table() : "");
}

double StatusRecord::time_s() const {
  return 1e-6 * static_cast<double>(std::max(status_.time_us, start_us_) - start_us_);
}

std::string StatusRecord::timing_text() const {
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

std::string StatusRecord::timing_table() const {
  DurationCounts tick, lateness;
  std::copy(std::begin(timing_.tick_count), std::end(timing_.tick_count), tick.begin());
  std::copy(std::begin(timing_.lateness_count), std::end(timing_.lateness_count), lateness.begin());
  return fmt::format(
      "tick p50 < {:.1f} us, p99 < {:.1f} us, max {:.0f} us; woken late p50 < {:.0f} us, p99 < "
      "{:.0f} us, max {:.0f} us; "
      "{} of {} deadlines missed\n",
      quantile_us(tick, 0.5), quantile_us(tick, 0.99), timing_.max_us[2],
      quantile_us(lateness, 0.5), quantile_us(lateness, 0.99), timing_.max_us[0], timing_.overruns,
      timing_.ticks + timing_.overruns);
}

}  // namespace softarm
