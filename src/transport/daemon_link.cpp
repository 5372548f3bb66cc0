#include "softarm/transport/daemon_link.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "softarm/base/clock.hpp"
#include "softarm/base/time.hpp"
#include "softarm/runtime/settings.hpp"
#include "softarm/transport/message_decoding.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {
namespace {

/// Frames accepted between two ticks; LCM drops more, which then count as missing.
constexpr int kFrameCapacity = TickRecorder::kMostFrames;
constexpr int kOtherCapacity = 16;
/// Requests and goes: so many in a tick are a flood, in which others may have been dropped.
constexpr int kRequestCapacity = 64;
/// After a silence of this length a sender of references may restart its sequence numbers.
constexpr std::int64_t kNumberForgotten_ns = 500'000'000;
/// Longer than the repetitions of one key press last. People's machines may have different clocks,
/// from which the numbers come: after this time another machine's `arm` counts.
constexpr std::int64_t kPress_ns = 2'500'000'000;
/// A stop of the process that may have filled the socket; and for how long it is being emptied.
constexpr std::int64_t kStop_ns = 50'000'000;
constexpr std::int64_t kStopEnds_ns = 500'000'000;
/// A report that the valves are vented counts for so long.
constexpr std::int64_t kVentedFor_ns = 1'000'000'000;

}  // namespace

DaemonLink::DaemonLink(const PipelineSettings& settings, const TransportSettings& transport,
                       const Provenance& provenance, bool shadow)
    : lcm_(transport.lcm),
      mocap_(transport, settings.safety, settings.arm),
      node_(transport.lcm.url),
      dof_(2 * settings.arm.size()),
      messages_(settings, provenance, shadow),
      newest_measurement_ns_(kNever),
      newest_go_ns_(kNever),
      go_sequence_(kNever),
      reference_sequence_(kNever) {
  if (!lcm_.tick_channel.empty()) recorder_.emplace(settings, provenance, shadow);
  frames_.resize(static_cast<std::size_t>(
      recorder_ ? std::min(kFrameCapacity, recorder_->frame_capacity()) : kFrameCapacity));
  // All buffers are grown here, so that the loop never has to.
  for (auto* list : {&reference_message_.u_rad, &reference_message_.velocity_radps,
                     &reference_message_.acceleration_radps2})
    list->reserve(2 * kMaxSegments);
  measurement_message_.pressure_bar.reserve(kMaxChambers);
  heard_pressures_.pressure_bar.reserve(kMaxChambers);
  heard_torques_.torque_nm.reserve(kMaxChambers);
  law_message_.value.reserve(kMaxChambers);
  law_.values.resize(0);
  measured_bar_.setZero(std::ssize(messages_.pressure_command.pressure_bar));

  mocap_.open(transport);
  for (std::size_t k = 0; k < mocap_.channels().size(); ++k)
    node_.subscribe(mocap_.channels()[k], kFrameCapacity,
                    [this, k](const auto& packet) { take_frame(k, packet); });
  node_.subscribe(lcm_.reference_channel, kOtherCapacity,
                  [this](const auto& packet) { take_reference(packet); });
  for (const ReferencePhase& phase : settings.reference.phases) {
    if (phase.kind.get_if<LiveTipReference>() == nullptr) continue;
    node_.subscribe(lcm_.tip_channel, kOtherCapacity,
                    [this](const auto& packet) { take_tip_target(packet); });
    break;
  }
  if (settings.control.law.get_if<ExternalLaw>() != nullptr)
    node_.subscribe(lcm_.law_channel, kOtherCapacity,
                    [this](const auto& packet) { take_law(packet); });
  node_.subscribe(lcm_.operator_channel, kRequestCapacity,
                  [this](const auto& packet) { take_operator(packet); });
  // Whether valves have vented is heard even where their pressures are not judged.
  valve_readback_ = settings.safety.valve_readback;
  if (valve_readback_ || !shadow)
    node_.subscribe(lcm_.measurement_channel, kOtherCapacity,
                    [this](const auto& packet) { take_measurement(packet); });
  if (!lcm_.deadman_channel.empty())
    node_.subscribe(lcm_.deadman_channel, kRequestCapacity,
                    [this](const auto& packet) { take_go(packet); });
  if (!shadow)  // beside a shadow another daemon commands
    node_.subscribe(lcm_.command_channel, kOtherCapacity,
                    [this](const auto& packet) { take_command(packet); });
  dropped_ = node_.dropped();
}

