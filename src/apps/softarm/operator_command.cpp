// softarm arm, disarm, estop, deadman: requests of an operator to a running daemon.
#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>

#include "apps/program.hpp"
#include "apps/signals.hpp"
#include "apps/softarm/commands.hpp"
#include "softarm/client/operator_client.hpp"
#include "softarm/config/load.hpp"
#include "softarm/config/network_search.hpp"

namespace softarm {
namespace {

/// One request of an operator.
struct Kind {
  OperatorRequest request;
  const char* command;
  const char* help;
  const char* done;
};

constexpr Kind kKinds[] = {
    {OperatorRequest::arm, "arm", "Allow a running daemon to pressurise the arm", "armed"},
    {OperatorRequest::disarm, "disarm",
     "Make a running daemon vent the arm and keep it vented; acknowledges a FAULT", "disarmed"},
    {OperatorRequest::emergency_stop, "estop",
     "Emergency stop: a running daemon vents and goes to FAULT, until disarm and then arm",
     "stopped"},
};

/// A typing error in a file must not prevent a request that vents the arm.
LcmSettings network_of(const std::string& config, const Kind& kind) {
  try {
    return load_experiment(config).transport.lcm;
  } catch (const std::exception& error) {
    if (kind.request == OperatorRequest::arm || !std::filesystem::is_regular_file(config)) throw;
    print_error("softarm", error.what());
    const LcmSettings lcm = find_network(config);
    say(fmt::format("softarm: {} anyway, on {} of {}, if that is your daemon's network\n",
                    kind.command, lcm.operator_channel, lcm.url));
    return lcm;
  }
}

int request(const std::string& config, const Kind& kind) {
  const LcmSettings lcm = network_of(config, kind);
  OperatorClient client(lcm);
  const RequestOutcome outcome = client.request(kind.request);
  const bool arming = kind.request == OperatorRequest::arm;
  if (outcome == RequestOutcome::done) {
    const bool waits = arming && client.status()->mode != Mode::active;
    fmt::print("{}: {}{}\n", kind.done, client.daemon_text(),
               waits ? "; the arm moves once every segment has been seen for a while" : "");
    return kExitOk;
  }
  if (outcome == RequestOutcome::unheard) {
    print_error("softarm", fmt::format("no status on {}: is softarmd {} running?",
                                       lcm.status_channel, config));
    return kExitFailure;
  }
  const bool faulty = client.status()->mode == Mode::fault;
  print_error("softarm",
              fmt::format("softarmd did not {}; its mode is {}{}", kind.command,
                          client.daemon_text(), arming && faulty ? "; disarm first" : ""));
  return kExitFailure;
}

/// Sends "go" ten times in every time-out until it is interrupted, then withdraws it.
int hold_deadman(const std::string& config) {
  const Experiment experiment = load_experiment(config);
  const std::string& channel = experiment.transport.lcm.deadman_channel;
  if (channel.empty()) {
    print_error("softarm", fmt::format("{} has no dead-man input: name its channel in "
                                       "daemon.lcm.deadman_channel",
                                       config));
    return kExitConfiguration;
  }
  catch_stop_signals();
  OperatorClient client(experiment.transport.lcm);
  const double period_s = 0.1 * experiment.safety.deadman_timeout_s;
  fmt::print("sending go on {} every {:.3g} s until Ctrl-C\n", channel, period_s);
  std::fflush(stdout);
  do {
    client.send_go(true);
  } while (!client.wait_for([] { return stop_requested != 0; }, period_s));
  client.send_go(false);
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
  add(app, "deadman", "Send go on the dead-man channel until interrupted", hold_deadman);
}

}  // namespace softarm
