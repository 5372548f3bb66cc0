// A Modbus TCP server on the loopback interface, polled: no thread, no lock.
#pragma once

#include <cstdint>
#include <vector>

#include "softarm/valves/register_bank.hpp"

struct _modbus;

namespace softarm {

/// Serves functions 3 (read holding registers), 6 and 16 (write one, several) of a RegisterBank;
/// anything else gets an exception reply. At most `kMaxClients` clients at a time, further ones are
/// refused. A client that sends an incomplete or invalid request is disconnected. Belongs to one
/// thread.
class ModbusServer {
 public:
  static constexpr int kMaxClients = 4;

  /// Listens on 127.0.0.1. @param port 0: any free port @throws std::runtime_error if it cannot
  explicit ModbusServer(int port);
  ~ModbusServer();
  ModbusServer(const ModbusServer&) = delete;
  ModbusServer& operator=(const ModbusServer&) = delete;

  /// The port it listens on.
  int port() const noexcept { return port_; }

  /// Waits for a client until `deadline_ns` of CLOCK_MONOTONIC. Returns true if a client is waiting
  /// to be served, false at the deadline or when a signal interrupted the wait.
  bool wait_until(std::int64_t deadline_ns) noexcept;

  /// Answers pending requests, one per client.
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