TickInput DaemonLink::collect(std::int64_t now_ns) noexcept {
  const std::int64_t previous_ns = std::exchange(now_ns_, now_ns);
  frame_count_ = 0;
  requests_ = goes_ = 0;
  released_ = false;
  input_ = {};
  input_.now_ns = now_ns;
  input_.paused = pause_.paused() || paused_while_deciding_;
  paused_while_deciding_ = false;
  if (input_.paused) sent_us_ = kNever;  // its validity has passed, on whatever clock
  input_.command_expired = command_expired(now_ns / 1000);
  node_.drain(static_cast<int>(mocap_.channels().size()) * kFrameCapacity + 2 * kRequestCapacity +
              5 * kOtherCapacity);
  input_.requests.lost = requests_lost(previous_ns);
  // Of two inputs the one that is released is right; in a flood it may be the one not heard.
  if (released_ || goes_ >= kRequestCapacity) newest_go_ns_ = kNever;
  receive_frames();
  if (frame_count_ < frames_.size() && mocap_.overdue(now_ns, frames_[frame_count_]))
    ++frame_count_;
  input_.frames = {frames_.data(), frame_count_};
  input_.command_expired |= valves_vented_ && age_ns(now_ns, valves_heard_ns_) < kVentedFor_ns;
  input_.newest_measurement_ns = newest_measurement_ns_;
  input_.newest_go_ns = newest_go_ns_;
  input_.newest_foreign_ns = newest_foreign_ns_;
  return input_;
}

/// Messages that come in while the queue is being emptied also belong to this tick.
std::int64_t DaemonLink::arrival_ns(const ReceivedMessage& packet) const noexcept {
  return std::min(packet.arrival_ns, now_ns_);
}

void DaemonLink::take_frame(std::size_t channel, const ReceivedMessage& packet) noexcept {
  if (frame_count_ == frames_.size()) return;
  const MocapReceipt receipt =
      mocap_.take(channel, packet.bytes, arrival_ns(packet), frames_[frame_count_]);
  if (receipt == MocapReceipt::malformed) ++malformed_;
  if (receipt == MocapReceipt::frame) ++frame_count_;
}

/// From a server; what is more than the frames of a tick waits in the kernel's queue.
void DaemonLink::receive_frames() noexcept {
  for (std::size_t steps = 0; steps < 2 * frames_.size() && frame_count_ < frames_.size();
       ++steps) {
    const MocapReceipt receipt = mocap_.receive(now_ns_, frames_[frame_count_]);
    if (receipt == MocapReceipt::nothing) return;
    receipt == MocapReceipt::frame ? ++frame_count_ : ++malformed_;
  }
}

void DaemonLink::take_reference(const ReceivedMessage& packet) noexcept {
  const auto refuse = [this](LiveVerdict why) {
    ++references_refused_[static_cast<std::size_t>(why)];
  };
  const bool decoded = decode(packet.bytes, reference_message_);
  if (!decoded || reference_message_.dimension != dof_) {
    ++malformed_;
    if (decoded) refuse(LiveVerdict::wrong_size);
    return;
  }
  const bool forgotten = age_ns(now_ns_, newest_reference_ns_) > kNumberForgotten_ns;
  if (reference_message_.sequence <= reference_sequence_ && !forgotten) {
    if (reference_message_.sequence < reference_sequence_) {
      ++backward_references_;
      refuse(LiveVerdict::out_of_order);
    }
    return;
  }
  reference_sequence_ = reference_message_.sequence;
  newest_reference_ns_ = now_ns_;
  const auto vector = [this](const std::vector<double>& from) {
    return SegmentVector(Eigen::Map<const Eigen::VectorXd>(from.data(), dof_));
  };
  reference_ = {vector(reference_message_.u_rad), vector(reference_message_.velocity_radps),
                vector(reference_message_.acceleration_radps2)};
  input_.reference = &reference_;
}

