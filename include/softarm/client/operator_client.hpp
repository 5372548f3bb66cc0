// What a person at the emergency stop needs: the daemon's status, and requests to it. It needs only
// the names of the channels, so that an error elsewhere in an experiment file cannot prevent anyone
// from venting the arm.
#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "softarm/base/clock.hpp"
#include "softarm/base/time.hpp"
#include "softarm/transport/arm_messages.hpp"
#include "softarm/transport/event_log.hpp"
#include "softarm/transport/lcm_node.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {

/// A request to a running daemon; the numbers are those of operator_command_t.
enum class OperatorRequest : std::int8_t {
  disarm = 0,         ///< vent and stay vented; acknowledges a FAULT
  arm = 1,            ///< the arm may be pressurised
  emergency_stop = 2  ///< vent and go to FAULT, until `disarm` and then `arm`
};

/// The outcome of a request.
enum class RequestOutcome {
  done,     ///< the daemon's status shows it
  refused,  ///< a status was received, but it does not show it
  unheard   ///< no status was received
};

/// A message as it was received; valid only during the callback.
struct ArmMessage {
  const std::string& channel;
  std::span<const std::byte> bytes;
  std::int64_t arrival_ns;  ///< on the clock of the client
  std::int64_t wall_us;     ///< the arrival on the wall clock
};

/// Status of the daemon, and requests to it. Use from one thread. Messages are handled, and
/// callbacks called, only in `update`, `wait_for`, `wait_for_status` and `request`. A callback may
/// throw; its exception leaves that function. There is one callback of each kind: setting another
/// replaces it. Times are ns of CLOCK_MONOTONIC unless a clock was given.
class OperatorClient {
 public:
  /// Returns the current time in ns.
  using Clock = std::function<std::int64_t()>;

  /// @param lcm  network and channels of the arm
  /// @param clock  the current time in ns, not decreasing: for tests. Functions that wait for a
  /// time of this clock (`update`, `vent_to_rest`) need it to advance.
  /// @throws TransportError
  explicit OperatorClient(const LcmSettings& lcm, Clock clock = monotonic_now_ns)
      : OperatorClient(lcm, 0, std::move(clock)) {}
  virtual ~OperatorClient() = default;
  OperatorClient(const OperatorClient&) = delete;
  OperatorClient& operator=(const OperatorClient&) = delete;

  /// The current time of the client's clock, in ns.
  std::int64_t now_ns() const { return clock_(); }

  /// Waits for a message until `until_ns`, then handles it and all others that have arrived.
  /// Returns false if none came, or if a signal interrupted the wait. @throws what callbacks throw
  bool update(std::int64_t until_ns);
  /// Handles messages one by one until `reached()` is true, which is evaluated after each, or until
  /// `patience_s` of the real clock have passed. Returns whether it was reached.
  bool wait_for(const std::function<bool()>& reached, double patience_s);
  /// Handles messages until the next status; false if none comes within `patience_s`.
  bool wait_for_status(double patience_s);

  /// Newest status of the daemon that commands the arm; none before the first. Statuses of a shadow
  /// (softarmd --shadow), which commands nothing, only go to `on_status`.
  const std::optional<ArmStatus>& status() const { return status_; }
  /// Arrival of the newest status; kNever before the first.
  std::int64_t status_ns() const { return status_ns_; }
  /// Whether a daemon reported within the last second that it pressurises the arm, or may do so.
  bool daemon_armed() const;
  /// Mode and reason of the newest status, such as "ACTIVE (none)", or "not heard".
  std::string daemon_text() const;
  /// Sets the callback for every status, including those of a shadow; it is called before the
  /// status becomes `status()`.
  void on_status(std::function<void(const ArmStatus&)> callback) { on_status_ = callback; }
  /// Sets the callback for every message of the channels listened to (the status, those named to
  /// `listen`, and those of ArmClient); it is called before the message is decoded.
  void on_message(std::function<void(const ArmMessage&)> callback) { on_message_ = callback; }

  /// Also passes the messages of this channel to `on_message`. @throws TransportError
  void listen(const std::string& channel) { listen(channel, {}); }

  /// Sends one request and does not wait. An `arm`, and a `disarm` that shall acknowledge a FAULT,
  /// count only if a status was handled within the last second. @throws TransportError if it could
  /// not be sent
  void send(OperatorRequest what);
  /// Sends one request 20 times a second until a status received after the first shows the result,
  /// or until `patience_s` have passed. All carry the number of this call and, from the first status
  /// on, its nonce: the daemon refuses an `arm` a second later, and from a later disarm or emergency
  /// stop on. Blocks. @throws TransportError if none could be sent
  RequestOutcome request(OperatorRequest what, double patience_s = 2.0);
  /// Sends the dead-man input: "go" (true) holds for safety.deadman_timeout_s from its arrival, or
  /// until it is withdrawn (false). It counts only if a status was handled within the last second.
  /// @throws TransportError; std::logic_error where
  /// lcm.deadman_channel is empty
  void send_go(bool go);

  /// From now on writes every message of the channels that LcmSettings names (ArmClient: also those
  /// of motion capture) to an LCM event log, which EventLogReader, `softarm report`, `softarm
  /// replay` and lcm-logplayer read. A later write failure (a full disk) throws std::runtime_error
  /// from the function that handles messages. @throws std::runtime_error, TransportError
  void record(const std::filesystem::path& log);
  /// Ends the recording; the file is complete afterwards. @throws std::runtime_error
  void stop_recording();

 protected:
  using Handler = std::function<void(const ArmMessage&)>;
  /// @param segments  statuses with another number of segments are ignored; 0: any
  OperatorClient(const LcmSettings& lcm, int segments, Clock clock);
  /// Begins to listen to a channel; a second handler of the same channel is called after the first.
  void listen(const std::string& channel, Handler handler);
  /// Called after every round of handling, also after one without messages.
  virtual void after_round() {}
  /// Encodes and sends. @throws TransportError
  template <class Message>
  void publish(const std::string& channel, const Message& message) {
    if (!node_.publish(channel, message)) throw_unsent();
  }
  /// A sequence number that increases from call to call, and across programs, machines and boots.
  std::int64_t next_sequence();

 private:
  struct Received {
    std::size_t channel;
    std::vector<std::byte> bytes;
    std::int64_t arrival_ns;  ///< CLOCK_MONOTONIC
    std::int64_t wall_us;
  };
  struct Channel {
    std::string name;
    std::vector<Handler> handlers;
  };
  bool handle_until(std::int64_t monotonic_ns, int most);
  void handle_round();
  void take_status(const ArmMessage& message);
  bool try_to_send(OperatorRequest what, std::int64_t number, std::int64_t nonce);
  std::int64_t newest_nonce() const { return status_ ? status_->nonce : 0; }
  [[noreturn]] static void throw_unsent();

  LcmSettings lcm_;
  int segments_;
  Clock clock_;
  LcmNode node_;
  std::int64_t newest_arrival_ns_ = kNever;
  std::deque<Channel> channels_;
  std::deque<Received> received_;  ///< filled from LCM's C code, through which nothing may throw
  std::optional<EventLogWriter> log_;
  std::function<void(const ArmMessage&)> on_message_;
  std::function<void(const ArmStatus&)> on_status_;
  std::optional<ArmStatus> status_;
  std::int64_t status_ns_ = kNever;
  std::int64_t statuses_ = 0;
  std::int64_t sequence_ = 0;
};

}  // namespace softarm
