// What a person at the emergency stop needs: the daemon's status, and requests to it. The names of
// the channels are enough for it, so that a mistake elsewhere in an experiment keeps nobody from
// venting the arm.
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

/// What is asked of a running daemon; the numbers are those of operator_command_t.
enum class OperatorRequest : std::int8_t {
  disarm = 0,         ///< vent and stay vented; acknowledges a FAULT
  arm = 1,            ///< the arm may be pressurised
  emergency_stop = 2  ///< vent and go to FAULT, until `disarm` and then `arm`
};

/// What came of it.
enum class RequestOutcome {
  done,     ///< the daemon's status shows it
  refused,  ///< the daemon was heard, but its status does not show it
  unheard   ///< no daemon was heard
};

/// A message as it came; valid only during the callback.
struct ArmMessage {
  const std::string& channel;
  std::span<const std::byte> bytes;
  std::int64_t arrival_ns;  ///< our monotonic clock
  std::int64_t wall_us;     ///< the same on the wall clock
};

/// Belongs to one thread. Messages are handled, and callbacks called, only in `update`, `wait_for`,
/// `wait_for_status` and `request`. A callback may throw; what it throws leaves that function. Each
/// kind of callback has one place: setting another one replaces it. Times are ns of CLOCK_MONOTONIC
/// unless a clock was given.
class OperatorClient {
 public:
  using Clock = std::function<std::int64_t()>;

  /// @param clock  what counts as now, in ns, not decreasing: for tests. What waits for a time of
  /// this clock (`update`, `vent_to_rest`) needs it to go on.
  /// @throws TransportError
  explicit OperatorClient(const LcmSettings& lcm, Clock clock = monotonic_now_ns)
      : OperatorClient(lcm, 0, std::move(clock)) {}
  virtual ~OperatorClient() = default;
  OperatorClient(const OperatorClient&) = delete;
  OperatorClient& operator=(const OperatorClient&) = delete;

  std::int64_t now_ns() const { return clock_(); }

  /// Waits for a message until `until_ns`, handles it and all others that are there, and returns:
  /// false where none came, or a signal cut the wait short. @throws what callbacks throw
  bool update(std::int64_t until_ns);
  /// Handles messages, one by one, until `reached()`, which is asked after each, or for
  /// `patience_s` of the real clock; returns whether it was reached.
  bool wait_for(const std::function<bool()>& reached, double patience_s);
  /// Handles messages until the next status; false if none comes within `patience_s`.
  bool wait_for_status(double patience_s);

  /// Newest status of the daemon that commands the arm; none before the first. Those of a shadow
  /// (softarmd --shadow) command nothing, and hide nothing: they only go to `on_status`.
  const std::optional<ArmStatus>& status() const { return status_; }
  /// Its arrival; kNever before the first.
  std::int64_t status_ns() const { return status_ns_; }
  /// Within the last second a daemon reported that it pressurises the arm, or may.
  bool daemon_armed() const;
  /// "ACTIVE (none)", or "not heard", of the newest status.
  std::string daemon_text() const;
  /// Called with every status, a shadow's too, before it becomes `status`.
  void on_status(std::function<void(const ArmStatus&)> callback) { on_status_ = callback; }
  /// Called with every message of the channels listened to, before what is made of it: the status,
  /// what else `listen` names, and what ArmClient listens to.
  void on_message(std::function<void(const ArmMessage&)> callback) { on_message_ = callback; }

  /// Messages of this channel, too, go to `on_message`. @throws TransportError
  void listen(const std::string& channel) { listen(channel, {}); }

  /// Asks once, does not wait. @throws TransportError if it could not be sent
  void send(OperatorRequest what);
  /// Asks 20 times a second until a status that came after the first request shows it, or for
  /// `patience_s`. Blocks. @throws TransportError if none could be sent
  RequestOutcome request(OperatorRequest what, double patience_s = 2.0);
  /// The dead-man input: "go" holds for safety.deadman_timeout_s from its arrival, and not any
  /// longer once it is taken back. @throws TransportError; std::logic_error where
  /// lcm.deadman_channel is empty
  void send_go(bool go);

  /// From now on every message of the channels that LcmSettings names (ArmClient: those of motion
  /// capture too) goes to an LCM event log, which EventLogReader, `softarm report`, `softarm
  /// replay` and lcm-logplayer read. What cannot be written (a full disk) throws std::runtime_error
  /// from the function that handles messages. @throws std::runtime_error, TransportError
  void record(const std::filesystem::path& log);
  /// Everything is in the file after this. @throws std::runtime_error
  void stop_recording();

 protected:
  using Handler = std::function<void(const ArmMessage&)>;
  /// @param segments  only statuses of so many are taken; 0: any
  OperatorClient(const LcmSettings& lcm, int segments, Clock clock);
  /// Begins to listen to a channel; a second handler of one is called after the first.
  void listen(const std::string& channel, Handler handler);
  /// After every round of handling, also one without messages.
  virtual void after_round() {}
  /// Encodes and sends. @throws TransportError
  template <class Message>
  void publish(const std::string& channel, const Message& message) {
    if (!node_.publish(channel, message)) throw_unsent();
  }
  /// Counts up from one call to the next, and from one program, machine or boot to the next.
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
  bool try_to_send(OperatorRequest what);
  [[noreturn]] static void throw_unsent();

  LcmSettings lcm_;
  int segments_;
  Clock clock_;
  LcmNode node_;
  std::int64_t newest_arrival_ns_ = kNever;
  std::deque<Channel> channels_;
  std::deque<Received> received_;  ///< by LCM's C code, through which nothing may be thrown
  std::optional<EventLogWriter> log_;
  std::function<void(const ArmMessage&)> on_message_;
  std::function<void(const ArmStatus&)> on_status_;
  std::optional<ArmStatus> status_;
  std::int64_t status_ns_ = kNever;
  std::int64_t statuses_ = 0;
  std::int64_t sequence_ = 0;
};

}  // namespace softarm
