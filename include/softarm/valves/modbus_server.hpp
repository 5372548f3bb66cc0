// A Modbus TCP server on the loopback interface, polled: no thread, no lock.
#pragma once

#include <cstdint>
#include <vector>

#include "softarm/valves/register_bank.hpp"

struct _modbus;

namespace softarm {

/// Serves functions 3 (read holding registers), 6 and 16 (write one, several) of a RegisterBank;
/// anything else gets an exception reply. At most `kMaxClients` at a time, more are turned away. A
/// client that sends half a request, or nonsense, is dropped. Belongs to one thread.
class ModbusServer {
 public:
  static constexpr int kMaxClients = 4;

  /// Listens on 127.0.0.1. @param port 0: any that is free @throws std::runtime_error if it cannot
  explicit ModbusServer(int port);
  ~ModbusServer();
  ModbusServer(const ModbusServer&) = delete;
  ModbusServer& operator=(const ModbusServer&) = delete;

  int port() const noexcept { return port_; }

  /// Waits until a client wants something, or `deadline_ns` of CLOCK_MONOTONIC; says which. False
  /// also when a signal cut the wait short.
  bool wait_until(std::int64_t deadline_ns) noexcept;

  /// Answers what has arrived, one request a client.
  void serve(RegisterBank& bank) noexcept;

 private:
  void accept_client() noexcept;
  bool serve_client(int socket, RegisterBank& bank) noexcept;
  int poll_until(std::int64_t deadline_ns) noexcept;

  _modbus* context_;
  int listener_ = -1;
  int port_ = 0;
  std::vector<int> clients_;
  std::vector<int> readable_;
};

}  // namespace softarm
