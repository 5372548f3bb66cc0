// One LCM handle: subscribe, drain without waiting, publish from a preallocated buffer.
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

/// LCM could not be started or used; the message gives the fix.
class TransportError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A received packet; valid only during the call of the handler.
struct ReceivedMessage {
  std::span<const std::byte> bytes;
  std::int64_t arrival_ns;  ///< CLOCK_MONOTONIC of this machine; does not decrease (ArrivalClock)
  std::int64_t stamp_us;    ///< the arrival as LCM stamped it, on the wall clock
};

/// An LCM handle for one thread. It uses the C interface of LCM, because the C++ interface
/// allocates for every message.
class LcmNode {
 public:
  /// Called with every message of a channel; must not throw.
  using Handler = std::function<void(const ReceivedMessage&)>;
  /// Bytes: the largest UDP payload less LCM's header.
  static constexpr int kLargestMessage = 60'000;

  /// @throws TransportError if LCM refuses the URL or no multicast route exists
  explicit LcmNode(const std::string& url);
  ~LcmNode();
  LcmNode(const LcmNode&) = delete;
  LcmNode& operator=(const LcmNode&) = delete;

  /// Subscribes to one channel by its literal name. A full queue drops the newest messages, so
  /// `capacity` must cover what can arrive between two drains. @throws TransportError
  void subscribe(const std::string& channel, int capacity, Handler handler);

  /// Handles the messages that have arrived, at most `limit`, without waiting. Returns how many.
  int drain(int limit) noexcept;

  /// Packets that the receiving socket has dropped so far, of all channels of the network; 0 where it
  /// cannot be read.
  std::int64_t dropped() const noexcept;

  /// Waits for a message until `deadline_ns` of CLOCK_MONOTONIC and handles it. Returns whether
  /// there was one; also false if a signal interrupted the wait.
  bool wait_until(std::int64_t deadline_ns) noexcept;

  /// Encodes into the buffer of this node and publishes; false if the message did not fit or LCM
  /// refused it. Allocates nothing.
  template <class Message>
  bool publish(const std::string& channel, const Message& message) noexcept {
    const int size = message.encode(buffer_.data(), 0, static_cast<int>(buffer_.size()));
    return size >= 0 && send(channel.c_str(), size);
  }

  /// Publishes an encoded message; false if it is empty or LCM refused it. Allocates nothing.
  bool publish_encoded(const std::string& channel, std::span<const std::byte> bytes) noexcept;

 private:
  bool send(const char* channel, int size) noexcept;

  struct Subscription {
    Handler handler;
    ArrivalClock* arrivals;
  };
  static void dispatch(const _lcm_recv_buf_t* packet, const char* channel, void* user) noexcept;

  _lcm_t* lcm_ = nullptr;
  int socket_ = -1;  ///< LCM's, that receives
  ArrivalClock arrivals_;
  std::deque<Subscription> subscriptions_;  // stable addresses: LCM keeps a pointer to each
  std::vector<std::byte> buffer_;
};

/// The InstanceLock name of a channel. Neither the options after the '?' of a URL nor another
/// spelling of group and port make it a different network.
std::string lock_name(const std::string& channel, const std::string& url);

/// Whether LCM_DEFAULT_URL names another network than `url`, for a person; empty: it does not.
/// softarm does not follow the variable, lcm-logger and lcm-spy do.
std::string network_warning(const std::string& url);
/// Whether messages sent to `url` stay on this machine, where all read the same monotonic clock:
/// UDP multicast whose ttl is 0, LCM's default.
bool is_local(const std::string& url);

}  // namespace softarm
