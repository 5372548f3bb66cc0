#include "softarm/client/arm_listener.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "softarm/base/clock.hpp"
#include "softarm/base/time.hpp"
#include "softarm/runtime/safety_monitor.hpp"
#include "softarm/transport/message_decoding.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {
namespace {

constexpr int kQueue = 1024;
constexpr std::int64_t kSpeedSpan_ns = 50'000'000;  ///< so far apart, noise is no speed
constexpr std::int64_t kStatusCounts_ns = 1'000'000'000;

TransportSettings with_other_order(TransportSettings transport) {
  transport.mocap.quaternion = transport.mocap.quaternion == QuaternionOrder::wxyz
                                   ? QuaternionOrder::xyzw
                                   : QuaternionOrder::wxyz;
  return transport;
}

}  // namespace

ArmListener::ArmListener(const Experiment& experiment, LcmNode& node, bool keep)
    : experiment_(experiment),
      keep_(keep),
      mocap_(experiment.transport, experiment.safety, experiment.arm),
      in_other_order_(with_other_order(experiment.transport), experiment.safety, experiment.arm),
      estimator_(experiment.estimation, experiment.arm,
                 body_noise(experiment.estimation, experiment.arm.size())) {
  const LcmSettings& lcm = experiment.transport.lcm;
  const BodySettings& bodies = experiment.transport.bodies;
  known_ids_.insert(bodies.segment_ids.begin(), bodies.segment_ids.end());
  known_ids_.insert(bodies.base_id);
  seen_.start_ns = monotonic_now_ns();
  seen_.wall_minus_ns = wall_now_ns() - seen_.start_ns;
  seen_.channels = mocap_.channels();
  for (std::size_t k = 0; k < mocap_.channels().size(); ++k)
    node.subscribe(mocap_.channels()[k], kQueue,
                   [this, k](const ReceivedMessage& packet) { take_packet(k, packet); });
  node.subscribe(lcm.measurement_channel, kQueue,
                 [this](const ReceivedMessage& packet) { take_pressures(packet); });
  node.subscribe(lcm.command_channel, kQueue, [this](const ReceivedMessage& packet) {
    if (!commanding_ && decode(packet.bytes, command_message_) && command_message_.shadow == 0)
      seen_.commanded_by_others = true;
  });
  node.subscribe(lcm.status_channel, kQueue, [this](const ReceivedMessage& packet) {
    // A shadow commands nothing, and must not hide what the daemon says.
    if (!decode(packet.bytes, newest_status_) ||
        (newest_status_.flags & newest_status_.SHADOW) != 0)
      return;
    status_ = newest_status_;
    status_ns_ = monotonic_now_ns();
  });
}

// Called from LCM: nothing may be thrown through it. Storage grows, which is all it can fail at.
void ArmListener::take_packet(std::size_t channel, const ReceivedMessage& packet) {
  const std::int64_t now_ns = packet.arrival_ns;  // what else we do must not count as jitter
  if (keep_) {
    note_ids(packet.bytes);
    in_other_order_.take(channel, packet.bytes, now_ns, other_frame_);
  }
  const MocapReceipt receipt = mocap_.take(channel, packet.bytes, now_ns, frame_);
  if (receipt == MocapReceipt::malformed) ++seen_.not_frames;
  if (receipt == MocapReceipt::frame) take_frame(now_ns);
}

void ArmListener::look_at_clock() {
  const std::int64_t now_ns = monotonic_now_ns();
  if (keep_) in_other_order_.overdue(now_ns, other_frame_);
  if (mocap_.overdue(now_ns, frame_)) take_frame(now_ns);
}

/// Bodies that nobody configured.
void ArmListener::note_ids(std::span<const std::byte> bytes) {
  softarm_messages::mocap_frame_t message;
  if (experiment_.transport.mocap.source != softarm_mocap() || !decode(bytes, message)) return;
  for (const auto& body : message.bodies)
    if (known_ids_.insert(body.id).second) seen_.other_ids.push_back(body.id);
}

