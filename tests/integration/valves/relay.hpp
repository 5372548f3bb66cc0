// A relay between a Modbus client and its server that does to their traffic what networks and
// faulty terminals do. It knows the protocol by its own reading, not through libmodbus.
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <stdexcept>
#include <thread>
#include <vector>

namespace softarm::test {

/// Faults are switched on and off while it runs.
class Relay {
 public:
  explicit Relay(int server_port) : server_port_(server_port) {
    listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address = loopback(0);
    socklen_t size = sizeof address;
    if (bind(listener_, reinterpret_cast<sockaddr*>(&address), size) != 0 ||
        listen(listener_, 4) != 0 ||
        getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) != 0)
      throw std::runtime_error("the relay cannot listen");
    port_ = ntohs(address.sin_port);
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  }
  ~Relay() {
    thread_.request_stop();
    thread_.join();
    close(listener_);
  }
  Relay(const Relay&) = delete;
  Relay& operator=(const Relay&) = delete;

  int port() const { return port_; }

  std::atomic<int> server_port_;            ///< may change while there is no connection
  std::atomic<int> delay_us{0};             ///< of every answer
  std::atomic<bool> exceptions{false};      ///< every answer becomes "server device failure"
  std::atomic<bool> cut_next_write{false};  ///< half a write goes through, then both sides are cut
  std::atomic<bool> refuse{false};          ///< connections are refused
  std::atomic<int> stuck_word{-1};          ///< of every longer answer, which then reads `stuck_at`
  std::atomic<int> stuck_at{0};
  std::atomic<int> connections{0};
  std::atomic<int> negative_set_points{0};  ///< set points seen with the sign bit set

 private:
  using Bytes = std::vector<std::uint8_t>;
  static constexpr std::size_t kHeader = 7;

  static sockaddr_in loopback(int port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    return address;
  }
  static bool readable(int socket, int wait_ms) {
    pollfd descriptor{.fd = socket, .events = POLLIN, .revents = 0};
    return poll(&descriptor, 1, wait_ms) > 0;
  }
  static bool get(int socket, std::uint8_t* to, std::size_t size) {
    return recv(socket, to, size, MSG_WAITALL) == static_cast<ssize_t>(size);
  }
  static bool put(int socket, const Bytes& bytes, std::size_t size) {
    return send(socket, bytes.data(), size, MSG_NOSIGNAL) == static_cast<ssize_t>(size);
  }
  /// One whole message; empty: the connection ended.
  static Bytes message(int socket) {
    Bytes bytes(kHeader);
    if (!get(socket, bytes.data(), kHeader)) return {};
    const std::size_t rest = (bytes[4] << 8 | bytes[5]) - 1U;
    bytes.resize(kHeader + rest);
    if (rest > 253 || !get(socket, bytes.data() + kHeader, rest)) return {};
    return bytes;
  }

  void run(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      if (!readable(listener_, 5)) continue;
      const int client = accept(listener_, nullptr, nullptr);
      const int server = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
      const sockaddr_in address = loopback(server_port_);
      if (!refuse &&
          connect(server, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) {
        ++connections;
        while (!stop.stop_requested() && !refuse && pass(client, server)) {
        }
      }
      close(client);
      close(server);
    }
  }

  /// One question and its answer, if there is one; false: the end.
  bool pass(int client, int server) {
    if (!readable(client, 5)) return true;
    Bytes question = message(client);
    if (question.empty()) return false;
    const bool writes = question[kHeader] == 16;
    if (writes && cut_next_write.exchange(false)) {
      put(server, question, question.size() / 2);
      return false;
    }
    for (std::size_t k = kHeader + 6; writes && k + 1 < question.size(); k += 2)
      if ((question[k] & 0x80) != 0) ++negative_set_points;
    if (!put(server, question, question.size())) return false;
    Bytes answer = message(server);
    if (answer.empty()) return false;
    if (const int us = delay_us; us > 0) std::this_thread::sleep_for(std::chrono::microseconds(us));
    if (exceptions) {
      answer.resize(kHeader + 2);
      answer[4] = 0;
      answer[5] = 3;
      answer[kHeader] = static_cast<std::uint8_t>(question[kHeader] | 0x80);
      answer[kHeader + 1] = 4;
    } else if (const int word = stuck_word; word >= 0 && answer[kHeader] == 3) {
      const std::size_t at = kHeader + 2 + 2 * static_cast<std::size_t>(word);
      if (at + 1 < answer.size() && answer.size() > kHeader + 6) {
        answer[at] = static_cast<std::uint8_t>(stuck_at >> 8);
        answer[at + 1] = static_cast<std::uint8_t>(stuck_at);
      }
    }
    return put(client, answer, answer.size());
  }

  int listener_ = -1;
  int port_ = 0;
  std::jthread thread_;
};

}  // namespace softarm::test
