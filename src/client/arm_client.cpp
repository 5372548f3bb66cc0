#include "softarm/client/arm_client.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "client/arm_sight.hpp"
#include "client/command_ramp.hpp"
#include "softarm/base/clock.hpp"
#include "softarm/base/instance_lock.hpp"
#include "softarm/config/load.hpp"
#include "softarm/transport/message_decoding.hpp"
#include "softarm/transport/mocap_source.hpp"

namespace softarm {
namespace {

constexpr std::int64_t kCommandCounts_ns = 1'000'000'000;
constexpr std::int64_t kRest_ns = 1'000'000'000;

std::vector<double> checked(ConstVectorRef numbers, int expected, const char* what) {
  if (numbers.size() != expected || !numbers.allFinite())
    throw std::invalid_argument(fmt::format("{}: expected {} finite numbers, got {}{}", what,
                                            expected, numbers.size(),
                                            numbers.allFinite() ? "" : ", not all finite"));
  return {numbers.begin(), numbers.end()};
}

}  // namespace

/// Everything received, and the commands once the lock is taken.
struct ArmClient::State {
  explicit State(Experiment from)
      : experiment(std::move(from)),
        mocap(experiment.transport, experiment.safety, experiment.arm),
        sight(experiment) {
    mocap.open(experiment.transport);
  }

  void take_packet(std::size_t channel, const ArmMessage& message) {
    const MocapReceipt receipt = mocap.take(channel, message.bytes, message.arrival_ns, frame);
    if (receipt == MocapReceipt::malformed) ++not_frames;
    if (receipt == MocapReceipt::frame) take_frame(message.arrival_ns);
  }
  void take_frame(std::int64_t arrival_ns) {
    sight.take(frame, arrival_ns);
    if (on_frame) on_frame({frame, arrival_ns, mocap.sender_time_us()});
  }
  void take_command(const ArmMessage& message) {
    ChamberCommand newest;
    const bool by_torque = experiment.actuation.kind == ActuationKind::torque;
    if (!decode(message.bytes, by_torque, newest)) return;
    if (!newest.shadow && !(ramp && ramp->is_ours(newest))) others_command_ns = message.arrival_ns;
    if (on_command) on_command(newest);
    command = std::move(newest);
  }
  void take_measurement(const ArmMessage& message) {
    softarm_messages::pressure_measurement_t decoded;
    if (!decode(message.bytes, decoded)) return;
    // Valves that have vented since the last report hold no command of ours, whatever kept them.
    if (ramp && valves_expired && decoded.expired != *valves_expired) ramp->interrupt();
    valves_expired = decoded.expired;
    measured = {message.arrival_ns,
                Eigen::Map<const Eigen::VectorXf>(decoded.pressure_bar.data(),
                                                  std::ssize(decoded.pressure_bar))
                    .cast<double>()};
    if (on_measured) on_measured(*measured);
  }
  void take_plant(const ArmMessage& message) {
    PlantState newest;
    if (!decode(message.bytes, newest)) return;
    if (on_plant) on_plant(newest);
    plant = std::move(newest);
  }
  void take_law_request(const ArmMessage& message) {
    LawRequest newest;
    if (!decode(message.bytes, newest) || newest.u_rad.size() != experiment.arm.dof()) return;
    law_request = std::move(newest);
    if (on_law_request) on_law_request(*law_request);
  }
  void take_valves(const ArmMessage& message) {
    if (ValvesStatus newest; decode(message.bytes, newest)) valves = std::move(newest);
  }

  CommandRamp& commander() {
    if (!ramp) throw std::logic_error("commanding chambers: call lock_commands() first");
    return *ramp;
  }