void DaemonLink::take_tip_target(const ReceivedMessage& packet) noexcept {
  if (!decode(packet.bytes, tip_message_)) {
    ++malformed_;
    return;
  }
  const bool forgotten = age_ns(now_ns_, newest_tip_ns_) > kNumberForgotten_ns;
  if (tip_message_.sequence <= tip_sequence_ && !forgotten) {
    if (tip_message_.sequence < tip_sequence_)
      ++references_refused_[static_cast<std::size_t>(LiveVerdict::out_of_order)];
    return;
  }
  tip_sequence_ = tip_message_.sequence;
  newest_tip_ns_ = now_ns_;
  tip_target_ = {Eigen::Map<const Eigen::Vector3d>(tip_message_.position_m),
                 Eigen::Map<const Eigen::Vector3d>(tip_message_.velocity_mps)};
  input_.tip_target = &tip_target_;
}

/// Its sequence and nonce; the rest is judged by the pipeline, so that a replay judges it again.
void DaemonLink::take_law(const ReceivedMessage& packet) noexcept {
  if (!decode(packet.bytes, law_message_)) {
    ++malformed_;
    return;
  }
  const auto& [sequence, nonce, validity_us, answer, count, value] = law_message_;
  const auto refuse = [this](LawVerdict why) { ++law_refused_[static_cast<std::size_t>(why)]; };
  if (!is_recent(nonce, kNever)) return refuse(LawVerdict::not_recent);
  const bool forgotten = age_ns(now_ns_, newest_law_ns_) > kNumberForgotten_ns;
  if (sequence <= law_sequence_ && !forgotten) return refuse(LawVerdict::out_of_order);
  using Command = softarm_messages::law_command_t;
  const auto expected = answer == Command::FORCE       ? int{messages_.law_state.dimension}
                        : answer == Command::PRESSURES ? std::ssize(messages_.status.pressure_bar)
                                                       : -1;
  if (count != expected) return refuse(LawVerdict::wrong_size);
  law_sequence_ = sequence;
  newest_law_ns_ = now_ns_;
  law_.arrival_ns = arrival_ns(packet);
  // The state is that of the daemon that commands the arm, on another clock than a shadow's.
  const bool shadow = messages_.pressure_command.shadow != 0;
  law_.state_ns = shadow ? law_.arrival_ns : 1000 * nonces_.instant_us(nonce);
  law_.validity_ns = 1000 * std::int64_t{validity_us};
  law_.answer = answer == Command::FORCE ? LawAnswer::force : LawAnswer::pressures;
  law_.values = Eigen::Map<const Eigen::VectorXd>(value.data(), count);
  input_.law = &law_;
}

/// Those who see the daemon that commands the arm may ask its shadow for the same: it moves nothing.
bool DaemonLink::is_recent(std::int64_t nonce, std::int64_t since_us) const noexcept {
  return messages_.pressure_command.shadow != 0 || nonces_.accepts(nonce, now_ns_ / 1000, since_us);
}

void DaemonLink::take_operator(const ReceivedMessage& packet) noexcept {
  ++requests_;
  if (!decode(packet.bytes, operator_message_)) {
    ++malformed_;
    return;
  }
  using Request = softarm_messages::operator_command_t;
  const auto& [sequence, nonce, request] = operator_message_;
  const std::int64_t now_us = now_ns_ / 1000;
  if (age_ns(now_ns_, newest_request_ns_) > kPress_ns) newest_sequence_ = kNever;
  newest_request_ns_ = now_ns_;
  newest_sequence_ = std::max(newest_sequence_, sequence);
  if (request == Request::ARM) {
    const bool younger = sequence > refused_sequence_ || age_ns(now_ns_, refused_ns_) > kPress_ns;
    input_.requests.arm |= younger && is_recent(nonce, vented_us_);
    return;
  }
  // A request to vent is obeyed whatever its number and nonce; so is a request of an unknown kind.
  // But only somebody who has seen the FAULT acknowledges it, not one of a flood, nor a record.
  const bool emergency = request == Request::EMERGENCY_STOP;
  const bool acknowledges = request == Request::DISARM && is_recent(nonce, fault_us_);
  input_.requests.emergency_stop |= emergency;
  input_.requests.disarm |= !emergency && (mode_ != Mode::fault || acknowledges);
  if (emergency) fault_us_ = now_us;
  vented_us_ = now_us;
  refused_ns_ = now_ns_;
  refused_sequence_ = newest_sequence_;
}

