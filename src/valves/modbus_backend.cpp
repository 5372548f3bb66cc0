#include "softarm/valves/modbus_backend.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <span>

#include "softarm/valves/register_map.hpp"

namespace softarm {

ModbusBackend::ModbusBackend(const ValveDriverSettings& settings, double max_pressure_bar)
    : settings_(settings),
      max_pressure_bar_(max_pressure_bar),
      terminal_(settings),
      out_(static_cast<std::size_t>(write_size(settings.registers, settings.order))),
      in_(static_cast<std::size_t>(read_size(settings.registers, settings.order))) {
  put_timeout(settings.registers, settings.failsafe_timeout_s, timeout_);
}

bool ModbusBackend::connect() noexcept {
  refusal_[0] = '\0';
  return terminal_.connect();
}

ValveBackend::Secured ModbusBackend::secure() noexcept {
  const RegisterMap& map = settings_.registers;
  const auto words = std::span(timeout_).first(static_cast<std::size_t>(map.timeout_words));
  refusal_[0] = '\0';
  const LinkResult result = terminal_.write(map.timeout_address, words);
  if (result == LinkResult::ok) return check();
  if (result == LinkResult::exception_reply) refuse(terminal_.error());
  return {result, false};
}

ValveBackend::Secured ModbusBackend::check() noexcept {
  const RegisterMap& map = settings_.registers;
  std::array<std::uint16_t, 2> found{};
  const auto count = static_cast<std::size_t>(map.timeout_words);
  refusal_[0] = '\0';
  const LinkResult result = terminal_.read(map.timeout_address, std::span(found).first(count));
  const bool confirmed = result == LinkResult::ok &&
                         std::equal(found.begin(), found.begin() + count, timeout_.begin());
  if (result == LinkResult::exception_reply) refuse(terminal_.error());
  if (result == LinkResult::ok && !confirmed) {
    std::array<char, 40> text{};
    fmt::format_to_n(text.data(), text.size() - 1, "read back {} s", timeout_s_of(map, found));
    refuse(text.data());
  }
  return {result, confirmed};
}

void ModbusBackend::refuse(const char* what) noexcept {
  const auto end = fmt::format_to_n(
      refusal_.data(), refusal_.size() - 1,
      "set {} s at register {}, {}; set valves.failsafe_timeout_s to what the terminal takes, or "
      "valves.registers.timeout_address",
      settings_.failsafe_timeout_s, settings_.registers.timeout_address, what);
  *end.out = '\0';
}

LinkResult ModbusBackend::write(const Eigen::VectorXd& set_points_bar) noexcept {
  put_set_points(settings_.registers, settings_.order, set_points_bar, max_pressure_bar_, out_);
  return terminal_.write(settings_.registers.write_address, out_);
}

LinkResult ModbusBackend::read(ReadBack& read_back) noexcept {
  const LinkResult result = terminal_.read(settings_.registers.read_address, in_);
  if (result == LinkResult::ok)
    take_read_back(settings_.registers, settings_.order, in_, read_back);
  return result;
}

const char* ModbusBackend::error() const noexcept {
  return refusal_[0] != '\0' ? refusal_.data() : terminal_.error();
}

std::string ModbusBackend::address() const {
  return fmt::format("{}:{} unit {}", settings_.host, settings_.port, settings_.unit_id);
}

std::string ModbusBackend::warning() const {
  if (settings_.host == "127.0.0.1") return "";
  return fmt::format(
      "the registers of {} were not tried on hardware; see docs/how-to/connect_valves.md",
      kTerminalNames[static_cast<std::size_t>(settings_.terminal)]);
}

}  // namespace softarm
