// softarm arm, disarm, estop, deadman: requests of an operator to a running daemon.
#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <future>
#include <memory>
#include <thread>
#include <tuple>
#include <utility>

#include "apps/program.hpp"
#include "apps/signals.hpp"
#include "apps/softarm/commands.hpp"
#include "softarm/base/time.hpp"
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
  const bool arming = kind.request == OperatorRequest::arm;
  if (!arming && std::filesystem::is_regular_file(config))  // before anything that may be slow
    OperatorClient(find_network(config)).send(kind.request);
  const LcmSettings lcm = network_of(config, kind);
  OperatorClient client(lcm);
  const RequestOutcome outcome = client.request(kind.request);
  if (outcome == RequestOutcome::done) {
    const bool waits = arming && client.status()->mode != Mode::active;
    fmt::print("{}: {}{}\n", kind.done, client.daemon_text(),
               waits ? "; the arm moves once every segment has been seen for a while" : "");
    return kExitOk;
  }
  if (outcome == RequestOutcome::unheard)
    return fail(
        "softarm", kExitFailure,
        fmt::format("no status on {}: is softarmd {} running?", lcm.status_channel, config));
  const bool faulty = client.status()->mode == Mode::fault;
  return fail("softarm", kExitFailure,
              fmt::format("softarmd did not {}; its mode is {}{}", kind.command,
                          client.daemon_text(), arming && faulty ? "; disarm first" : ""));
}

/// Loads in a thread that may take as long as it likes, for a file that may be slow or hostile.
std::future<LcmSettings> network_in_background(const std::string& config, const Kind& kind) {
  std::packaged_task<LcmSettings()> load([config, &kind] { return network_of(config, kind); });
  std::future<LcmSettings> network = load.get_future();
  std::thread(std::move(load)).detach();
  return network;
}

/// Repeats the emergency stop until a status shows it, or Ctrl-C: the daemon may be held up, or its
/// network flooded. It is sent before the file has been read properly.
int emergency_stop(const std::string& config, const Kind& kind) {
  using namespace std::chrono_literals;
  constexpr double kLook_s = 0.25;
  if (!std::filesystem::is_regular_file(config)) network_of(config, kind);  // throws what it is
  catch_stop_signals();
  LcmSettings lcm = find_network(config);
  auto client = std::make_unique<OperatorClient>(lcm);
  client->send(kind.request);
  std::future<LcmSettings> loading = network_in_background(config, kind);
  bool done = false;
  std::string reported;
  while (true) {
    done = client->request(kind.request, kLook_s) == RequestOutcome::done;
    if (loading.valid() && loading.wait_for(done ? 1s : 0s) == std::future_status::ready) {
      const LcmSettings loaded = loading.get();
      if (std::tie(loaded.url, loaded.operator_channel, loaded.status_channel) !=
          std::tie(lcm.url, lcm.operator_channel, lcm.status_channel)) {
        lcm = loaded;
        client = std::make_unique<OperatorClient>(lcm);
        continue;
      }
    }
    if (done || stop_requested != 0) break;
    const std::string waiting = fmt::format(
        "softarm: emergency stop sent on {} of {}; waiting for FAULT on {}, whose mode "
        "is {}; Ctrl-C ends this\n",
        lcm.operator_channel, lcm.url, lcm.status_channel, client->daemon_text());
    if (waiting != reported) say(reported = waiting);
  }
  if (done) {
    fmt::print("{}: {}\n", kind.done, client->daemon_text());
  } else {
    print_error("softarm", "ended before the daemon's status showed the emergency stop");
  }
  const int code = done ? kExitOk : kExitFailure;
  if (!loading.valid()) return code;
  std::fflush(stdout);
  std::_Exit(code);  // the file is still being read
}

/// Sends "go" ten times in every time-out until it is interrupted, then withdraws it.
int hold_deadman(const std::string& config) {
  const Experiment experiment = load_experiment(config);
  const std::string& channel = experiment.transport.lcm.deadman_channel;
  if (channel.empty())
    return fail("softarm", kExitConfiguration,
                fmt::format("{} has no dead-man input: name its channel in "
                            "daemon.lcm.deadman_channel",
                            config));
  catch_stop_signals();
  OperatorClient client(experiment.transport.lcm);
  const double period_s = 0.1 * experiment.safety.deadman_timeout_s;
  fmt::print("sending go on {} every {:.3g} s until Ctrl-C\n", channel, period_s);
  std::fflush(stdout);
  while (stop_requested == 0) {
    client.send_go(true);
    // All statuses that have come are handled: a go must echo a recent one.
    const std::int64_t next_ns = client.now_ns() + to_ns(period_s);
    while (stop_requested == 0 && client.now_ns() < next_ns) client.update(next_ns);
  }
  client.send_go(false);
  return kExitOk;
}

void add(CLI::App& app, const char* name, const char* help,
         const std::function<int(const std::string&)>& body) {
  auto config = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand(name, help);
  command->add_option("CONFIG", *config, "experiment in YAML")->required();
  run_where_given(*command, [config, body] { return body(*config); });
}

}  // namespace

void add_operator_commands(CLI::App& app) {
  for (const Kind& kind : kKinds)
    add(app, kind.command, kind.help, [&kind](const std::string& config) {
      return kind.request == OperatorRequest::emergency_stop ? emergency_stop(config, kind)
                                                             : request(config, kind);
    });
  add(app, "deadman", "Send go on the dead-man channel until interrupted", hold_deadman);
}

}  // namespace softarm
