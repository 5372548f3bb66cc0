// softarm arm, disarm, estop, deadman: what a person asks of a running daemon.
#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <functional>
#include <memory>
#include <softarm_messages/controller_status_t.hpp>
#include <softarm_messages/deadman_t.hpp>
#include <softarm_messages/operator_command_t.hpp>

#include "program.hpp"
#include "signals.hpp"
#include "softarm/commands.hpp"
#include "softarm/config/config_error.hpp"
#include "softarm/config/load.hpp"
#include "softarm/daemon/realtime.hpp"
#include "softarm/daemon/safety_monitor.hpp"
#include "softarm/transport/lcm_node.hpp"
#include "softarm/transport/message_decoding.hpp"

namespace softarm {
namespace {

using softarm_messages::controller_status_t;
using Request = softarm_messages::operator_command_t;

constexpr std::int64_t kPatience_ns = 2'000'000'000;
constexpr std::int16_t kArmedFlag = 1 << 5;

bool armed(const controller_status_t& status) { return (status.flags & kArmedFlag) != 0; }
bool faulty(const controller_status_t& status) {
  return static_cast<Mode>(status.mode) == Mode::fault;
}

/// One request, as a person gives it and as the daemon's status shows it was understood.
struct Kind {
  std::int8_t request;
  const char* command;
  const char* help;
  const char* done;
  bool (*understood)(const controller_status_t&);
};

constexpr Kind kKinds[] = {
    {Request::ARM, "arm", "Allow a running daemon to pressurise the arm", "armed", armed},
    {Request::DISARM, "disarm",
     "Make a running daemon vent the arm and keep it vented; acknowledges a FAULT", "disarmed",
     [](const controller_status_t& status) { return !armed(status) && !faulty(status); }},
    {Request::EMERGENCY_STOP, "estop",
     "Emergency stop: a running daemon vents and goes to FAULT, until disarm and then arm",
     "stopped",
     [](const controller_status_t& status) {
       return faulty(status) && static_cast<Reason>(status.reason) == Reason::emergency_stop;
     }},
};

/// The date: it counts up from one call to the next, also after a restart of this machine and from
/// one machine to another, where the monotonic clock would not.
std::int64_t date_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

std::string state_text(const controller_status_t& status) {
  return fmt::format("{} ({})", name(static_cast<Mode>(status.mode)),
                     name(static_cast<Reason>(status.reason)));
}

/// Asks until the daemon's status shows it was understood.
int request(const std::string& config, const Kind& kind) {
  const Experiment experiment = load_experiment(config);
  const LcmSettings& lcm = experiment.daemon.lcm;
  LcmNode node(lcm.url);
  controller_status_t status{};
  bool heard = false;
  node.subscribe(lcm.status_channel, 8,
                 [&](const ReceivedMessage& packet) { heard |= decode(packet.bytes, status); });

  const std::int64_t start_ns = monotonic_now_ns();
  for (std::int64_t now_ns = start_ns; now_ns - start_ns < kPatience_ns;
       now_ns = monotonic_now_ns()) {
    node.publish(lcm.operator_channel, Request{.sequence = date_ns(), .request = kind.request});
    const std::int64_t pause_end_ns = now_ns + 50'000'000;
    while (monotonic_now_ns() < pause_end_ns) node.wait_until(pause_end_ns);
    if (heard && kind.understood(status)) {
      fmt::print("{}: {}\n", kind.done, state_text(status));
      return kExitOk;
    }
  }
  const char* cure = kind.request == Request::ARM && faulty(status) ? "; disarm first" : "";
  print_error("softarm", heard ? fmt::format("softarmd did not {}; its mode is {}{}", kind.command,
                                             state_text(status), cure)
                               : fmt::format("no status on {}: is softarmd {} running?",
                                             lcm.status_channel, config));
  return kExitFailure;
}

/// Says "go" ten times in every time-out until it is interrupted, then that it let go.
int hold_deadman(const std::string& config) {
  const Experiment experiment = load_experiment(config);
  const LcmSettings& lcm = experiment.daemon.lcm;
  if (lcm.deadman_channel.empty()) {
    print_error("softarm", fmt::format("{} has no dead-man input: name its channel in "
                                       "daemon.lcm.deadman_channel",
                                       config));
    return kExitConfiguration;
  }
  catch_stop_signals();
  LcmNode node(lcm.url);
  const auto period_ns =
      static_cast<std::int64_t>(1e8 * experiment.daemon.safety.deadman_timeout_s);
  fmt::print("saying go on {} every {:.3g} s until Ctrl-C\n", lcm.deadman_channel,
             1e-9 * static_cast<double>(period_ns));
  std::fflush(stdout);
  for (std::int64_t next_ns = monotonic_now_ns(); stop_requested == 0; next_ns += period_ns) {
    node.publish(lcm.deadman_channel, softarm_messages::deadman_t{.sequence = date_ns(), .go = 1});
    sleep_until_ns(next_ns + period_ns);
  }
  node.publish(lcm.deadman_channel, softarm_messages::deadman_t{.sequence = date_ns(), .go = 0});
  return kExitOk;
}

void add(CLI::App& app, const char* name, const char* help,
         const std::function<int(const std::string&)>& body) {
  auto config = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand(name, help);
  command->add_option("CONFIG", *config, "experiment in YAML")->required();
  command->callback([config, body] {
    if (const int code = body(*config); code != kExitOk) throw CLI::RuntimeError(code);
  });
}

}  // namespace

void add_operator_commands(CLI::App& app) {
  for (const Kind& kind : kKinds)
    add(app, kind.command, kind.help,
        [&kind](const std::string& config) { return request(config, kind); });
  add(app, "deadman", "Say go on the dead-man channel until interrupted", hold_deadman);
}

}  // namespace softarm
