#include "softarm/commissioning/preflight/observer.hpp"

#include "softarm/transport/message_decoding.hpp"

namespace softarm {
namespace {

TransportSettings with_other_order(TransportSettings transport) {
  transport.mocap.quaternion = transport.mocap.quaternion == QuaternionOrder::wxyz
                                   ? QuaternionOrder::xyzw
                                   : QuaternionOrder::wxyz;
  return transport;
}

}  // namespace

Observer::Observer(ArmClient& client)
    : client_(client),
      in_other_order_(with_other_order(client.experiment().transport), client.experiment().safety,
                      client.experiment().arm) {
  const BodySettings& bodies = client.experiment().transport.bodies;
  known_ids_.insert(bodies.segment_ids.begin(), bodies.segment_ids.end());
  known_ids_.insert(bodies.base_id);
  seen_.start_ns = client.now_ns();
  seen_.wall_minus_ns = wall_now_ns() - seen_.start_ns;
  seen_.channels = in_other_order_.channels();
  client.on_message([this](const ArmMessage& message) { take_message(message); });
  client.on_frame([this](const CapturedFrame& captured) { take_frame(captured); });
  client.on_measured([this](const MeasuredPressures& measured) {
    seen_.pressures.push_back({measured.arrival_ns, {measured.bar.begin(), measured.bar.end()}});
  });
  client.on_command([this](const ChamberCommand& command) {
    if (seen_.rest_end_ns == 0 && !command.shadow) seen_.commanded_by_others = true;
  });
}

const Observation& Observer::seen() {
  seen_.not_frames = client_.not_frames();
  return seen_;
}

/// Called before the client decodes the message, and so before the frame that it may complete.
void Observer::take_message(const ArmMessage& message) {
  const auto channel = in_other_order_.find(message.channel);
  if (!channel) return;
  note_ids(message.bytes);
  other_is_complete_ = in_other_order_.take(*channel, message.bytes, message.arrival_ns,
                                            other_frame_) == MocapReceipt::frame;
}

void Observer::take_frame(const CapturedFrame& captured) {
  // A frame that was waiting for a body is overdue in either order.
  if (client_.experiment().transport.mocap.source.network)
    other_frame_ = captured.frame;  // the protocol gives the order
  else if (!other_is_complete_)
    in_other_order_.overdue(captured.arrival_ns, other_frame_);
  other_is_complete_ = false;
  const auto bodies = client_.experiment().arm.size() + 1;
  const auto& body = captured.frame.body;
  seen_.frames.push_back({captured.arrival_ns,
                          captured.sender_us,
                          captured.frame.frame_number,
                          {body.begin(), body.begin() + bodies},
                          {other_frame_.body.begin(), other_frame_.body.begin() + bodies},
                          captured.frame.capture_ns});
}

/// Notes bodies that are not configured.
void Observer::note_ids(std::span<const std::byte> bytes) {
  softarm_messages::mocap_frame_t message;
  if (client_.experiment().transport.mocap.source != softarm_mocap() || !decode(bytes, message))
    return;
  for (const auto& body : message.bodies)
    if (known_ids_.insert(body.id).second) seen_.other_ids.push_back(body.id);
}

}  // namespace softarm
