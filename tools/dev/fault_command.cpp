// softarm-dev fault: makes the faults that the daemon must survive, by hand.
#include <fmt/format.h>
#include <signal.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <limits>
#include <memory>
#include <random>

#include "apps/program.hpp"
#include "apps/signals.hpp"
#include "dev/commands.hpp"
#include "dev/fault/fault_relay.hpp"
#include "dev/fault/hostile_packets.hpp"
#include "dev/fault/raw_packets.hpp"
#include "softarm/base/clock.hpp"
#include "softarm/base/time.hpp"
#include "softarm/config/load.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {
namespace {

struct FaultOptions {
  std::string config, fault;
  std::string suffix = kSensorSuffix;
  double amount = 0.0, after_s = 2.0, for_s = 2.0;
  int body = 1, pid = 0;
  long packets = 0;
  bool has_amount = false, list = false;
};

/// Faults that are no change of a message.
struct OtherFault {
  const char *name, *what, *reaction;
};
constexpr OtherFault kOthers[] = {
    {"none", "everything goes through", "ACTIVE"},
    {"hostile", "bytes that are no message, on every channel of the daemon",
     "refused, counted, reported once a second; ACTIVE"},
    {"fragment", "second fragments that lie about their place, of frames and commands",
     "LCM 1.3.1 ends who subscribes; the arm vents; restarted: WAIT_FRAMES"},
    {"flood", "frames that repeat, as fast as they can be sent",
     "bounded work a tick; where real frames are lost HOLD or VENT, then ACTIVE"},
    {"pause", "SIGSTOP for --for seconds, then SIGCONT, to process --pid",
     "beyond vent_after_s: VENT (time_gap); shorter: missed ticks"},
};

void print_list() {
  fmt::print("{:<11} {:<68} {:<46} {}\n", "FAULT", "what happens", "--amount", "reaction");
  for (const FaultDescription& each : fault_list()) {
    const std::string amount =
        each.amount[0] == '\0' ? "" : fmt::format("{} [{:g}]", each.amount, each.usual);
    fmt::print("{:<11} {:<68} {:<46} {}\n", each.name, each.what, amount, each.reaction);
  }
  for (const OtherFault& each : kOthers)
    fmt::print("{:<11} {:<68} {:<46} {}\n", each.name, each.what, "", each.reaction);
}

void wait_s(double time_s) {
  const std::int64_t end_ns = monotonic_now_ns() + to_ns(time_s);
  while (stop_requested == 0 && monotonic_now_ns() < end_ns)
    sleep_until_ns(std::min(end_ns, monotonic_now_ns() + 50'000'000));
}

/// Sends packets for a while: one after the other with a pause, or, without one, as fast as it
/// goes.
void send_packets(const std::string& url, const std::vector<Packet>& packets, double for_s,
                  std::int64_t pause_ns) {
  RawSender sender(url);
  const std::int64_t end_ns = monotonic_now_ns() + to_ns(for_s);
  std::int64_t sent = 0;
  while (stop_requested == 0 && monotonic_now_ns() < end_ns) {
    sent += sender.send(packets[static_cast<std::size_t>(sent) % packets.size()]) ? 1 : 0;
    if (pause_ns > 0) sleep_until_ns(monotonic_now_ns() + pause_ns);
  }
  say(fmt::format("softarm-dev fault: {} packets sent\n", sent));
}

/// Sends malformed packets, four a millisecond: real messages find their place between them.
void send_malformed(const Experiment& experiment, long packets) {
  HostilePackets hostile(experiment.transport.lcm, experiment.arm.size(),
                         chamber_count(experiment.actuation), std::random_device{}());
  RawSender sender(experiment.transport.lcm.url);
  const std::int64_t start_ns = monotonic_now_ns();
  std::int64_t reported_ns = start_ns;
  long sent = 0;
  while (stop_requested == 0 && sent < packets) {
    for (int k = 0; k < 4 && sent < packets; ++k) sent += sender.send(hostile.next()) ? 1 : 0;
    const std::int64_t now_ns = monotonic_now_ns();
    if (now_ns - reported_ns > 2'000'000'000) {
      say(fmt::format("softarm-dev fault: {} of {} packets sent\n", sent, packets));
      reported_ns = now_ns;
    }
    sleep_until_ns(now_ns + 1'000'000);
  }
  say(fmt::format("softarm-dev fault: {} packets sent in {:.1f} s\n", sent,
                  to_seconds(monotonic_now_ns() - start_ns)));
}

int pause_process(const FaultOptions& options) {
  const auto send = [&](int number) {
    if (kill(options.pid, number) == 0) return true;
    print_error("softarm-dev fault",
                fmt::format("process {}: {}", options.pid, std::strerror(errno)));
    return false;
  };
  if (!send(SIGSTOP)) return kExitFailure;
  wait_s(options.for_s);
  return send(SIGCONT) ? kExitOk : kExitFailure;
}

Packet flooding_frame(const LcmSettings& lcm) {
  softarm_messages::mocap_frame_t frame{};
  Packet bytes(static_cast<std::size_t>(frame.getEncodedSize()));
  frame.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return lcm_packet(lcm.mocap_channel, bytes);
}

int make(const FaultOptions& options) {
  const Experiment experiment = load_experiment(options.config);
  const LcmSettings& lcm = experiment.transport.lcm;
  catch_stop_signals();
  if (options.fault == "pause") return pause_process(options);
  if (options.fault == "hostile" && options.packets > 0) {
    send_malformed(experiment, options.packets);
    return kExitOk;
  }
  if (options.fault == "fragment") {
    RawSender sender(lcm.url);
    for (const std::string& channel : {lcm.command_channel, lcm.mocap_channel})
      for (const Packet& packet : fragments_that_end_subscribers(channel)) sender.send(packet);
    return kExitOk;
  }
  if (options.fault == "hostile") {
    send_packets(lcm.url, hostile_packets(lcm), options.for_s, 1'000'000);
    return kExitOk;
  }
  if (options.fault == "flood") {
    send_packets(lcm.url, {flooding_frame(lcm)}, options.for_s, 0);
    return kExitOk;
  }
  if (experiment.transport.mocap.source != softarm_mocap())
    throw ConfigError(options.config, 0, "daemon.mocap.source",
                      "softarm, the only frames that this program can corrupt", "another source");
  Fault fault = options.fault == "none" ? Fault{} : *find_fault(options.fault);
  fault.body = options.body;
  if (options.has_amount) fault.amount = options.amount;

  FaultRelay relay(lcm, options.suffix);
  say(fmt::format("softarm-dev fault: {}{} -> {}; {} in {:g} s for {:g} s\n", lcm.mocap_channel,
                  options.suffix, lcm.mocap_channel, options.fault, options.after_s,
                  options.for_s));
  wait_s(options.after_s);
  if (relay.frames_received() == 0)
    say(
        fmt::format("softarm-dev fault: warning: no frames on {0}{1}; start softarm-plant {2} "
                    "--sensor-suffix {1}\n",
                    lcm.mocap_channel, options.suffix, options.config));
  relay.set(fault);
  say(fmt::format("softarm-dev fault: {} begins\n", options.fault));
  wait_s(options.for_s);
  relay.set({});
  say("softarm-dev fault: it ends; everything goes through until Ctrl-C\n");
  while (stop_requested == 0) wait_s(1.0);
  return kExitOk;
}

/// Accepts the name of a fault.
CLI::Validator known_fault() {
  return {
      [](std::string& name) -> std::string {
        const bool other = std::any_of(std::begin(kOthers), std::end(kOthers),
                                       [&](const OtherFault& each) { return each.name == name; });
        return other || find_fault(name) ? std::string()
                                         : fmt::format("unknown fault {}; --list names them", name);
      },
      "FAULT"};
}

int run(const FaultOptions& options) {
  if (options.list) {
    print_list();
    return kExitOk;
  }
  if (options.config.empty() || options.fault.empty())
    return fail("softarm-dev fault", kExitUsage,
                "CONFIG and FAULT are required; see --help and --list");
  if (options.fault == "pause" && options.pid <= 1)
    return fail("softarm-dev fault", kExitUsage, "pause needs --pid PID: pidof softarmd prints it");
  return make(options);
}

}  // namespace

