// softarm arm, softarm disarm: what a person asks of a running daemon.
#include <fmt/format.h>

#include <chrono>
#include <memory>
#include <softarm_messages/controller_status_t.hpp>
#include <softarm_messages/operator_command_t.hpp>

#include "program.hpp"
#include "softarm/commands.hpp"
#include "softarm/config/load.hpp"
#include "softarm/daemon/realtime.hpp"
#include "softarm/daemon/safety_monitor.hpp"
#include "softarm/transport/lcm_node.hpp"
#include "softarm/transport/message_decoding.hpp"

namespace softarm {
namespace {

constexpr std::int64_t kPatience_ns = 2'000'000'000;
constexpr std::int16_t kArmedFlag = 1 << 5;

/// Asks until the daemon's status shows it was understood.
int request(const std::string& config, std::int8_t what) {
  const Experiment experiment = load_experiment(config);
  const LcmSettings& lcm = experiment.daemon.lcm;
  const bool wanted = what == softarm_messages::operator_command_t::ARM;
  LcmNode node(lcm.url);
  softarm_messages::controller_status_t status{};
  bool heard = false;
  node.subscribe(lcm.status_channel, 8,
                 [&](const ReceivedMessage& packet) { heard |= decode(packet.bytes, status); });

  const std::int64_t start_ns = monotonic_now_ns();
  for (std::int64_t now_ns = start_ns; now_ns - start_ns < kPatience_ns;
       now_ns = monotonic_now_ns()) {
    // The date as sequence number: it counts up from one call to the next, also after a restart of
    // this machine and from one machine to another, where the monotonic clock would not.
    const std::int64_t date_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(
                                     std::chrono::system_clock::now().time_since_epoch())
                                     .count();
    node.publish(lcm.operator_channel,
                 softarm_messages::operator_command_t{.sequence = date_ns, .request = what});
    const std::int64_t pause_end_ns = now_ns + 50'000'000;
    while (monotonic_now_ns() < pause_end_ns) node.wait_until(pause_end_ns);
    if (heard && ((status.flags & kArmedFlag) != 0) == wanted) {
      fmt::print("{}: {} ({})\n", wanted ? "armed" : "disarmed",
                 name(static_cast<Mode>(status.mode)), name(static_cast<Reason>(status.reason)));
      return kExitOk;
    }
  }
  print_error(
      "softarm",
      heard ? fmt::format("softarmd did not {}; its mode is {} ({})", wanted ? "arm" : "disarm",
                          name(static_cast<Mode>(status.mode)),
                          name(static_cast<Reason>(status.reason)))
            : fmt::format("no status on {}: is softarmd {} running?", lcm.status_channel, config));
  return kExitFailure;
}

void add_request(CLI::App& app, const char* name, const char* help, std::int8_t what) {
  auto config = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand(name, help);
  command->add_option("CONFIG", *config, "experiment in YAML")->required();
  command->callback([config, what] {
    if (const int code = request(*config, what); code != kExitOk) throw CLI::RuntimeError(code);
  });
}

}  // namespace

void add_operator_commands(CLI::App& app) {
  add_request(app, "arm", "Allow a running daemon to pressurise the arm",
              softarm_messages::operator_command_t::ARM);
  add_request(app, "disarm", "Make a running daemon vent the arm and keep it vented",
              softarm_messages::operator_command_t::DISARM);
}

}  // namespace softarm
