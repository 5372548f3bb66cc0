#include "softarm/transport/mocap_source.hpp"

#include <algorithm>
#include <cmath>

#include "softarm/base/time.hpp"
#include "softarm/runtime/settings.hpp"
#include "softarm/transport/message_decoding.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {
namespace {

constexpr std::int64_t kNonsense_us = kLatest_us + 1;  // no clock relation takes it

std::int64_t to_us(double time_s) noexcept {
  const double time_us = 1e6 * time_s;
  return std::abs(time_us) <= static_cast<double>(kLatest_us) ? std::llround(time_us)
                                                              : kNonsense_us;
}

}  // namespace

std::vector<std::string> mocap_channels(const TransportSettings& transport) {
  if (transport.mocap.source != MocapSourceKind::rigid_transform)
    return {transport.lcm.mocap_channel};
  std::vector<std::string> channels;
  if (transport.bodies.base_id >= 0)
    channels.push_back(body_channel(transport.lcm, transport.bodies.base_plate));
  for (const PlateSettings& plate : transport.bodies.segment_plates)
    channels.push_back(body_channel(transport.lcm, plate));
  return channels;
}

MocapSource::MocapSource(const TransportSettings& transport, const SafetySettings& safety,
                         const ArmParameters& arm)
    : kind_(transport.mocap.source),
      adapter_(transport.bodies, arm, transport.mocap),
      clock_(transport.capture_time, safety.frame_latency_s),
      channels_(mocap_channels(transport)),
      assembler_(static_cast<int>(transport.bodies.segment_ids.size()), adapter_.base_is_fixed(),
                 safety.frame_period_s) {
  message_.bodies.reserve(4 * static_cast<std::size_t>(kMaxBodies));
  if (kind_ == MocapSourceKind::optitrack) optitrack_ = std::make_unique<OptitrackFrame>();
}

std::optional<std::size_t> MocapSource::find(std::string_view channel) const noexcept {
  const auto at = std::find(channels_.begin(), channels_.end(), channel);
  if (at == channels_.end()) return std::nullopt;
  return static_cast<std::size_t>(at - channels_.begin());
}

MocapReceipt MocapSource::take(std::size_t channel, std::span<const std::byte> bytes,
                               std::int64_t arrival_ns, MocapFrame& frame) noexcept {
  if (kind_ == MocapSourceKind::rigid_transform)
    return take_body(channel, bytes, arrival_ns, frame);
  if (kind_ == MocapSourceKind::optitrack) {
    if (!decode(bytes, *optitrack_)) return MocapReceipt::malformed;
    adapter_.to_frame(*optitrack_, frame);
    sender_time_us_ = to_us(optitrack_->timestamp_s);
  } else {
    if (!decode(bytes, message_)) return MocapReceipt::malformed;
    adapter_.to_frame(message_, frame);
    sender_time_us_ =
        is_time_us(message_.capture_time_us) ? message_.capture_time_us : kNonsense_us;
  }
  frame.capture_ns = clock_.capture_ns(arrival_ns, sender_time_us_);
  return MocapReceipt::frame;
}

MocapReceipt MocapSource::take_body(std::size_t channel, std::span<const std::byte> bytes,
                                    std::int64_t arrival_ns, MocapFrame& frame) noexcept {
  softarm_messages::rigid_transform_t message;
  if (channel >= channels_.size() || !decode(bytes, message) || !is_time_us(message.utime))
    return MocapReceipt::malformed;
  const std::size_t body = channel + (adapter_.base_is_fixed() ? 1 : 0);
  const auto outcome =
      assembler_.add(body, adapter_.to_pose(message, body), message.utime, arrival_ns);
  if (outcome == FrameAssembler::Outcome::begun)
    assembler_.set_capture_ns(clock_.capture_ns(arrival_ns, message.utime));
  adapter_.clear(frame);
  if (!assembler_.take_done(frame)) return MocapReceipt::nothing;
  sender_time_us_ = message.utime;
  return MocapReceipt::frame;
}

bool MocapSource::overdue(std::int64_t now_ns, MocapFrame& frame) noexcept {
  if (kind_ != MocapSourceKind::rigid_transform) return false;
  assembler_.look_at_clock(now_ns);
  adapter_.clear(frame);
  return assembler_.take_done(frame);
}

MocapSender::MocapSender(const TransportSettings& transport, const ArmParameters& arm)
    : kind_(transport.mocap.source),
      adapter_(transport.bodies, arm, transport.mocap),
      channels_(mocap_channels(transport)) {}

void MocapSender::publish(LcmNode& node, const MocapFrame& frame, std::int64_t sender_time_us) {
  if (kind_ == MocapSourceKind::softarm) {
    adapter_.to_message(frame, sender_time_us, message_);
    node.publish(channels_.front(), message_);
  } else if (kind_ == MocapSourceKind::optitrack) {
    adapter_.to_message(frame, sender_time_us, optitrack_);
    node.publish(channels_.front(), optitrack_);
  } else {
    const std::size_t first = adapter_.base_is_fixed() ? 1 : 0;
    for (std::size_t k = 0; k < channels_.size(); ++k) {
      if (!frame.body[first + k].valid) continue;
      softarm_messages::rigid_transform_t message;
      adapter_.to_message(frame.body[first + k], first + k, sender_time_us, message);
      node.publish(channels_[k], message);
    }
  }
}

}  // namespace softarm
