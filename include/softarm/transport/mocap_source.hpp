// Where motion capture comes in, from every kind of source: packets -> frames. And frames ->
// packets, for a simulated arm.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "softarm/estimation/clock_relation.hpp"
#include "softarm/runtime/settings.hpp"
#include "softarm/transport/frame_assembler.hpp"
#include "softarm/transport/lcm_node.hpp"
#include "softarm/transport/mocap_adapter.hpp"
#include "softarm/transport/mocap_connection.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {

/// What became of a packet.
enum class MocapReceipt {
  frame,     ///< it completed a frame
  nothing,   ///< more has to come, or it was late or a repetition
  malformed  ///< not one message of the type of the source
};

/// Channels that carry motion capture: one, or one a body (base first, where it is not fixed);
/// none where the source has its own server.
std::vector<std::string> mocap_channels(const TransportSettings& transport);
/// Where frames come from, for a person: a channel, or "natnet at 192.168.1.20 port 1510".
std::string mocap_place(const TransportSettings& transport);

/// Turns what arrives on `channels()` into frames, capture times included. Belongs to one thread;
/// after construction it neither allocates nor throws. Where several frames carry one stamp, a
/// coarse clock or none, capture times follow from arrivals as with capture_time: latency.
class MocapSource {
 public:
  MocapSource(const TransportSettings& transport, const SafetySettings& safety,
              const ArmParameters& arm);

  /// To subscribe to; their places in this list are what `take` wants.
  const std::vector<std::string>& channels() const noexcept { return channels_; }
  /// Place of a channel in that list, for who reads a log; empty for any other.
  std::optional<std::size_t> find(std::string_view channel) const noexcept;

  /// @param arrival_ns on our monotonic clock, not decreasing from call to call
  /// @param frame written where the answer is `frame`; unspecified otherwise
  MocapReceipt take(std::size_t channel, std::span<const std::byte> bytes, std::int64_t arrival_ns,
                    MocapFrame& frame) noexcept;

  /// Connects to the server of the source, if it has one; `receive` has frames from then on.
  /// @throws TransportError
  void open(const TransportSettings& transport);
  /// The next step of what the server has sent: call until `nothing`. Never waits.
  MocapReceipt receive(std::int64_t now_ns, MocapFrame& frame) noexcept;
  /// How far the connection is; none where there is no server.
  std::optional<MocapStanding> standing() const noexcept;
  /// When the newest frame came in.
  std::int64_t arrival_ns() const noexcept { return arrival_ns_; }

  /// A frame of which a body is missing: true, and the frame, once it has waited long enough.
  /// For sources with a channel a body, once a tick; others never have one.
  bool overdue(std::int64_t now_ns, MocapFrame& frame) noexcept;

  /// Sender's clock at the capture of the newest frame, in us.
  std::int64_t sender_time_us() const noexcept { return sender_time_us_; }

 private:
  MocapReceipt take_sent(std::int64_t arrival_ns, MocapFrame& frame) noexcept;
  MocapReceipt take_body(std::size_t channel, std::int64_t arrival_ns, MocapFrame& frame) noexcept;

  MocapSourceKind kind_;
  MocapAdapter adapter_;
  ClockRelation clock_;
  std::vector<std::string> channels_;
  FrameAssembler assembler_;
  std::int64_t sender_time_us_ = 0;
  std::int64_t frame_number_ = 0, arrival_ns_ = kNever;
  CoarseClock sender_clock_;  ///< of whole frames; the assembler has that of single bodies
  std::unique_ptr<MocapFormat> format_;
  std::unique_ptr<SentFrame> sent_;
  std::unique_ptr<MocapConnection> connection_;
};

/// Publishes frames in the configured source's messages.
class MocapSender {
 public:
  /// @throws TransportError where a server of the source cannot be started
  MocapSender(const TransportSettings& transport, const ArmParameters& arm);

  /// @param sender_time_us of exposure, on any clock; also stands for the wall clock in utime
  void publish(LcmNode& node, const MocapFrame& frame, std::int64_t sender_time_us);

 private:
  MocapSourceKind kind_;
  MocapAdapter adapter_;
  std::vector<std::string> channels_;
  std::unique_ptr<MocapFormat> format_;
  std::unique_ptr<SentFrame> sent_;
  std::unique_ptr<MocapServer> server_;
};

}  // namespace softarm