/// LCM and the socket drop the newest without a word: what they dropped may have been a stop. The
/// socket is judged only after a stop of this process: in a flood of other channels a stop is
/// repeated until it is seen to work.
bool DaemonLink::requests_lost(std::int64_t previous_ns) noexcept {
  if (previous_ns != 0 && now_ns_ - previous_ns > kStop_ns) stopped_ns_ = now_ns_;
  const std::int64_t before = std::exchange(dropped_, node_.dropped());
  const bool after_stop = age_ns(now_ns_, stopped_ns_) < kStopEnds_ns;
  return requests_ >= kRequestCapacity || (after_stop && dropped_ != before);
}

void DaemonLink::take_measurement(const ReceivedMessage& packet) noexcept {
  const auto& measured = measurement_message_.pressure_bar;
  if (!decode(packet.bytes, measurement_message_) || std::ssize(measured) != measured_bar_.size() ||
      !std::all_of(measured.begin(), measured.end(),
                   [](float bar) { return std::isfinite(bar); })) {
    ++malformed_;
    return;
  }
  if (messages_.pressure_command.shadow == 0) take_valves_report();
  if (!valve_readback_) return;
  newest_measurement_ns_ = arrival_ns(packet);
  if (measurement_message_.time_us < measurement_time_us_) ++backward_measurements_;
  measurement_time_us_ = measurement_message_.time_us;
  std::copy(measured.begin(), measured.end(), measured_bar_.begin());
  // Measured pressures respond to the daemon that commands the valves, not to a shadow.
  if (messages_.pressure_command.shadow == 0) input_.measured_bar = &measured_bar_;
}

/// Valves that hold no command, or held none for a while since their last report, have vented: our
/// command was lost, late, or refused, although it was sent in time.
void DaemonLink::take_valves_report() noexcept {
  const bool fell = valves_heard_ns_ != kNever && measurement_message_.expired != valves_expired_;
  valves_expired_ = measurement_message_.expired;
  valves_vented_ = measurement_message_.sequence < 0;
  valves_heard_ns_ = now_ns_;
  granted_us_ = std::max(measurement_message_.validity_us, 0);
  input_.command_expired |= fell || valves_vented_;
}

void DaemonLink::take_go(const ReceivedMessage& packet) noexcept {
  ++goes_;
  if (!decode(packet.bytes, deadman_message_)) {
    ++malformed_;
    return;
  }
  if (deadman_message_.go == 0) released_ = true;
  if (deadman_message_.go == 0 || deadman_message_.sequence == go_sequence_ ||
      !is_recent(deadman_message_.nonce, kNever))
    return;
  go_sequence_ = deadman_message_.sequence;
  newest_go_ns_ = arrival_ns(packet);
}

void DaemonLink::take_command(const ReceivedMessage& packet) noexcept {
  // What no valve would take is no command.
  const auto take = [&](auto& message, const auto& values) {
    if (!decode(packet.bytes, message) || std::ssize(values) != measured_bar_.size() ||
        !std::all_of(values.begin(), values.end(), [](auto each) { return std::isfinite(each); })) {
      ++malformed_;
    } else if (message.shadow == 0 && !sent_.contains(message.sequence, message.time_us)) {
      newest_foreign_ns_ = arrival_ns(packet);
    }
  };
  messages_.by_torque() ? take(heard_torques_, heard_torques_.torque_nm)
                        : take(heard_pressures_, heard_pressures_.pressure_bar);
}

