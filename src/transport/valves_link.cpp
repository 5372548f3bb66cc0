#include "softarm/transport/valves_link.hpp"

#include <algorithm>
#include <limits>
#include <span>

#include "softarm/actuation/pressure_allocator.hpp"
#include "softarm/base/clock.hpp"
#include "softarm/transport/message_decoding.hpp"

namespace softarm {
namespace {

constexpr int kCommandCapacity = 64, kOperatorCapacity = 64;
constexpr std::int64_t kStatusPeriod_ns = 100'000'000;

void put(const Eigen::VectorXd& from_bar, std::vector<float>& to_bar) noexcept {
  std::transform(from_bar.begin(), from_bar.end(), to_bar.begin(),
                 [](double bar) { return static_cast<float>(bar); });
}

}  // namespace

ValvesLink::ValvesLink(const LcmSettings& lcm, ValveDriver& driver)
    : lcm_(lcm),
      driver_(driver),
      node_(lcm.url),
      pressure_bar_(static_cast<std::size_t>(driver.written_bar().size())),
      local_(is_local(lcm.url)) {
  command_.pressure_bar.reserve(kMaxChambers);
  measurement_.num_chambers = static_cast<std::int16_t>(pressure_bar_.size());
  measurement_.pressure_bar.assign(pressure_bar_.size(), 0.0F);
  measurement_.validity_us = static_cast<std::int32_t>(std::min<std::int64_t>(
      driver.guard().commands().longest_ns() / 1000, std::numeric_limits<std::int32_t>::max()));
  status_.num_chambers = measurement_.num_chambers;
  status_.set_point_bar = measurement_.pressure_bar;
  status_.actual_bar = measurement_.pressure_bar;
  node_.subscribe(lcm_.command_channel, kCommandCapacity,
                  [this](const ReceivedMessage& packet) { take(packet); });
  node_.subscribe(lcm_.operator_channel, kOperatorCapacity,
                  [this](const ReceivedMessage& packet) { take_request(packet); });
}

void ValvesLink::take(const ReceivedMessage& packet) noexcept {
  if (discarding_) return;
  const std::int64_t now_ns = monotonic_now_ns();
  if (!decode(packet.bytes, command_) ||
      (local_ && is_untimely(command_.time_us, command_.validity_us, now_ns / 1000))) {
    ++refused_;
    return;
  }
  const auto& pressures = command_.pressure_bar;
  const std::size_t count = std::min(pressures.size(), pressure_bar_.size());
  std::copy_n(pressures.begin(), count, pressure_bar_.begin());
  // A command for more chambers than ours must be refused, not cut to fit.
  const bool fits = pressures.size() == pressure_bar_.size();
  const CommandVerdict verdict = driver_.command(
      {.sequence = command_.sequence,
       .validity_ns = std::int64_t{command_.validity_us} * 1000,
       .sent_us = command_.time_us,
       .shadow = command_.shadow != 0,
       .pressure_bar = std::span<const double>(pressure_bar_).first(fits ? count : 0)},
      now_ns);
  refused_ += verdict == CommandVerdict::malformed;
}

/// A stop counts however old it is; what was queued before a gap acknowledges nothing.
void ValvesLink::take_request(const ReceivedMessage& packet) noexcept {
  using Request = softarm_messages::operator_command_t;
  if (!decode(packet.bytes, request_)) {
    ++refused_;
  } else if (request_.request == Request::EMERGENCY_STOP) {
    driver_.emergency_stop();
  } else if (request_.request == Request::DISARM && !discarding_) {
    driver_.acknowledge();
  }
}

void ValvesLink::take_until(std::int64_t deadline_ns) noexcept {
  while (monotonic_now_ns() < deadline_ns) node_.wait_until(deadline_ns);
}

void ValvesLink::drain(bool take) noexcept {
  discarding_ = !take;
  // The capacity of the queues: a flood of messages must not delay the loop.
  node_.drain(kCommandCapacity + kOperatorCapacity);
  discarding_ = false;
}

void ValvesLink::publish_measurement(std::int64_t now_ns) noexcept {
  put(driver_.read_back().actual_bar, measurement_.pressure_bar);
  const ValveGuard& guard = driver_.guard();
  measurement_.sequence = driver_.written_sequence();
  measurement_.expired = static_cast<std::int32_t>(guard.counters().times_vented);
  measurement_.reason = static_cast<std::int8_t>(guard.reason());
  measurement_.time_us = now_ns / 1000;
  node_.publish(lcm_.measurement_channel, measurement_);
}

bool ValvesLink::publish_status(std::int64_t now_ns, std::int64_t late_cycles) noexcept {
  const ValveGuard& guard = driver_.guard();
  const bool changed = status_.state != static_cast<std::int8_t>(guard.state()) ||
                       status_.reason != static_cast<std::int8_t>(guard.reason()) ||
                       status_.chamber != guard.chamber();
  if (!changed && now_ns < next_status_ns_) return false;
  next_status_ns_ = now_ns + kStatusPeriod_ns;
  const ValveCounters& counters = guard.counters();
  status_.time_us = now_ns / 1000;
  status_.sequence = guard.sequence();
  status_.cycles = counters.cycles;
  status_.state = static_cast<std::int8_t>(guard.state());
  status_.reason = static_cast<std::int8_t>(guard.reason());
  status_.chamber = static_cast<std::int16_t>(guard.chamber());
  status_.connections = static_cast<std::int32_t>(counters.connections);
  status_.exceptions = static_cast<std::int32_t>(counters.exceptions);
  status_.no_answers = static_cast<std::int32_t>(counters.no_answers);
  status_.broken = static_cast<std::int32_t>(counters.broken);
  status_.doubts = static_cast<std::int32_t>(counters.times_degraded);
  status_.late_cycles = static_cast<std::int32_t>(late_cycles);
  status_.commands_refused = static_cast<std::int32_t>(refused_);
  put(driver_.written_bar(), status_.set_point_bar);
  put(driver_.read_back().actual_bar, status_.actual_bar);
  node_.publish(lcm_.valves_channel, status_);
  return changed;
}

}  // namespace softarm
