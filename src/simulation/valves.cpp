#include "softarm/simulation/valves.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "softarm/model/memory.hpp"

namespace softarm {
namespace {

int checked_count(int chambers) {
  if (chambers < 0) {
    throw std::invalid_argument("valves: expected a count of chambers >= 0, got " +
                                std::to_string(chambers));
  }
  return chambers;
}

}  // namespace

Valves::Valves(const ValveSettings& settings, int chambers, bool both_signs)
    : lag_{.fill_s = settings.lag_s,
           .vent_s = settings.vent_lag_s == 0.0 ? settings.lag_s : settings.vent_lag_s},
      supply_bar_(settings.supply_pressure_bar),
      lowest_bar_(both_signs ? -settings.supply_pressure_bar : 0.0),
      slew_bar_per_s_(settings.slew_bar_per_s),
      resolution_bar_(settings.resolution_bar),
      play_bar_(settings.play_bar),
      dead_band_bar_(settings.dead_band_bar),
      sag_s_(settings.supply_sag_s),
      sagged_bar_(supply_bar_),
      pressure_bar_(Eigen::VectorXd::Zero(checked_count(chambers))),
      command_bar_(Eigen::VectorXd::Zero(chambers)) {
  const auto expect = [](double value, const char* key, const char* what) {
    if (!(value >= 0.0) || !std::isfinite(value)) {
      throw std::invalid_argument(std::string("valves.") + key + ": expected a finite " + what +
                                  " >= 0, got " + std::to_string(value));
    }
  };
  expect(lag_.fill_s, "lag_s", "time");
  expect(lag_.vent_s, "vent_lag_s", "time");
  expect(supply_bar_, "supply_pressure_bar", "pressure");
  expect(settings.dead_time_s, "dead_time_s", "time");
  expect(slew_bar_per_s_, "slew_bar_per_s", "rate");
  expect(resolution_bar_, "resolution_bar", "pressure");
  expect(play_bar_, "play_bar", "pressure");
  expect(dead_band_bar_, "dead_band_bar", "pressure");
  expect(sag_s_, "supply_sag_s", "time");
  if (sags() && (lag_.fill_s == 0.0 || both_signs))
    throw std::invalid_argument("valves.supply_sag_s: expected chambers with lag_s > 0");
}

double Valves::aim_bar(Eigen::Index i, double supply_bar) const noexcept {
  const double command = command_bar_[i];
  return sags() ? std::min(command, std::max(pressure_bar_[i], supply_bar)) : command;
}

double Valves::rise_bar_per_s(Eigen::Index i, double supply_bar) const noexcept {
  const double rate = (aim_bar(i, supply_bar) - pressure_bar_[i]) / lag_.fill_s;
  return std::max(0.0, slew_bar_per_s_ > 0.0 ? std::min(rate, slew_bar_per_s_) : rate);
}

/// The one S with S + sag sum p'(S) = supply: the left side rises with S. By bisection.
void Valves::meet_supply() noexcept {
  if (!sags()) return;
  const auto flow = [this] {
    double sum = 0.0;
    for (Eigen::Index i = 0; i < pressure_bar_.size(); ++i) sum += rise_bar_per_s(i, sagged_bar_);
    return sum;
  };
  sagged_bar_ = supply_bar_;
  if (flow() == 0.0) return;
  double below = 0.0, above = supply_bar_;
  for (int k = 0; k < 50; ++k) {
    sagged_bar_ = 0.5 * (below + above);
    (sagged_bar_ + sag_s_ * flow() > supply_bar_ ? above : below) = sagged_bar_;
  }
}

void Valves::command(std::span<const double> command_bar) noexcept {
  const std::size_t count = std::min(command_bar.size(), static_cast<std::size_t>(size()));
  for (std::size_t i = 0; i < count; ++i) {
    double wanted = std::isnan(command_bar[i]) ? 0.0 : command_bar[i];  // the safe side
    if (resolution_bar_ > 0.0 && std::isfinite(wanted)) {
      wanted = resolution_bar_ * std::round(wanted / resolution_bar_);
    }
    double& aim = command_bar_[static_cast<Eigen::Index>(i)];
    wanted = play(aim, std::clamp(wanted, lowest_bar_, supply_bar_), play_bar_);
    if (std::abs(wanted - aim) >= dead_band_bar_) aim = wanted;
  }
  if (lag_.fill_s == 0.0 && exponential()) pressure_bar_ = command_bar_;
  meet_supply();
}

void Valves::after(double ahead_s, Eigen::Ref<Eigen::VectorXd> out) const noexcept {
  for (Eigen::Index i = 0; i < pressure_bar_.size(); ++i) {
    const double aim = aim_bar(i, sagged_bar_);
    double gap = aim - pressure_bar_[i];
    double left_s = ahead_s;
    const double lag_s = lag_.time_s(aim, pressure_bar_[i]);
    if (slew_bar_per_s_ > 0.0) {
      const double steep = std::abs(gap) - slew_bar_per_s_ * lag_s;  // to go on a straight line
      if (steep > 0.0) {
        const double ramp_s = std::min(steep / slew_bar_per_s_, left_s);
        gap -= std::copysign(slew_bar_per_s_ * ramp_s, gap);
        left_s -= ramp_s;
      }
    }
    // A line that ends at the command itself (no lag) ends there exactly.
    out[i] = aim - (left_s > 0.0 ? (lag_s == 0.0 ? 0.0 : gap * std::exp(-left_s / lag_s)) : gap);
  }
}

void Valves::advance(double step_s) noexcept {
  if (!exponential()) {
    after(step_s, pressure_bar_);
    meet_supply();
    return;
  }
  if (lag_.fill_s == 0.0) {
    return;
  }
  // expm1 keeps the update exact for steps far below the lag.
  pressure_bar_ += -std::expm1(-step_s / lag_.fill_s) * (command_bar_ - pressure_bar_);
}

void Valves::reset(std::span<const double> pressure_bar) noexcept {
  const std::size_t count = std::min(pressure_bar.size(), static_cast<std::size_t>(size()));
  for (std::size_t i = 0; i < count; ++i) {
    command_bar_[static_cast<Eigen::Index>(i)] =
        std::isnan(pressure_bar[i]) ? 0.0 : std::clamp(pressure_bar[i], lowest_bar_, supply_bar_);
  }
  pressure_bar_ = command_bar_;
  meet_supply();
}

}  // namespace softarm