void ArmListener::take_frame(std::int64_t now_ns) {
  const auto n = static_cast<std::size_t>(experiment_.arm.size());
  if (keep_)
    seen_.frames.push_back({now_ns,
                            mocap_.sender_time_us(),
                            frame_.frame_number,
                            {frame_.body.begin(), frame_.body.begin() + n + 1},
                            {other_frame_.body.begin(), other_frame_.body.begin() + n + 1}});
  // Who repeats his last frame does not see the arm.
  if (frame_.frame_number == last_number_ || frame_.capture_ns <= captured_ns_) return;
  last_number_ = frame_.frame_number;
  estimator_.estimate(frame_, estimate_);
  if (!std::all_of(estimate_.valid.begin(), estimate_.valid.begin() + n,
                   [](bool each) { return each; }))
    return;
  u_rad_ = estimate_.u_rad;
  whole_frame_ns_ = now_ns;
  captured_ns_ = frame_.capture_ns;
  recent_.push_back({now_ns, u_rad_});
  while (recent_.size() > 10 && recent_[1].arrival_ns < now_ns - kSpeedSpan_ns) recent_.pop_front();
}

void ArmListener::take_pressures(const ReceivedMessage& packet) {
  if (!decode(packet.bytes, measurement_message_)) return;
  measured_bar_.assign(measurement_message_.pressure_bar.begin(),
                       measurement_message_.pressure_bar.end());
  if (keep_) seen_.pressures.push_back({packet.arrival_ns, measured_bar_});
}

double ArmListener::largest_theta_rad() const {
  double theta_rad = 0.0;
  for (Eigen::Index k = 0; k + 1 < u_rad_.size(); k += 2)
    theta_rad = std::max(theta_rad, u_rad_.segment<2>(k).norm());
  return theta_rad;
}

double ArmListener::fastest_radps() const {
  if (recent_.size() < 2) return 0.0;
  const double span_s = to_seconds(recent_.back().arrival_ns - recent_.front().arrival_ns);
  const Eigen::VectorXd moved_rad = recent_.back().u_rad - recent_.front().u_rad;
  double fastest_rad = 0.0;
  for (Eigen::Index k = 0; k + 1 < moved_rad.size(); k += 2)
    fastest_rad = std::max(fastest_rad, moved_rad.segment<2>(k).norm());
  // Frames that a stall delivers all at once are no motion.
  return span_s > to_seconds(kSpeedSpan_ns) / 2.0 ? fastest_rad / span_s : 0.0;
}

bool ArmListener::daemon_armed(std::int64_t now_ns) const {
  if (status_ns_ == kNever || now_ns - status_ns_ > kStatusCounts_ns) return false;
  const auto mode = static_cast<Mode>(status_.mode);
  return (status_.flags & status_.ARMED) != 0 || mode == Mode::active || mode == Mode::hold;
}

std::string ArmListener::other_commander() const {
  if (!seen_.commanded_by_others && !daemon_armed(monotonic_now_ns())) return {};
  return fmt::format("somebody commands pressures on {} (softarmd: {}); end it first",
                     experiment_.transport.lcm.command_channel, daemon_text());
}

std::string ArmListener::beyond_limits(std::int64_t lost_ns) const {
  const IdentificationSettings& limits = experiment_.identification;
  const std::int64_t now_ns = monotonic_now_ns();
  if (daemon_armed(now_ns)) return "a daemon is armed: " + daemon_text();
  if (whole_frame_ns_ == kNever || now_ns - whole_frame_ns_ > lost_ns)
    return fmt::format("no frame with every segment for {} ms", lost_ns / 1'000'000);
  if (largest_theta_rad() > limits.max_theta_rad)
    return fmt::format(
        "a segment bends by {:.3g} rad, beyond identification.max_theta_rad of {:.3g} rad",
        largest_theta_rad(), limits.max_theta_rad);
  if (fastest_radps() > limits.max_speed_radps)
    return fmt::format(
        "a segment moves at {:.3g} rad/s, beyond identification.max_speed_radps of {:.3g} rad/s",
        fastest_radps(), limits.max_speed_radps);
  return {};
}

std::string ArmListener::daemon_text() const {
  if (status_ns_ == kNever) return "not heard";
  return fmt::format("{} ({})", name(static_cast<Mode>(status_.mode)),
                     name(static_cast<Reason>(status_.reason)));
}

}  // namespace softarm