void DaemonLink::publish_command(std::int64_t now_ns, const TickOutput& output) noexcept {
  messages_.set_command(++commands_, output);
  const std::int64_t now_us = now_ns / 1000;
  if (pause_.paused()) {
    paused_while_deciding_ = true;
    sent_us_ = kNever;
  }
  if (command_expired(now_us) && !input_.command_expired) {
    ++unsent_;
    return;
  }
  messages_.pressure_command.time_us = messages_.torque_command.time_us = now_us;
  sent_.add(commands_, now_us);
  const std::string& channel = lcm_.command_channel;
  const bool sent = messages_.by_torque() ? node_.publish(channel, messages_.torque_command)
                                          : node_.publish(channel, messages_.pressure_command);
  if (sent) sent_us_ = now_us;
  if (!sent) ++unsent_;
}

bool DaemonLink::command_expired(std::int64_t now_us) const noexcept {
  return sent_us_ == kNever || now_us - sent_us_ >= held_us();
}

std::int32_t DaemonLink::held_us() const noexcept {
  const std::int32_t asked_us = messages_.pressure_command.validity_us;
  return granted_us_ > 0 ? std::min(asked_us, granted_us_) : asked_us;
}

void DaemonLink::publish_law_state(std::int64_t now_ns, const TickOutput& output) noexcept {
  if (output.law == nullptr || messages_.pressure_command.shadow != 0) return;
  messages_.set_law_state(commands_, output);
  auto& message = messages_.law_state;
  message.time_us = now_ns / 1000;
  message.nonce = nonces_.at(message.time_us);
  if (!node_.publish(lcm_.law_state_channel, message)) ++unsent_;
}

void DaemonLink::publish_status(std::int64_t now_ns, const ControlPipeline& pipeline,
                                const LoopTiming& timing, bool show) noexcept {
  messages_.set_status(timing.ticks, pipeline);
  auto& status = messages_.status;
  status.time_us = now_ns / 1000;
  status.nonce = nonces_.at(status.time_us);
  // This status is the first that shows it.
  const Mode mode = pipeline.output().mode;
  if (mode >= Mode::vent && mode_ < Mode::vent) vented_us_ = status.time_us;
  if (mode == Mode::fault && mode_ != Mode::fault) vented_us_ = fault_us_ = status.time_us;
  mode_ = mode;
  status.overruns = counter(timing.overruns);
  status.messages_malformed = counter(malformed_);
  // These are refused before the pipeline.
  for (const LiveVerdict why : {LiveVerdict::wrong_size, LiveVerdict::out_of_order}) {
    const auto k = static_cast<std::size_t>(why);
    status.references_refused[k] += counter(references_refused_[k]);
  }
  for (const LawVerdict why :
       {LawVerdict::not_recent, LawVerdict::out_of_order, LawVerdict::wrong_size}) {
    const auto k = static_cast<std::size_t>(why);
    status.law_answers[k] += counter(law_refused_[k]);
  }
  if (show && !node_.publish(lcm_.status_channel, status)) ++unsent_;
  if (!messages_.set_observer(timing.ticks, pipeline)) return;
  messages_.observer.time_us = status.time_us;
  if (!node_.publish(lcm_.observer_channel, messages_.observer)) ++unsent_;
}

void DaemonLink::publish_record(const TickInput& input, const TickOutput& output) noexcept {
  if (!recorder_) return;
  if (recorder_->full()) repeat_record();
  const auto bytes = recorder_->record(commands_, input, output.pressure_bar);
  if (!node_.publish_encoded(lcm_.tick_channel, bytes)) ++unsent_;
}

bool DaemonLink::repeat_record() noexcept {
  if (!recorder_) return false;
  const auto bytes = recorder_->take_oldest();
  if (bytes.empty()) return false;
  if (!node_.publish_encoded(lcm_.tick_channel, bytes)) ++unsent_;
  return true;
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
    std::transform(histograms[k]->counts().begin(), histograms[k]->counts().end(), counts[k],
                   counter);
    message.max_us[k] = static_cast<float>(histograms[k]->max_us());
  }
  if (!node_.publish(lcm_.timing_channel, message)) ++unsent_;
}

}  // namespace softarm