  const Experiment experiment;
  MocapSource mocap;
  MocapFrame frame;
  ArmSight sight;
  std::int64_t not_frames = 0;
  std::optional<MeasuredPressures> measured;
  std::optional<ValvesStatus> valves;
  std::optional<PlantState> plant;
  std::optional<ChamberCommand> command;
  std::int64_t others_command_ns = kNever;
  std::function<void(const CapturedFrame&)> on_frame;
  std::function<void(const MeasuredPressures&)> on_measured;
  std::function<void(const PlantState&)> on_plant;
  std::function<void(const ChamberCommand&)> on_command;
  std::optional<LawRequest> law_request;
  std::function<void(const LawRequest&)> on_law_request;
  std::optional<InstanceLock> lock;
  std::optional<CommandRamp> ramp;
  std::optional<std::int32_t> valves_expired;  ///< count in their last report
  PauseWatch pause;
};

ArmClient::ArmClient(Experiment experiment, Clock clock)
    : OperatorClient(experiment.transport.lcm, experiment.arm.size(), std::move(clock)),
      state_(std::make_unique<State>(std::move(experiment))) {
  State& state = *state_;
  const LcmSettings& lcm = state.experiment.transport.lcm;
  for (std::size_t k = 0; k < state.mocap.channels().size(); ++k)
    listen(state.mocap.channels()[k],
           [&state, k](const ArmMessage& message) { state.take_packet(k, message); });
  listen(lcm.command_channel, [&state](const ArmMessage& message) { state.take_command(message); });
  listen(lcm.measurement_channel,
         [&state](const ArmMessage& message) { state.take_measurement(message); });
  listen(lcm.valves_channel, [&state](const ArmMessage& message) { state.take_valves(message); });
  if (state.experiment.control.law.get_if<ExternalLaw>() != nullptr)
    listen(lcm.law_state_channel,
           [&state](const ArmMessage& message) { state.take_law_request(message); });
  listen(lcm.plant_channel, [&state](const ArmMessage& message) { state.take_plant(message); });
}

ArmClient::ArmClient(const std::filesystem::path& experiment)
    : ArmClient(load_experiment(experiment)) {}

ArmClient::~ArmClient() {
  // The objects that they refer to may no longer exist.
  on_message({});
  on_status({});
  on_frame({});
  on_measured({});
  on_plant({});
  on_command({});
  on_law_request({});
  try {
    if (state_->ramp && !state_->ramp->set_points_bar().isZero(0.0)) vent_to_rest();
  } catch (...) {  // if nothing can be sent any more, the command expires
  }
}

void ArmClient::after_round() {
  State& state = *state_;
  while (true) {
    const MocapReceipt receipt = state.mocap.receive(now_ns(), state.frame);
    if (receipt == MocapReceipt::nothing) break;
    if (receipt == MocapReceipt::malformed) ++state.not_frames;
    if (receipt == MocapReceipt::frame) state.take_frame(state.mocap.arrival_ns());
  }
  if (state.mocap.overdue(now_ns(), state.frame)) state.take_frame(now_ns());
}

const Experiment& ArmClient::experiment() const { return state_->experiment; }
const SeenArm& ArmClient::seen() const { return state_->sight.seen(); }
std::int64_t ArmClient::not_frames() const { return state_->not_frames; }
const std::optional<MeasuredPressures>& ArmClient::measured() const { return state_->measured; }
const std::optional<ValvesStatus>& ArmClient::valves() const { return state_->valves; }
const std::optional<PlantState>& ArmClient::plant() const { return state_->plant; }
const std::optional<ChamberCommand>& ArmClient::command() const { return state_->command; }

void ArmClient::on_frame(std::function<void(const CapturedFrame&)> callback) {
  state_->on_frame = std::move(callback);
}
void ArmClient::on_measured(std::function<void(const MeasuredPressures&)> callback) {
  state_->on_measured = std::move(callback);
}
void ArmClient::on_plant(std::function<void(const PlantState&)> callback) {
  state_->on_plant = std::move(callback);
}
void ArmClient::on_command(std::function<void(const ChamberCommand&)> callback) {
  state_->on_command = std::move(callback);
}

std::string ArmClient::other_commander() const {
  const std::int64_t heard_ns = state_->others_command_ns;
  if ((heard_ns == kNever || now_ns() - heard_ns > kCommandCounts_ns) && !daemon_armed()) return {};
  return fmt::format("another program commands pressures on {} (softarmd: {}); end it first",
                     experiment().transport.lcm.command_channel, daemon_text());
}

void ArmClient::send_reference(ConstVectorRef u_rad, ConstVectorRef velocity_radps,
                               ConstVectorRef acceleration_radps2) {
  const int dof = 2 * experiment().arm.size();
  softarm_messages::curvature_reference_t message;
  message.dimension = static_cast<std::int16_t>(dof);
  message.u_rad = checked(u_rad, dof, "u of a reference");
  message.velocity_radps = checked(velocity_radps, dof, "velocity of a reference");
  message.acceleration_radps2 = checked(acceleration_radps2, dof, "acceleration of a reference");
  message.sequence = next_sequence();
  publish(experiment().transport.lcm.reference_channel, message);
}

void ArmClient::send_tip_target(const Eigen::Vector3d& position_m,
                                const Eigen::Vector3d& velocity_mps) {
  if (!position_m.allFinite() || !velocity_mps.allFinite())
    throw std::invalid_argument("target of the tip: expected finite numbers");
  softarm_messages::tip_target_t message;
  message.sequence = next_sequence();
  std::copy(position_m.begin(), position_m.end(), message.position_m);
  std::copy(velocity_mps.begin(), velocity_mps.end(), message.velocity_mps);
  publish(experiment().transport.lcm.tip_channel, message);
}

const std::optional<LawRequest>& ArmClient::law_request() const { return state_->law_request; }
void ArmClient::on_law_request(std::function<void(const LawRequest&)> callback) {
  state_->on_law_request = std::move(callback);
}

void ArmClient::answer(const LawRequest& request, std::int8_t answer, ConstVectorRef values,
                       int expected, double validity_s) {
  softarm_messages::law_command_t message;
  message.nonce = request.nonce;
  message.answer = answer;
  message.num_values = static_cast<std::int16_t>(expected);
  message.value = checked(values, expected, "answer of a law");
  message.validity_us = static_cast<std::int32_t>(1e6 * std::clamp(validity_s, 0.0, 1e3));
  message.sequence = next_sequence();
  publish(experiment().transport.lcm.law_channel, message);
}

void ArmClient::answer_force(const LawRequest& request, ConstVectorRef force_nm,
                             double validity_s) {
  answer(request, softarm_messages::law_command_t::FORCE, force_nm, experiment().arm.dof(),
         validity_s);
}

void ArmClient::answer_pressures(const LawRequest& request, ConstVectorRef pressure_bar,
                                 double validity_s) {
  answer(request, softarm_messages::law_command_t::PRESSURES, pressure_bar,
         chamber_count(experiment().actuation), validity_s);
}

void ArmClient::lock_commands() {
  const LcmSettings& lcm = experiment().transport.lcm;
  if (experiment().actuation.kind == ActuationKind::torque)
    throw std::logic_error("commanding chambers: expected actuation by chambers, got torque");
  if (state_->lock) throw std::logic_error("commanding chambers: the lock is taken already");
  state_->lock.emplace(lock_name(lcm.command_channel, lcm.url));
  state_->ramp.emplace(experiment().actuation, experiment().safety.command_validity_s);
}

void ArmClient::command_chambers(const PressureVector& wanted_bar, double rate_bar_per_s) {
  CommandRamp& ramp = state_->commander();
  if (wanted_bar.size() != ramp.set_points_bar().size())
    throw std::invalid_argument(fmt::format("set points: expected {} pressures, got {}",
                                            ramp.set_points_bar().size(), wanted_bar.size()));
  ramp.approach(wanted_bar, rate_bar_per_s, now_ns());
  send_command();
}

void ArmClient::vent() {
  state_->commander().vent(now_ns());
  send_command();
}

void ArmClient::send_command() {
  CommandRamp& ramp = *state_->ramp;
  if (state_->pause.paused()) ramp.interrupt();
  if (const std::int64_t now = now_ns(); ramp.due(now))
    publish(experiment().transport.lcm.command_channel, ramp.next(now));
}

void ArmClient::vent_to_rest() {
  if (!state_->ramp) return;
  std::int64_t now = now_ns();
  for (std::int64_t end = now + kRest_ns; now < end; now = now_ns()) {
    if (set_points_bar().maxCoeff() > 0.0) end = now + kRest_ns;
    vent();
    update(next_command_ns());
  }
}

const PressureVector& ArmClient::set_points_bar() const {
  return state_->commander().set_points_bar();
}
std::int64_t ArmClient::sent_ns() const { return state_->commander().sent_ns(); }
std::int64_t ArmClient::next_command_ns() const { return state_->commander().next_ns(); }
bool ArmClient::held_up() const { return state_->commander().held_up(); }

}  // namespace softarm