void add_fault_command(CLI::App& app) {
  auto options = std::make_shared<FaultOptions>();
  CLI::App* command = app.add_subcommand(
      "fault",
      "Makes the faults a daemon must survive. Those of frames and pressures happen on the way: "
      "start softarm-plant CONFIG --sensor-suffix _CLEAN, softarmd CONFIG and this");
  command->add_flag("--list", options->list, "print the faults with what should happen, and end");
  command->add_option("CONFIG", options->config, "experiment in YAML");
  command->add_option("FAULT", options->fault, "which one")->check(known_fault());
  auto* amount = command->add_option("--amount", options->amount, "how much; --list gives the unit")
                     ->check(CLI::Number);
  command
      ->add_option("--body", options->body, "which body, or chamber, in the order of the message")
      ->check(CLI::Range(0, 10'000));
  command->add_option("--after", options->after_s, "seconds until the fault begins")
      ->check(number_between(0.0, 1e8));
  command->add_option("--for", options->for_s, "seconds until it ends")->check(positive_seconds());
  command->add_option("--sensor-suffix", options->suffix, "of the channels the sensors publish on");
  command
      ->add_option("--packets", options->packets,
                   "of hostile: so many that are malformed at random, instead of some for --for s")
      ->check(CLI::Range(1L, 1'000'000'000L));
  command->add_option("--pid", options->pid, "of the process to pause")
      ->check(CLI::Range(1, std::numeric_limits<int>::max()));
  run_where_given(*command, [options, amount] {
    options->has_amount = amount->count() > 0;
    return run(*options);
  });
}

}  // namespace softarm
