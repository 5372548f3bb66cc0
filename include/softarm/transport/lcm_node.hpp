// One LCM handle: subscribe, drain without waiting, publish from a buffer of our own.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "softarm/transport/arrival_clock.hpp"

struct _lcm_t;
struct _lcm_recv_buf_t;

namespace softarm {

/// LCM could not be started or used; the message tells the cure.
class TransportError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A received packet; valid only during the handler.
struct ReceivedMessage {
  std::span<const std::byte> bytes;
  std::int64_t arrival_ns;  ///< at this machine, CLOCK_MONOTONIC; does not decrease (ArrivalClock)
  std::int64_t stamp_us;    ///< the same as LCM stamped it: wall clock
};

/// Belongs to one thread. The C interface of LCM serves underneath, because the C++ one allocates
/// for every message.
class LcmNode {
 public:
  using Handler = std::function<void(const ReceivedMessage&)>;
  static constexpr int kLargestMessage =
      60'000;  ///< bytes: the largest UDP payload, less LCM's header

  /// @throws TransportError if LCM refuses the URL or no multicast route exists
  explicit LcmNode(const std::string& url);
  ~LcmNode();
  LcmNode(const LcmNode&) = delete;
  LcmNode& operator=(const LcmNode&) = delete;

  /// Handlers must not throw. A full queue drops the newest messages, so `capacity` must cover what
  /// can arrive between two drains. @throws TransportError
  void subscribe(const std::string& channel, int capacity, Handler handler);

  /// Handles what has arrived, at most `limit` messages, without waiting. Returns how many were
  /// handled.
  int drain(int limit) noexcept;

  /// Waits for a message until `deadline_ns` of CLOCK_MONOTONIC and handles it. Returns whether
  /// there was one; false also when a signal cut the wait short.
  bool wait_until(std::int64_t deadline_ns) noexcept;

  /// Encodes into this node's buffer and publishes; false if it did not fit or was refused.
  /// Allocates nothing.
  template <class Message>
  bool publish(const std::string& channel, const Message& message) noexcept {
    const int size = message.encode(buffer_.data(), 0, static_cast<int>(buffer_.size()));
    return size >= 0 && send(channel.c_str(), size);
  }

  /// Publishes what is encoded already; false if it is nothing, or was refused. Allocates nothing.
  bool publish_encoded(const std::string& channel, std::span<const std::byte> bytes) noexcept;

 private:
  bool send(const char* channel, int size) noexcept;

  struct Subscription {
    Handler handler;
    ArrivalClock* arrivals;
  };
  void look_at_clocks() noexcept;
  static void dispatch(const _lcm_recv_buf_t* packet, const char* channel, void* user) noexcept;

  _lcm_t* lcm_ = nullptr;
  ArrivalClock arrivals_;
  std::deque<Subscription> subscriptions_;  // stable addresses: LCM keeps a pointer to each
  std::vector<std::byte> buffer_;
};

/// What instances on an LCM channel lock: neither the options behind the '?' of a URL nor another
/// spelling of group and port make another network.
std::string lock_name(const std::string& channel, const std::string& url);

}  // namespace softarm
