#include "apps/softarm-plant/plant_process.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "apps/program.hpp"
#include "apps/signals.hpp"
#include "softarm/base/clock.hpp"
#include "softarm/base/time.hpp"
#include "softarm/transport/message_decoding.hpp"
#include "softarm/valves/valve_guard.hpp"

namespace softarm {
namespace {

constexpr int kCommandCapacity = 64;
/// The longest stall that the arm catches up with. For the rest its time stands still: otherwise a
/// machine that is too slow would fall further behind with every step.
constexpr std::int64_t kMostBehind_ns = 250'000'000;

}  // namespace

PlantProcess::PlantProcess(const Experiment& experiment, std::optional<int> modbus_port)
    : lcm_(experiment.transport.lcm),
      mocap_(experiment.transport, experiment.plant.arm),
      node_(lcm_.url),
      arm_(experiment.plant, monotonic_now_ns()),
      local_(is_local(lcm_.url)),
      by_torque_(experiment.plant.actuation.kind == ActuationKind::torque),
      report_period_ns_(to_ns(1.0 / experiment.plant.mocap.rate_hz)) {
  if (modbus_port) {
    modbus_ = std::make_unique<ModbusSide>(experiment.valves, *modbus_port);
    say(fmt::format("softarm-plant: valve terminal at 127.0.0.1 port {}\n",
                    modbus_->server.port()));
    return;
  }
  valve_side_.emplace(experiment.plant.actuation, to_ns(experiment.safety.command_validity_s));
  set_points_ = valve_side_->set_points();
  measurement_message_.validity_us =
      static_cast<std::int32_t>(valve_side_->commands().longest_ns() / 1000);
  // No exception may pass through LCM, so the handler only takes the message; the loop acts on
  // it.
  node_.subscribe(lcm_.command_channel, kCommandCapacity, [this](const ReceivedMessage& packet) {
    command_received_ =
        by_torque_ ? decode(packet.bytes, torque_message_) : decode(packet.bytes, command_message_);
  });
}

void PlantProcess::run() {
  std::int64_t next_report_ns = arm_.time_ns();
  while (stop_requested == 0) {
    const std::int64_t valves_ns = valve_side_ ? valve_side_->next_event_ns() : kForever;
    const std::int64_t deadline_ns =
        std::min({next_report_ns, arm_.next_event_ns(), valves_ns}) + lost_ns_;
    modbus_ ? serve_requests(deadline_ns) : take_commands(deadline_ns);
    advance();
    for (MocapFrame frame; arm_.receive(frame);) {
      mocap_.publish(node_, frame, (frame.capture_ns + lost_ns_) / 1000);
    }
    if (arm_.time_ns() >= next_report_ns) {
      publish_state();
      next_report_ns = std::max(next_report_ns + report_period_ns_, arm_.time_ns());
    }
  }
}

void PlantProcess::take_commands(std::int64_t deadline_ns) {
  if (!node_.wait_until(deadline_ns)) return;
  // All messages that came meanwhile: a full queue would keep the oldest commands and drop the
  // newest.
  int taken = 0;
  do {
    if (std::exchange(command_received_, false)) take_command();
  } while (++taken < kCommandCapacity && node_.drain(1) > 0);
}

/// Written set points hold until the terminal's time-out, counted from the last write.
void PlantProcess::serve_requests(std::int64_t deadline_ns) {
  if (!modbus_->server.wait_until(deadline_ns)) return;
  advance();
  SimulatedTerminal& terminal = modbus_->terminal;
  terminal.measure(arm_.measured_pressures_bar());
  modbus_->server.serve(terminal);
  if (!terminal.take_written()) return;
  const Eigen::VectorXd& bar = terminal.set_points_bar();
  const double timeout_s = terminal.timeout_s();
  arm_.command({.sequence = modbus_->sequence++,
                .validity_ns = timeout_s > 0.0 ? to_ns(timeout_s) : kForever,
                .pressure_bar = {bar.data(), static_cast<std::size_t>(bar.size())}},
               arm_now_ns());
}

/// The arm's time: the monotonic clock minus the time lost in stalls.
std::int64_t PlantProcess::arm_now_ns() {
  const std::int64_t now_ns = monotonic_now_ns() - lost_ns_;
  const std::int64_t excess_ns = now_ns - arm_.time_ns() - kMostBehind_ns;
  if (excess_ns <= 0) return now_ns;
  lost_ns_ += excess_ns;
  say(fmt::format("softarm-plant: {:.3f} s behind real time; the arm stood still meanwhile\n",
                  to_seconds(excess_ns)));
  return now_ns - excess_ns;
}

void PlantProcess::advance() {
  const bool was_vented = vented();
  const std::int64_t now_ns = arm_now_ns();
  if (valve_side_) advance_valve_side(now_ns);
  arm_.advance_to(now_ns);
  if (!vented() || was_vented) return;
  say("softarm-plant: commands have stopped; vented\n");
  if (modbus_) modbus_->terminal.reset_outputs();
}

void PlantProcess::advance_valve_side(std::int64_t now_ns) {
  if (pause_.paused()) valve_side_->pause();
  const auto follow_at = [&](std::int64_t time_ns) {
    valve_side_->update(time_ns);
    if (valve_side_->set_points() == set_points_) return;
    set_points_ = valve_side_->set_points();
    arm_.command(PressureVector(set_points_), kForever, time_ns);
  };
  while (valve_side_->next_event_ns() < now_ns) follow_at(valve_side_->next_event_ns());
  follow_at(now_ns);
  const bool degraded = valve_side_->degraded(now_ns);
  if (degraded && !degraded_) say("softarm-plant: DEGRADED (another sender): vented\n");
  degraded_ = degraded;
}

void PlantProcess::take_command() {
  by_torque_ ? take_command(torque_message_, torque_message_.torque_nm)
             : take_command(command_message_, command_message_.pressure_bar);
}

template <class Message, class Values>
void PlantProcess::take_command(const Message& message, const Values& values) {
  if (local_ && is_untimely(message.time_us, message.validity_us, monotonic_now_ns() / 1000))
    return;
  pressure_bar_.assign(values.begin(), values.end());
  advance();
  const bool was_vented = vented();
  valve_side_->receive({.sequence = message.sequence,
                        .validity_ns = std::int64_t{message.validity_us} * 1000,
                        .sent_us = message.time_us,
                        .shadow = message.shadow != 0,
                        .pressure_bar = pressure_bar_},
                       arm_now_ns());
  if (was_vented && !vented()) say("softarm-plant: commands have begun\n");
  const CommandExpiry& commands = valve_side_->commands();
  const std::int64_t asked_us = commands.asked_ns() / 1000;
  if (commands.asked_ns() <= commands.longest_ns() || asked_us == shortened_us_) return;
  shortened_us_ = asked_us;
  say(
      fmt::format("softarm-plant: commands ask to be held for {:.3g} s; they expire after "
                  "daemon.lcm.command_validity_s, {:.3g} s\n",
                  to_seconds(commands.asked_ns()), to_seconds(commands.longest_ns())));
}

void PlantProcess::publish_state() {
  const ArmPlant& plant = arm_.plant();
  const Eigen::VectorXd& pressure = arm_.measured_pressures_bar();
  measurement_message_.time_us = (arm_.time_ns() + lost_ns_) / 1000;
  measurement_message_.sequence = valve_side_ ? valve_side_->sequence() : arm_.sequence();
  measurement_message_.expired =
      valve_side_ ? static_cast<std::int32_t>(valve_side_->times_vented()) : 0;
  measurement_message_.reason = static_cast<std::int8_t>(degraded_  ? ValveReason::other_sender
                                                         : vented() ? ValveReason::no_command
                                                                    : ValveReason::none);
  measurement_message_.num_chambers = static_cast<std::int16_t>(pressure.size());
  measurement_message_.pressure_bar.assign(pressure.begin(), pressure.end());
  if (!by_torque_ && !modbus_) node_.publish(lcm_.measurement_channel, measurement_message_);

  const SegmentVector u = plant.u_rad();
  const SegmentVector velocity = plant.velocity_radps();
  state_message_.time_us = measurement_message_.time_us;
  state_message_.vented = vented() ? 1 : 0;
  state_message_.num_segments = static_cast<std::int16_t>(plant.segments());
  state_message_.num_chambers = measurement_message_.num_chambers;
  state_message_.u_rad.clear();
  state_message_.velocity_radps.clear();
  for (int i = 0; i < plant.segments(); ++i) {
    state_message_.u_rad.push_back({u[2 * i], u[2 * i + 1]});
    state_message_.velocity_radps.push_back({velocity[2 * i], velocity[2 * i + 1]});
  }
  state_message_.pressure_bar = measurement_message_.pressure_bar;
  const Eigen::Vector3d tip = plant.tip_m();
  for (int axis = 0; axis < 3; ++axis) state_message_.tip_m[axis] = tip[axis];
  const SegmentScalars elongation = plant.elongation_m(), rate = plant.elongation_rate_mps();
  state_message_.num_stretching = static_cast<std::int16_t>(elongation.size());
  state_message_.elongation_m.assign(elongation.begin(), elongation.end());
  state_message_.elongation_rate_mps.assign(rate.begin(), rate.end());
  node_.publish(lcm_.plant_channel, state_message_);
}

}  // namespace softarm
