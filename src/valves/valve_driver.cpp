#include "softarm/valves/valve_driver.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <utility>

namespace softarm {
namespace {

constexpr std::int64_t kMostStopping_ns = 700'000'000;

bool is_finite(const ReadBack& read_back, Eigen::Index chambers) noexcept {
  return read_back.actual_bar.size() == chambers && read_back.actual_bar.allFinite() &&
         (!read_back.has_echo ||
          (read_back.echo_bar.size() == chambers && read_back.echo_bar.allFinite())) &&
         read_back.diagnosis.size() == static_cast<std::size_t>(chambers);
}

}  // namespace

ValveDriver::ValveDriver(const ValveGuardSettings& settings, std::unique_ptr<ValveBackend> backend,
                         std::function<std::int64_t()> clock)
    : backend_(std::move(backend)),
      clock_(std::move(clock)),
      order_(settings.driver.order),
      address_(backend_->address()),
      vented_bar_(settings.driver.vented_bar),
      guard_(settings),
      read_back_(settings.chambers),
      newest_(settings.chambers),
      written_bar_(Eigen::VectorXd::Zero(settings.chambers)),
      zero_(written_bar_) {
  order_.resize(static_cast<std::size_t>(settings.chambers));
}

bool ValveDriver::cycle(std::int64_t now_ns) noexcept {
  bool measured = false;
  switch (guard_.next(now_ns)) {
    case ValveAction::wait:
      break;
    case ValveAction::connect: {
      const bool connected = backend_->connect();
      if (!connected) keep_error();
      guard_.connected(connected, clock_());
      break;
    }
    case ValveAction::secure: {
      const auto [result, confirmed] = backend_->secure();
      if (!confirmed) keep_error();
      guard_.secured(result, confirmed, now_ns);
      break;
    }
    case ValveAction::exchange:
      measured = exchange(now_ns);
      break;
  }
  if (guard_.state() == ValveState::disconnected && backend_->is_open()) give_up();
  return measured;
}

/// Reads before it writes: what the hardware holds decides whether it may have pressure.
bool ValveDriver::exchange(std::int64_t now_ns) noexcept {
  const bool measured = guard_.may_read() && read(now_ns);
  if (guard_.failsafe_due(now_ns)) {
    const auto [checked, as_set] = guard_.failsafe_lost() ? backend_->secure() : backend_->check();
    if (!as_set) keep_error();
    guard_.failsafe_checked(checked, as_set, now_ns);
  }
  // If the requests took long since the decision, the hardware may have vented by itself.
  wake(clock_());
  if (guard_.state() == ValveState::disconnected) return measured;
  if (!guard_.may_write() && !backend_->answers_writes()) return measured;
  written_bar_ = guard_.set_points_bar();
  sequence_ = guard_.sequence();
  const LinkResult result = backend_->write(written_bar_);
  if (result != LinkResult::ok) keep_error();
  guard_.written(result, now_ns);
  return measured;
}

bool ValveDriver::read(std::int64_t now_ns) noexcept {
  LinkResult result = backend_->read(newest_);
  if (result != LinkResult::ok) {
    keep_error();
  } else if (!is_finite(newest_, zero_.size())) {
    result = LinkResult::no_answer;
    std::strcpy(error_.data(), "pressures that are not numbers");
  }
  guard_.measured(result, newest_, now_ns);
  if (result == LinkResult::ok) std::swap(read_back_, newest_);
  return result == LinkResult::ok;
}

/// If the hardware still receives, it vents at once instead of after its time-out; if it takes no
/// zero, another request would only keep it alive.
void ValveDriver::give_up() noexcept {
  if (guard_.reason() == ValveReason::zero_unconfirmed) {
    Eigen::Index chamber = 0;
    const double bar = read_back_.actual_bar.maxCoeff(&chamber);
    const auto end =
        bar > vented_bar_
            ? fmt::format_to_n(error_.data(), error_.size() - 1,
                               FMT_STRING("chamber {} reads {:.3f} bar; nothing is sent, so that "
                                          "it vents by itself"),
                               chamber, bar)
            : fmt::format_to_n(error_.data(), error_.size() - 1,
                               FMT_STRING("not measured; nothing is sent, so that it vents by "
                                          "itself"));
    *end.out = '\0';
  } else if (guard_.reason() != ValveReason::no_connection) {
    backend_->write(zero_);
  }
  backend_->close();
}

void ValveDriver::keep_error() noexcept {
  *fmt::format_to_n(error_.data(), error_.size() - 1, FMT_STRING("{}"), backend_->error()).out =
      '\0';
}

void ValveDriver::stop(std::int64_t now_ns) noexcept {
  stopping_ = true;
  stop_ns_ = now_ns;
  cycles_at_stop_ = guard_.counters().cycles;
  guard_.stop();
}

bool ValveDriver::stopped(std::int64_t now_ns) const noexcept {
  if (!stopping_) return false;
  return (guard_.zero_confirmed() && guard_.counters().cycles > cycles_at_stop_) ||
         guard_.state() == ValveState::disconnected || now_ns - stop_ns_ >= kMostStopping_ns;
}

std::string_view ValveDriver::text(std::span<char> buffer) const noexcept {
  const auto put = [&](auto format, const auto&... arguments) {
    const auto end = fmt::format_to_n(buffer.data(), buffer.size(), format, arguments...);
    return std::string_view(buffer.data(), std::min(end.size, buffer.size()));
  };
  const ValveReason reason = guard_.reason();
  const char* state = name(guard_.state());
  const char* open = reason == ValveReason::none ? "" : " (";
  const char* close = reason == ValveReason::none ? "" : ")";
  if (reason == ValveReason::failsafe_refused)
    return put(FMT_STRING("{} ({}: {}); no pressure is written"), state, name(reason),
               error_.data());
  if (reason == ValveReason::failsafe_changed)
    return put(FMT_STRING("{} ({}: {})"), state, name(reason), error_.data());
  if (const int chamber = guard_.chamber(); chamber >= 0)
    return put(FMT_STRING("{}{}{}{}: chamber {} (valve {}) set to {:.3f} bar reads {:.3f} bar"),
               state, open, name(reason), close, chamber, order_[static_cast<std::size_t>(chamber)],
               written_bar_[chamber], read_back_.actual_bar[chamber]);
  if (guard_.state() == ValveState::disconnected)
    return put(FMT_STRING("{} ({}): {}: {}"), state, name(reason), address_, error_.data());
  return put(FMT_STRING("{}{}{}{}"), state, open, name(reason), close);
}

}  // namespace softarm
