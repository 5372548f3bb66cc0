#include "softarm/valves/modbus_terminal.hpp"

#include <arpa/inet.h>
#include <modbus/modbus.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <new>
#include <stdexcept>

namespace softarm {

ModbusTerminal::ModbusTerminal(const ValveDriverSettings& settings)
    : context_(nullptr),
      response_timeout_s_(settings.response_timeout_s),
      connect_timeout_s_(settings.connect_timeout_s) {
  in_addr address{};
  if (inet_pton(AF_INET, settings.host.c_str(), &address) != 1)
    throw std::invalid_argument("valves.host: expected an IPv4 address, got \"" + settings.host +
                                "\"");
  context_ = modbus_new_tcp(settings.host.c_str(), settings.port);
  if (context_ == nullptr) throw std::bad_alloc();
  modbus_set_slave(context_, settings.unit_id);
  // No time-out between bytes: that of the response is then the limit for the whole answer.
  modbus_set_byte_timeout(context_, 0, 0);
}

ModbusTerminal::~ModbusTerminal() {
  close();
  modbus_free(context_);
}

void ModbusTerminal::set_response_timeout(double seconds) noexcept {
  const auto us = static_cast<std::uint32_t>(std::max(1.0, std::round(1e6 * seconds)));
  modbus_set_response_timeout(context_, us / 1'000'000, us % 1'000'000);
}

bool ModbusTerminal::connect() noexcept {
  close();
  set_response_timeout(connect_timeout_s_);
  open_ = modbus_connect(context_) == 0;
  // The errors that libmodbus sets when no answer came in time.
  if (!open_) error_ = errno == EINPROGRESS ? ETIMEDOUT : errno;
  set_response_timeout(response_timeout_s_);
  return open_;
}

void ModbusTerminal::close() noexcept {
  if (open_) modbus_close(context_);
  open_ = false;
}

LinkResult ModbusTerminal::failed() noexcept {
  error_ = errno;
  if (error_ > MODBUS_ENOBASE && error_ <= EMBXGTAR) return LinkResult::exception_reply;
  // The errors that libmodbus reports for a wrong answer, such as one to an earlier request.
  if (error_ == ETIMEDOUT || error_ > EMBXGTAR) return LinkResult::no_answer;
  return LinkResult::broken;
}

LinkResult ModbusTerminal::write(int address, std::span<const std::uint16_t> words) noexcept {
  if (!open_) return LinkResult::broken;
  while (!words.empty()) {
    const auto part = words.first(std::min<std::size_t>(words.size(), MODBUS_MAX_WRITE_REGISTERS));
    modbus_flush(context_);  // a late answer would be taken for that to this request
    const int count = static_cast<int>(part.size());
    if (modbus_write_registers(context_, address, count, part.data()) != count) return failed();
    words = words.subspan(part.size());
    address += count;
  }
  return LinkResult::ok;
}

LinkResult ModbusTerminal::read(int address, std::span<std::uint16_t> words) noexcept {
  if (!open_) return LinkResult::broken;
  while (!words.empty()) {
    const auto part = words.first(std::min<std::size_t>(words.size(), MODBUS_MAX_READ_REGISTERS));
    modbus_flush(context_);
    const int count = static_cast<int>(part.size());
    if (modbus_read_registers(context_, address, count, part.data()) != count) return failed();
    words = words.subspan(part.size());
    address += count;
  }
  return LinkResult::ok;
}

const char* ModbusTerminal::error() const noexcept { return modbus_strerror(error_); }

}  // namespace softarm
