// softarm arm, disarm, estop, deadman: what a person asks of a running daemon.
#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <softarm_messages/controller_status_t.hpp>
#include <softarm_messages/deadman_t.hpp>
#include <softarm_messages/operator_command_t.hpp>
#include <utility>

#include "apps/program.hpp"
#include "apps/signals.hpp"
#include "apps/softarm/commands.hpp"
#include "softarm/base/clock.hpp"
#include "softarm/base/time.hpp"
#include "softarm/config/config_error.hpp"
#include "softarm/config/load.hpp"
#include "softarm/runtime/safety_monitor.hpp"
#include "softarm/transport/lcm_node.hpp"
#include "softarm/transport/message_decoding.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {
namespace {

using softarm_messages::controller_status_t;
using Request = softarm_messages::operator_command_t;

constexpr std::int64_t kPatience_ns = 2'000'000'000;
constexpr const char* kUnsent =
    "the message could not be sent: see tools/with_loopback_network --check";

bool shadow(const controller_status_t& status) {
  return (status.flags & controller_status_t::SHADOW) != 0;
}
bool armed(const controller_status_t& status) {
  return (status.flags & controller_status_t::ARMED) != 0;
}
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
std::int64_t next_sequence() { return wall_now_ns(); }

std::string state_text(const controller_status_t& status) {
  return fmt::format("{} ({})", name(static_cast<Mode>(status.mode)),
                     name(static_cast<Reason>(status.reason)));
}

/// What stands behind "KEY:" in a line of YAML, or nothing.
std::string value_of(const std::string& key, const std::string& line) {
  const std::size_t at = line.find(key + ":");
  if (at == std::string::npos || (at > 0 && std::strchr(" {,", line[at - 1]) == nullptr)) return "";
  const std::size_t begin = line.find_first_not_of(" \"'", at + key.size() + 1);
  if (begin == std::string::npos) return "";
  return line.substr(begin, line.find_first_of(" \"',}", begin) - begin);
}

/// What can be read of daemon.lcm in a configuration that is wrong somewhere, or no YAML at all;
/// the rest by default. These keys stand nowhere else.
void read_network(const std::filesystem::path& file, LcmSettings& lcm, int includes_left = 8) {
  const std::pair<const char*, std::string*> keys[] = {{"url", &lcm.url},
                                                       {"operator_channel", &lcm.operator_channel},
                                                       {"status_channel", &lcm.status_channel}};
  std::ifstream text(file);
  for (std::string line; std::getline(text, line);) {
    line = line.substr(0, line.find('#'));
    if (const std::string other = value_of("include", line); !other.empty() && includes_left > 0)
      read_network(file.parent_path() / other, lcm, includes_left - 1);
    for (const auto& [key, setting] : keys)
      if (const std::string value = value_of(key, line); !value.empty()) *setting = value;
  }
}

/// Whoever wants the arm vented must not be kept from it by a typo in a file.
LcmSettings network_of(const std::string& config, const Kind& kind) {
  try {
    return load_experiment(config).transport.lcm;
  } catch (const std::exception& error) {
    if (kind.request == Request::ARM || !std::filesystem::is_regular_file(config)) throw;
    print_error("softarm", error.what());
    LcmSettings lcm;
    read_network(config, lcm);
    say(fmt::format("softarm: {} all the same, on {} of {}, if that is your daemon's network\n",
                    kind.command, lcm.operator_channel, lcm.url));
    return lcm;
  }
}

/// Asks until the daemon's status shows it was understood.
int request(const std::string& config, const Kind& kind) {
  const LcmSettings lcm = network_of(config, kind);
  LcmNode node(lcm.url);
  controller_status_t status{};
  bool heard = false, sent = false;
  node.subscribe(lcm.status_channel, 8, [&](const ReceivedMessage& packet) {
    controller_status_t newest;
    if (!decode(packet.bytes, newest) || shadow(newest)) return;
    status = newest;
    heard = true;
  });

  const std::int64_t start_ns = monotonic_now_ns();
  for (std::int64_t now_ns = start_ns; now_ns - start_ns < kPatience_ns;
       now_ns = monotonic_now_ns()) {
    sent |= node.publish(lcm.operator_channel,
                         Request{.sequence = next_sequence(), .request = kind.request});
    const std::int64_t pause_end_ns = now_ns + 50'000'000;
    while (monotonic_now_ns() < pause_end_ns) node.wait_until(pause_end_ns);
    if (heard && kind.understood(status)) {
      const bool waits =
          kind.request == Request::ARM && static_cast<Mode>(status.mode) != Mode::active;
      fmt::print("{}: {}{}\n", kind.done, state_text(status),
                 waits ? "; the arm moves once every segment has been seen for a while" : "");
      return kExitOk;
    }
  }
  if (!sent) throw TransportError(kUnsent);
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
  const LcmSettings& lcm = experiment.transport.lcm;
  if (lcm.deadman_channel.empty()) {
    print_error("softarm", fmt::format("{} has no dead-man input: name its channel in "
                                       "daemon.lcm.deadman_channel",
                                       config));
    return kExitConfiguration;
  }
  catch_stop_signals();
  LcmNode node(lcm.url);
  const auto period_ns = static_cast<std::int64_t>(1e8 * experiment.safety.deadman_timeout_s);
  fmt::print("saying go on {} every {:.3g} s until Ctrl-C\n", lcm.deadman_channel,
             to_seconds(period_ns));
  std::fflush(stdout);
  while (stop_requested == 0) {
    if (!node.publish(lcm.deadman_channel,
                      softarm_messages::deadman_t{.sequence = next_sequence(), .go = 1}))
      throw TransportError(kUnsent);
    sleep_until_ns(monotonic_now_ns() + period_ns);  // after a stop of ours nothing is made up for
  }
  node.publish(lcm.deadman_channel,
               softarm_messages::deadman_t{.sequence = next_sequence(), .go = 0});
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
