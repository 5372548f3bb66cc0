#include "softarm/transport/mocap_source.hpp"

#include <algorithm>

#include "softarm/base/time.hpp"
#include "softarm/runtime/settings.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {

std::vector<std::string> mocap_channels(const TransportSettings& transport) {
  if (transport.mocap.source.network) return {};
  if (!transport.mocap.source.channel_per_body) return {transport.lcm.mocap_channel};
  std::vector<std::string> channels;
  if (transport.bodies.base_id >= 0)
    channels.push_back(body_channel(transport.lcm, transport.bodies.base_marker_frame));
  for (const MarkerFrameSettings& frame : transport.bodies.segment_marker_frames)
    channels.push_back(body_channel(transport.lcm, frame));
  return channels;
}

std::string mocap_place(const TransportSettings& transport) {
  const MocapNetworkSettings& network = transport.mocap.network;
  if (transport.mocap.source.network)
    return std::string(transport.mocap.source.name()) + " at " + network.host + " port " +
           std::to_string(network.port);
  return mocap_channels(transport).front();
}

const char* MocapStanding::text() const noexcept {
  constexpr const char* kText[] = {"no answer from the server", "the server knows no body",
                                   "frames arrive"};
  return kText[static_cast<std::size_t>(state)];
}

MocapSource::MocapSource(const TransportSettings& transport, const SafetySettings& safety,
                         const ArmParameters& arm)
    : kind_(transport.mocap.source),
      adapter_(transport.bodies, arm, transport.mocap),
      clock_(transport.capture_time, safety.frame_latency_s),
      channels_(mocap_channels(transport)),
      assembler_(static_cast<int>(transport.bodies.segment_ids.size()), adapter_.base_is_fixed(),
                 safety.frame_period_s),
      format_(kind_.make()),
      sent_(std::make_unique<SentFrame>()) {}

std::optional<std::size_t> MocapSource::find(std::string_view channel) const noexcept {
  const auto at = std::find(channels_.begin(), channels_.end(), channel);
  if (at == channels_.end()) return std::nullopt;
  return static_cast<std::size_t>(at - channels_.begin());
}

MocapReceipt MocapSource::take(std::size_t channel, std::span<const std::byte> bytes,
                               std::int64_t arrival_ns, MocapFrame& frame) noexcept {
  if (!format_->decode(bytes, *sent_)) return MocapReceipt::malformed;
  if (kind_.channel_per_body) return take_body(channel, arrival_ns, frame);
  return take_sent(arrival_ns, frame);
}

void MocapSource::open(const TransportSettings& transport) {
  if (kind_.network) connection_ = kind_.network->connect(transport);
}

MocapReceipt MocapSource::receive(std::int64_t now_ns, MocapFrame& frame) noexcept {
  if (!connection_) return MocapReceipt::nothing;
  const MocapNews news = connection_->next(now_ns, *sent_, arrival_ns_);
  if (news == MocapNews::frame) return take_sent(arrival_ns_, frame);
  return news == MocapNews::malformed ? MocapReceipt::malformed : MocapReceipt::nothing;
}

std::optional<MocapStanding> MocapSource::standing() const noexcept {
  if (!connection_) return std::nullopt;
  return connection_->standing();
}

MocapReceipt MocapSource::take_sent(std::int64_t arrival_ns, MocapFrame& frame) noexcept {
  adapter_.to_frame(*sent_, frame);
  const std::int64_t stamp_us =
      is_time_us(sent_->sender_time_us) ? sent_->sender_time_us : kNoTime_us;
  if (sent_->frame_number != frame_number_) {
    sender_clock_.count(stamp_us == sender_time_us_);
    frame_number_ = sent_->frame_number;
  }
  sender_time_us_ = stamp_us;
  // Several frames with one stamp would be captured at once: the arrival is the better time.
  frame.capture_ns = clock_.capture_ns(arrival_ns, sender_clock_.coarse() ? kNoTime_us : stamp_us);
  return MocapReceipt::frame;
}

MocapReceipt MocapSource::take_body(std::size_t channel, std::int64_t arrival_ns,
                                    MocapFrame& frame) noexcept {
  const std::int64_t stamp_us = sent_->sender_time_us;
  if (channel >= channels_.size() || sent_->bodies != 1 || !is_time_us(stamp_us))
    return MocapReceipt::malformed;
  const std::size_t body = channel + (adapter_.base_is_fixed() ? 1 : 0);
  const auto outcome =
      assembler_.add(body, adapter_.to_pose(sent_->body[0], body), stamp_us, arrival_ns);
  if (outcome == FrameAssembler::Outcome::begun)
    assembler_.set_capture_ns(
        clock_.capture_ns(arrival_ns, assembler_.coarse_clock() ? kNoTime_us : stamp_us));
  adapter_.clear(frame);
  if (!assembler_.take_done(frame)) return MocapReceipt::nothing;
  sender_time_us_ = stamp_us;
  return MocapReceipt::frame;
}

bool MocapSource::overdue(std::int64_t now_ns, MocapFrame& frame) noexcept {
  if (!kind_.channel_per_body) return false;
  assembler_.look_at_clock(now_ns);
  adapter_.clear(frame);
  return assembler_.take_done(frame);
}

MocapSender::MocapSender(const TransportSettings& transport, const ArmParameters& arm)
    : kind_(transport.mocap.source),
      adapter_(transport.bodies, arm, transport.mocap),
      channels_(mocap_channels(transport)),
      format_(kind_.make()),
      sent_(std::make_unique<SentFrame>()) {
  if (kind_.network) server_ = kind_.network->serve(transport);
}

void MocapSender::publish(LcmNode& node, const MocapFrame& frame, std::int64_t sender_time_us) {
  if (!kind_.channel_per_body) {
    adapter_.to_sent(frame, sender_time_us, *sent_);
    if (server_) {
      server_->send(*sent_);
      return;
    }
    node.publish_encoded(channels_.front(), format_->encode(*sent_));
    return;
  }
  sent_->sender_time_us = sender_time_us;
  sent_->bodies = 1;
  const std::size_t first = adapter_.base_is_fixed() ? 1 : 0;
  for (std::size_t k = 0; k < channels_.size(); ++k) {
    if (!frame.body[first + k].valid) continue;
    sent_->body[0] = adapter_.to_sent(frame.body[first + k], first + k);
    node.publish_encoded(channels_[k], format_->encode(*sent_));
  }
}

}  // namespace softarm
