#include "softarm/transport/daemon_link.hpp"

#include <time.h>

#include <algorithm>
#include <cmath>

#include "softarm/transport/message_decoding.hpp"

namespace softarm {
namespace {

constexpr int kFrameCapacity =
    64;  ///< what may arrive between two ticks; more is dropped by LCM and counted as missing
constexpr int kOtherCapacity = 16;
constexpr int kMessagesPerTick = kFrameCapacity + 3 * kOtherCapacity;
constexpr auto kNever = std::numeric_limits<std::int64_t>::min();
/// After so long a silence a sender of references or requests may begin its numbers anew.
constexpr std::int64_t kNumberForgotten_ns = 500'000'000;

std::int64_t wall_clock_ns() noexcept {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

std::int32_t counter(std::int64_t value) noexcept {
  return static_cast<std::int32_t>(
      std::min<std::int64_t>(value, std::numeric_limits<std::int32_t>::max()));
}

std::int16_t flags_of(const TickOutput& output, bool shadow) noexcept {
  const bool bits[] = {
      output.saturated, output.slew_limited, output.reference_limited, output.soft_limit,
      shadow,           output.armed};
  int flags = 0;
  for (int k = 0; k < 6; ++k) flags |= bits[k] ? 1 << k : 0;
  return static_cast<std::int16_t>(flags);
}

/// Component pairs of a 2n vector; NaN where it is empty.
void put_pairs(const SegmentVector& from, std::vector<std::vector<float>>& to) noexcept {
  for (std::size_t i = 0; i < to.size(); ++i)
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const auto k = static_cast<Eigen::Index>(2 * i + axis);
      to[i][axis] =
          k < from.size() ? static_cast<float>(from[k]) : std::numeric_limits<float>::quiet_NaN();
    }
}

}  // namespace

DaemonLink::DaemonLink(const PipelineSettings& settings, Provenance provenance, bool shadow)
    : settings_(settings.daemon),
      adapter_(settings.daemon.bodies, settings.arm),
      clock_(settings.daemon.capture_time, settings.daemon.safety.frame_latency_s),
      node_(settings.daemon.lcm.url),
      dof_(settings.arm.dof()),
      by_torque_(settings.actuation.kind == ActuationKind::torque),
      frames_(kFrameCapacity),
      newest_measurement_ns_(kNever),
      reference_sequence_(kNever),
      operator_sequence_(kNever) {
  const auto segments = static_cast<std::size_t>(settings.arm.size());
  std::size_t chambers = 0;
  for (const auto& segment : settings.actuation.segments) chambers += segment.size();

  // Everything that grows is grown here, so that the loop never has to.
  frame_message_.bodies.reserve(4 * static_cast<std::size_t>(kMaxBodies));
  for (auto* list : {&reference_message_.u_rad, &reference_message_.velocity_radps,
                     &reference_message_.acceleration_radps2})
    list->reserve(2 * kMaxSegments);
  measurement_message_.pressure_bar.reserve(kMaxChambers);
  command_message_.shadow = shadow ? 1 : 0;
  command_message_.validity_us =
      static_cast<std::int32_t>(std::lround(1e6 * settings_.lcm.command_validity_s));
  command_message_.sequence = 0;
  command_message_.num_chambers = static_cast<std::int16_t>(chambers);
  command_message_.pressure_bar.assign(chambers, 0.0F);
  torque_message_.shadow = command_message_.shadow;
  torque_message_.validity_us = command_message_.validity_us;
  torque_message_.num_moments = static_cast<std::int16_t>(chambers);
  torque_message_.torque_nm.assign(chambers, 0.0);
  status_message_ = {};
  status_message_.version = std::move(provenance.version);
  status_message_.configuration_hash = static_cast<std::int64_t>(provenance.configuration_hash);
  status_message_.seed = static_cast<std::int64_t>(provenance.seed);
  status_message_.num_segments = static_cast<std::int16_t>(segments);
  status_message_.num_chambers = static_cast<std::int16_t>(chambers);
  for (auto* pairs : {&status_message_.u_rad, &status_message_.velocity_radps,
                      &status_message_.reference_u_rad, &status_message_.tau_actuation_nm})
    pairs->assign(segments, std::vector<float>(2));
  for (auto* list : {&status_message_.phi_rad, &status_message_.theta_rad,
                     &status_message_.residual_twist_rad, &status_message_.residual_length_m})
    list->assign(segments, 0.0F);
  status_message_.pressure_bar.assign(chambers, 0.0F);

  node_.subscribe(settings_.lcm.mocap_channel, kFrameCapacity,
                  [this](const auto& packet) { take_frame(packet); });
  node_.subscribe(settings_.lcm.reference_channel, kOtherCapacity,
                  [this](const auto& packet) { take_reference(packet); });
  node_.subscribe(settings_.lcm.operator_channel, kOtherCapacity,
                  [this](const auto& packet) { take_operator(packet); });
  if (settings_.safety.valve_readback)
    node_.subscribe(settings_.lcm.measurement_channel, kOtherCapacity,
                    [this](const auto& packet) { take_measurement(packet); });
}

TickInput DaemonLink::collect(std::int64_t now_ns) noexcept {
  previous_collect_ns_ = now_ns_;
  now_ns_ = now_ns;
  wall_minus_monotonic_ns_ = wall_clock_ns() - now_ns;
  frame_count_ = 0;
  input_ = {};
  input_.now_ns = now_ns;
  node_.drain(kMessagesPerTick);
  input_.frames = {frames_.data(), frame_count_};
  input_.newest_measurement_ns = newest_measurement_ns_;
  return input_;
}

/// LCM stamps arrivals with the wall clock. Brought to ours they can only lie between the last
/// collection and now: so a wall clock that is set meanwhile does no harm.
std::int64_t DaemonLink::arrival_ns(const ReceivedMessage& packet) const noexcept {
  const std::int64_t arrival = packet.arrival_utime_us * 1000 - wall_minus_monotonic_ns_;
  return std::clamp(arrival, previous_collect_ns_, now_ns_);
}

void DaemonLink::take_frame(const ReceivedMessage& packet) noexcept {
  if (!decode(packet.bytes, frame_message_)) {
    ++malformed_;
    return;
  }
  if (frame_count_ == frames_.size()) return;
  MocapFrame& frame = frames_[frame_count_++];
  adapter_.to_frame(frame_message_, frame);
  frame.capture_ns = clock_.capture_ns(arrival_ns(packet), frame_message_.capture_time_us);
}

void DaemonLink::take_reference(const ReceivedMessage& packet) noexcept {
  if (!decode(packet.bytes, reference_message_) || reference_message_.dimension != dof_) {
    ++malformed_;
    return;
  }
  const bool forgotten = now_ns_ - newest_reference_ns_ > kNumberForgotten_ns;
  if (reference_message_.sequence <= reference_sequence_ && !forgotten) return;
  reference_sequence_ = reference_message_.sequence;
  newest_reference_ns_ = now_ns_;
  const auto vector = [this](const std::vector<double>& from) {
    return SegmentVector(Eigen::Map<const Eigen::VectorXd>(from.data(), dof_));
  };
  reference_ = {vector(reference_message_.u_rad), vector(reference_message_.velocity_radps),
                vector(reference_message_.acceleration_radps2)};
  input_.reference = &reference_;
}

void DaemonLink::take_operator(const ReceivedMessage& packet) noexcept {
  if (!decode(packet.bytes, operator_message_)) {
    ++malformed_;
    return;
  }
  const bool newer = operator_message_.sequence > operator_sequence_ ||
                     now_ns_ - newest_operator_ns_ > kNumberForgotten_ns;
  if (newer) operator_sequence_ = operator_message_.sequence;
  newest_operator_ns_ = now_ns_;
  // Whoever wants the arm vented is right, whatever the number; so is a request nobody knows.
  const bool arm = operator_message_.request == softarm_messages::operator_command_t::ARM;
  input_.disarm |= !arm;
  input_.arm |= arm && newer;
}

void DaemonLink::take_measurement(const ReceivedMessage& packet) noexcept {
  if (decode(packet.bytes, measurement_message_)) {
    newest_measurement_ns_ = arrival_ns(packet);
  } else {
    ++malformed_;
  }
}

void DaemonLink::publish_command(std::int64_t now_ns, const TickOutput& output) noexcept {
  ++command_message_.sequence;
  command_message_.time_us = now_ns / 1000;
  for (std::size_t j = 0; j < command_message_.pressure_bar.size(); ++j)
    command_message_.pressure_bar[j] =
        static_cast<float>(output.pressure_bar[static_cast<Eigen::Index>(j)]);
  if (by_torque_) {
    torque_message_.sequence = command_message_.sequence;
    torque_message_.time_us = command_message_.time_us;
    std::copy(output.pressure_bar.begin(), output.pressure_bar.end(),
              torque_message_.torque_nm.begin());
    if (!node_.publish(settings_.lcm.command_channel, torque_message_)) ++unsent_;
    return;
  }
  if (!node_.publish(settings_.lcm.command_channel, command_message_)) ++unsent_;
}

void DaemonLink::publish_status(std::int64_t now_ns, const ControlPipeline& pipeline,
                                const LoopTiming& timing) noexcept {
  const TickOutput& output = pipeline.output();
  const FrameCounters& frames = pipeline.counters();
  const CurvatureEstimate& estimate = pipeline.estimate();
  auto& status = status_message_;
  status.time_us = now_ns / 1000;
  status.tick = timing.ticks;
  status.frame_number = output.frame_number;
  status.mode = static_cast<std::int8_t>(output.mode);
  status.reason = static_cast<std::int8_t>(output.reason);
  status.flags = flags_of(output, command_message_.shadow != 0);
  status.frame_age_s = static_cast<float>(output.frame_age_s);
  status.frames_accepted = counter(frames.accepted);
  status.frames_rejected = counter(frames.rejected() + pipeline.late_frames());
  status.frames_repeated = counter(frames.repeated);
  status.frames_missing = counter(frames.missing);
  status.overruns = counter(timing.overruns);
  status.messages_malformed = counter(malformed_);
  put_pairs(output.motion.u_rad, status.u_rad);
  put_pairs(output.motion.velocity_radps, status.velocity_radps);
  put_pairs(output.reference.u, status.reference_u_rad);
  put_pairs(output.tau_actuation_nm, status.tau_actuation_nm);
  for (std::size_t i = 0; i < status.theta_rad.size(); ++i) {
    const float x = status.u_rad[i][0];
    const float y = status.u_rad[i][1];
    status.phi_rad[i] = std::atan2(y, x);
    status.theta_rad[i] = std::hypot(x, y);
    status.residual_twist_rad[i] = static_cast<float>(estimate.twist_rad[i]);
    status.residual_length_m[i] = static_cast<float>(estimate.length_error_m[i]);
  }
  status.pressure_bar = command_message_.pressure_bar;
  if (!node_.publish(settings_.lcm.status_channel, status)) ++unsent_;
}

void DaemonLink::publish_timing(std::int64_t now_ns, const LoopTiming& timing) noexcept {
  auto& message = timing_message_;
  message.time_us = now_ns / 1000;
  message.ticks = timing.ticks;
  message.overruns = timing.overruns;
  const DurationHistogram* histograms[] = {&timing.lateness, &timing.frame_age, &timing.tick,
                                           &timing.publish};
  std::int32_t* counts[] = {message.lateness_count, message.frame_age_count, message.tick_count,
                            message.publish_count};
  for (std::size_t k = 0; k < 4; ++k) {
    std::copy(histograms[k]->counts().begin(), histograms[k]->counts().end(), counts[k]);
    message.max_us[k] = static_cast<float>(histograms[k]->max_us());
  }
  if (!node_.publish(settings_.lcm.timing_channel, message)) ++unsent_;
}

}  // namespace softarm
