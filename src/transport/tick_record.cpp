#include "softarm/transport/tick_record.hpp"

#include <algorithm>
#include <cmath>
#include <softarm_messages/law_command_t.hpp>

#include "softarm/base/hash.hpp"
#include "softarm/runtime/settings.hpp"
#include "softarm/transport/lcm_node.hpp"

namespace softarm {
namespace {

using softarm_messages::law_command_t;
using softarm_messages::tick_frame_t;
using softarm_messages::tick_record_t;

void put_digest(std::span<std::byte> encoded) noexcept {
  std::uint64_t digest = fnv1a(encoded.first(encoded.size() - kRecordDigest));
  for (std::size_t k = 1; k <= kRecordDigest; ++k, digest >>= 8)
    encoded[encoded.size() - k] = static_cast<std::byte>(digest & 0xff);
}

void grow_to(std::vector<double>& list, std::size_t size) {
  if (list.size() < size) list.resize(size);
}

template <class Vector>
void put(const Vector& from, std::vector<double>& to) {
  grow_to(to, static_cast<std::size_t>(from.size()));
  std::copy(from.begin(), from.end(), to.begin());
}

SegmentVector vector_of(const std::vector<double>& from, int size) {
  return Eigen::Map<const Eigen::VectorXd>(from.data(), size);
}

void put(const MocapFrame& frame, tick_frame_t& to) {
  const auto& [frame_number, capture_ns, segments, body] = frame;
  to.frame_number = frame_number;
  to.capture_ns = capture_ns;
  const auto bodies = static_cast<std::size_t>(segments) + 1;
  to.num_bodies = static_cast<std::int16_t>(bodies);
  if (to.bodies.size() < bodies) to.bodies.resize(bodies);
  for (std::size_t i = 0; i < bodies; ++i) {
    const auto& [position_m, orientation, valid] = body[i];
    auto& message = to.bodies[i];
    message.id = static_cast<std::int32_t>(i);
    message.valid = valid ? 1 : 0;
    std::copy(position_m.begin(), position_m.end(), message.position_m);
    message.orientation[0] = orientation.w();
    message.orientation[1] = orientation.x();
    message.orientation[2] = orientation.y();
    message.orientation[3] = orientation.z();
  }
}

void get(const tick_frame_t& from, MocapFrame& frame) {
  frame.frame_number = from.frame_number;
  frame.capture_ns = from.capture_ns;
  frame.segments = from.num_bodies - 1;
  for (std::size_t i = 0; i < from.bodies.size(); ++i) {
    const auto& message = from.bodies[i];
    frame.body[i].position_m = Eigen::Map<const Eigen::Vector3d>(message.position_m);
    frame.body[i].orientation = Eigen::Quaterniond(message.orientation[0], message.orientation[1],
                                                   message.orientation[2], message.orientation[3]);
    frame.body[i].valid = message.valid != 0;
  }
}

/// The largest possible record of this arm.
tick_record_t largest_record(const PipelineSettings& settings, const std::string& build) {
  tick_record_t record{};
  const auto dof = static_cast<std::size_t>(2 * settings.arm.size());
  const auto chambers = static_cast<std::size_t>(chamber_count(settings.actuation));
  record.num_chambers = static_cast<std::int16_t>(chambers);
  record.pressure_bar.resize(chambers);
  record.num_measured = record.num_chambers;
  record.measured_bar.resize(chambers);
  record.dimension = static_cast<std::int16_t>(dof);
  for (auto* list : {&record.u_rad, &record.velocity_radps, &record.acceleration_radps2})
    list->resize(dof);
  record.num_tip = 6;
  record.tip_target.resize(6);
  if (settings.control.law.get_if<ExternalLaw>() != nullptr) {
    record.law_value.resize(std::max(static_cast<std::size_t>(settings.arm.dof()), chambers));
    record.num_law = static_cast<std::int16_t>(record.law_value.size());
  }
  record.build = build;
  tick_frame_t frame{};
  put(MocapFrame{.segments = settings.arm.size(), .body = {}}, frame);
  const int left = LcmNode::kLargestMessage - record.getEncodedSize();
  const int size = frame.getEncodedSize() - 8;  // without the hash of a separate message
  record.num_frames =
      static_cast<std::int16_t>(std::clamp<int>(left / size, 1, TickRecorder::kMostFrames));
  record.frames.assign(static_cast<std::size_t>(record.num_frames), frame);
  return record;
}

}  // namespace

bool is_intact(std::span<const std::byte> encoded) noexcept {
  if (encoded.size() < kRecordDigest) return false;
  std::uint64_t digest = 0;
  for (const std::byte each : encoded.last(kRecordDigest))
    digest = digest << 8 | std::to_integer<std::uint64_t>(each);
  return digest == fnv1a(encoded.first(encoded.size() - kRecordDigest));
}

void to_record(const TickInput& input, tick_record_t& record) {
  // A new field of TickInput breaks the build here: it must be added to lcmtypes/tick_record_t.lcm,
  // to this function, to RecordedInput::from and to the size that decode() checks.
  const auto& [now_ns, frames, reference, requests, command_expired, paused, consecutive_overruns,
               newest_measurement_ns, tip_target, law, measured_bar, newest_go_ns,
               newest_foreign_ns] = input;
  const auto& [arm, disarm, emergency_stop, shutdown, lost] = requests;
  record.now_ns = now_ns;
  record.num_frames = static_cast<std::int16_t>(frames.size());
  if (record.frames.size() < frames.size()) record.frames.resize(frames.size());
  for (std::size_t k = 0; k < frames.size(); ++k) put(frames[k], record.frames[k]);
  record.dimension = 0;
  if (reference != nullptr) {
    const auto& [u, velocity, acceleration] = *reference;
    record.dimension = static_cast<std::int16_t>(u.size());
    put(u, record.u_rad);
    put(velocity, record.velocity_radps);
    put(acceleration, record.acceleration_radps2);
  }
  record.arm = arm ? 1 : 0;
  record.disarm = disarm ? 1 : 0;
  record.emergency_stop = emergency_stop ? 1 : 0;
  record.shutdown = shutdown ? 1 : 0;
  record.requests_lost = lost ? 1 : 0;
  record.command_expired = command_expired ? 1 : 0;
  record.paused = paused ? 1 : 0;
  record.consecutive_overruns = consecutive_overruns;
  record.newest_measurement_ns = newest_measurement_ns;
  record.newest_go_ns = newest_go_ns;
  record.newest_foreign_ns = newest_foreign_ns;
  record.num_tip = 0;
  if (tip_target != nullptr) {
    const auto& [position_m, velocity_mps] = *tip_target;
    record.num_tip = 6;
    grow_to(record.tip_target, 6);
    std::copy(position_m.begin(), position_m.end(), record.tip_target.begin());
    std::copy(velocity_mps.begin(), velocity_mps.end(), record.tip_target.begin() + 3);
  }
  record.law_answer = -1;
  record.num_law = 0;
  record.law_state_ns = record.law_arrival_ns = record.law_validity_ns = 0;
  if (law != nullptr) {
    const auto& [state_ns, arrival_ns, validity_ns, answer, values] = *law;
    record.law_state_ns = state_ns;
    record.law_arrival_ns = arrival_ns;
    record.law_validity_ns = validity_ns;
    record.law_answer =
        answer == LawAnswer::pressures ? law_command_t::PRESSURES : law_command_t::FORCE;
    record.num_law = static_cast<std::int16_t>(values.size());
    put(values, record.law_value);
  }
  record.num_measured = 0;
  if (measured_bar != nullptr) {
    record.num_measured = static_cast<std::int16_t>(measured_bar->size());
    // Valves publish floats, so nothing is lost here.
    if (record.measured_bar.size() < static_cast<std::size_t>(measured_bar->size()))
      record.measured_bar.resize(static_cast<std::size_t>(measured_bar->size()));
    std::transform(measured_bar->begin(), measured_bar->end(), record.measured_bar.begin(),
                   [](double bar) { return static_cast<float>(bar); });
  }
}

const TickInput& RecordedInput::from(const tick_record_t& record) {
  input_ = {};
  input_.now_ns = record.now_ns;
  frames_.resize(static_cast<std::size_t>(record.num_frames));
  for (std::size_t k = 0; k < frames_.size(); ++k) get(record.frames[k], frames_[k]);
  input_.frames = frames_;
  if (record.dimension > 0) {
    reference_ = {vector_of(record.u_rad, record.dimension),
                  vector_of(record.velocity_radps, record.dimension),
                  vector_of(record.acceleration_radps2, record.dimension)};
    input_.reference = &reference_;
  }
  input_.requests = {.arm = record.arm != 0,
                     .disarm = record.disarm != 0,
                     .emergency_stop = record.emergency_stop != 0,
                     .shutdown = record.shutdown != 0,
                     .lost = record.requests_lost != 0};
  input_.command_expired = record.command_expired != 0;
  input_.paused = record.paused != 0;
  input_.consecutive_overruns = record.consecutive_overruns;
  input_.newest_measurement_ns = record.newest_measurement_ns;
  input_.newest_go_ns = record.newest_go_ns;
  input_.newest_foreign_ns = record.newest_foreign_ns;
  if (record.num_tip == 6) {
    tip_target_ = {Eigen::Map<const Eigen::Vector3d>(record.tip_target.data()),
                   Eigen::Map<const Eigen::Vector3d>(record.tip_target.data() + 3)};
    input_.tip_target = &tip_target_;
  }
  if (record.law_answer >= 0) {
    law_ = {record.law_state_ns, record.law_arrival_ns, record.law_validity_ns,
            record.law_answer == law_command_t::PRESSURES ? LawAnswer::pressures : LawAnswer::force,
            Eigen::Map<const Eigen::VectorXd>(record.law_value.data(), record.num_law)};
    input_.law = &law_;
  }
  if (record.num_measured > 0) {
    measured_bar_ =
        Eigen::Map<const Eigen::VectorXf>(record.measured_bar.data(), record.num_measured)
            .cast<double>();
    input_.measured_bar = &measured_bar_;
  }
  return input_;
}

TickRecorder::TickRecorder(const PipelineSettings& settings, const Provenance& provenance,
                           bool shadow)
    : record_(largest_record(settings, provenance.build)),
      build_(provenance.build),
      ticks_per_build_(std::max(1LL, std::llround(settings.rate_hz))),
      slot_bytes_(static_cast<std::size_t>(record_.getEncodedSize())),
      slots_(kRepeatAfter * slot_bytes_),
      sizes_(kRepeatAfter) {
  record_.configuration_hash = static_cast<std::int64_t>(provenance.configuration_hash);
  record_.shadow = shadow ? 1 : 0;
}

std::span<const std::byte> TickRecorder::record(std::int64_t tick, const TickInput& input,
                                                const PressureVector& command) noexcept {
  if (tick == 1) record_.first_ns = input.now_ns;
  record_.tick = tick;
  to_record(input, record_);
  std::copy(command.begin(), command.end(), record_.pressure_bar.begin());
  if (tick % ticks_per_build_ == 1 % ticks_per_build_) {
    record_.build = build_;
  } else {
    record_.build.clear();
  }
  const auto slot = static_cast<std::size_t>(next_);
  std::byte* bytes = slots_.data() + slot * slot_bytes_;
  const int size = record_.encode(bytes, 0, static_cast<int>(slot_bytes_));
  sizes_[slot] = static_cast<std::size_t>(std::max(size, 0));
  if (size > 0) put_digest({bytes, sizes_[slot]});
  next_ = (next_ + 1) % kRepeatAfter;
  kept_ = std::min(kept_ + 1, kRepeatAfter);
  return {bytes, sizes_[slot]};
}

std::span<const std::byte> TickRecorder::take_oldest() noexcept {
  if (kept_ == 0) return {};
  const auto slot = static_cast<std::size_t>((next_ + kRepeatAfter - kept_) % kRepeatAfter);
  --kept_;
  return {slots_.data() + slot * slot_bytes_, sizes_[slot]};
}

}  // namespace softarm
