// How a soak causes its faults.
#include <algorithm>
#include <softarm_messages/pressure_command_t.hpp>

#include "dev/soak/soak_run.hpp"
#include "softarm/base/clock.hpp"
#include "softarm/base/time.hpp"

namespace softarm {
namespace {

using namespace std::chrono_literals;

constexpr double kPressure_bar = 0.5;  ///< from which a valve can be seen to fail

}  // namespace

void SoakRun::make_pressure() {
  arm_.wait_for([&] { return arm_.fullest_bar() > kPressure_bar; }, kPatience_s);
}

void SoakRun::send_hostile_bytes() {
  const std::vector<Packet> packets = hostile_packets(experiment_.transport.lcm);
  for (int round = 0; round < 10; ++round) {
    for (const Packet& packet : packets) sender_.send(packet);
    arm_.wait_for([] { return false; }, 0.02);  // the real frames come through
  }
}

void SoakRun::flood(const std::string& channel, const std::function<void()>& meanwhile) {
  const Packet garbage = lcm_packet(channel, Packet(100, std::byte{7}));
  for (const double end_s = passed_s() + 0.3; passed_s() < end_s;) {
    for (int k = 0; k < 100; ++k) sender_.send(garbage);
    arm_.wait_for([] { return true; }, 0.0);
    meanwhile();
  }
}

/// SIGSTOP, for longer than vent_after_s.
void SoakRun::pause_daemon(const std::function<void()>& meanwhile) {
  const std::int64_t before = arm_.overruns();
  const std::int64_t tick = arm_.ticks();
  daemon_.process->stop();
  const double end_s = passed_s() + 2.0 * experiment_.safety.vent_after_s;
  while (passed_s() < end_s) {
    meanwhile();
    arm_.wait_for([] { return false; }, 0.05);
  }
  daemon_.process->signal(SIGCONT);
  arm_.wait_for([&] { return arm_.ticks() > tick + 2; }, kPatience_s);
  counters_.overruns_while_stopped += arm_.overruns() - before;
}

/// As softarm estop does: until a status shows it.
void SoakRun::insist_on_stop() {
  const auto stopped = [&] { return arm_.saw(Mode::fault, Reason::emergency_stop); };
  for (const double end_s = passed_s() + kPatience_s; passed_s() < end_s && !stopped();) {
    arm_.request(OperatorRequest::emergency_stop);
    arm_.wait_for(stopped, 0.05);
  }
}

void SoakRun::send_foreign_command() {
  const std::size_t chambers = arm_.chambers();
  softarm_messages::pressure_command_t command{};
  command.time_us = monotonic_now_ns() / 1000;
  command.sequence = 1'000'000'000 + command.time_us;
  command.validity_us = 100'000;
  command.num_chambers = static_cast<std::int16_t>(chambers);
  command.pressure_bar.assign(chambers, static_cast<float>(experiment_.actuation.max_pressure_bar));
  Packet bytes(static_cast<std::size_t>(command.getEncodedSize()));
  command.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  sender_.send(lcm_packet(experiment_.transport.lcm.command_channel, bytes));
}

void SoakRun::cause(const SoakFault& fault) {
  const LcmSettings& lcm = experiment_.transport.lcm;
  const auto stop = [&] { arm_.request(OperatorRequest::emergency_stop); };
  switch (fault.action) {
    case SoakAction::relay: {
      Fault chosen = *find_fault(fault.relay_fault);
      if (fault.amount > 0.0) chosen.amount = fault.amount;
      const int segments = experiment_.arm.size();
      chosen.body = std::uniform_int_distribution(1, segments)(random_);
      if (chosen.kind == FaultKind::burst) {
        make_pressure();
        chosen.body = arm_.fullest_chamber();
      }
      return relay_.set(chosen);
    }
    case SoakAction::disarm:
      return arm_.request(OperatorRequest::disarm);
    case SoakAction::emergency_stop:
      return arm_.request(OperatorRequest::emergency_stop);
    case SoakAction::let_go:
      return arm_.set_dead_man(SoakArm::DeadMan::let_go);
    case SoakAction::fall_silent:
      return arm_.set_dead_man(SoakArm::DeadMan::silent);
    case SoakAction::hostile:
      return send_hostile_bytes();
    case SoakAction::flood:
      return flood(lcm.mocap_channel);
    case SoakAction::pause_daemon:
      return pause_daemon([] {});
    case SoakAction::stop_while_paused:
      pause_daemon(stop);
      return insist_on_stop();
    case SoakAction::stop_in_flood:
      flood(lcm.operator_channel, stop);
      return insist_on_stop();
    case SoakAction::second_commander:
      return send_foreign_command();
    case SoakAction::lose_commands:
      relay_.lose_commands(true);
      arm_.wait_for([&] { return arm_.plant_vented() && terminal_vented(); }, kPatience_s);
      return relay_.lose_commands(false);
    case SoakAction::suspend:
      return clocks_->suspend(to_ns(30.0));
    case SoakAction::pause_plant:
      return plant_.process->stop();
    case SoakAction::refuse_writes:
    case SoakAction::ignore_writes:
    case SoakAction::stick_valves:
      make_pressure();
      terminal_.writes = fault.action == SoakAction::refuse_writes   ? Writes::refused
                         : fault.action == SoakAction::ignore_writes ? Writes::ignored
                                                                     : Writes::stuck;
      return;
    case SoakAction::lose_timeout:
      return terminal_.lose_timeout();
    case SoakAction::suspend_valves:
      return valves_clocks_->suspend(to_ns(30.0));
    case SoakAction::pause_valves:
      valves_.process->stop();
      arm_.wait_for([&] { return arm_.left_active(); }, kPatience_s);
      arm_.wait_for([&] { return terminal_vented(); }, kPatience_s);
      return valves_.process->signal(SIGCONT);
    case SoakAction::kill_valves:
      make_pressure();
      valves_.process->signal(SIGKILL);
      valves_.process->wait(5s);
      return;
    case SoakAction::restart_plant:
      plant_.process->signal(SIGKILL);
      plant_.process->wait(5s);
      return;
    case SoakAction::end_daemon:
      return end(daemon_);
    case SoakAction::kill_daemon:
      daemon_.process->signal(SIGKILL);
      daemon_.process->wait(5s);
      return;
    case SoakAction::kill_stopped:
      insist_on_stop();
      arm_.wait_for([] { return false; }, 1.0);  // it is written soon after the status has shown it
      daemon_.process->signal(SIGKILL);
      daemon_.process->wait(5s);
      arm_.wait_for([] { return false; }, 0.1);  // its last messages
      arm_.forget();
      return start(daemon_);
  }
}

}  // namespace softarm
