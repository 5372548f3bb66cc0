// softarm-valves: pressure commands from LCM to a valve terminal on Modbus TCP, measured pressures
// back.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "apps/program.hpp"
#include "apps/signals.hpp"
#include "softarm/actuation/pressure_allocator.hpp"
#include "softarm/base/clock.hpp"
#include "softarm/base/instance_lock.hpp"
#include "softarm/base/line_log.hpp"
#include "softarm/base/realtime.hpp"
#include "softarm/base/service_notifier.hpp"
#include "softarm/base/time.hpp"
#include "softarm/base/version.hpp"
#include "softarm/config/load.hpp"
#include "softarm/runtime/settings.hpp"
#include "softarm/transport/lcm_node.hpp"
#include "softarm/transport/message_decoding.hpp"
#include "softarm/transport/settings.hpp"
#include "softarm/valves/modbus_terminal.hpp"
#include "softarm/valves/register_map.hpp"
#include "softarm/valves/valve_guard.hpp"

namespace softarm {
namespace {

int chambers_of(const Experiment& experiment) {
  return static_cast<int>(experiment.valves.order.size());
}

ValveGuardSettings guard_settings(const Experiment& experiment) {
  return {.driver = experiment.valves,
          .chambers = chambers_of(experiment),
          .max_pressure_bar = experiment.actuation.max_pressure_bar,
          .rise_bar_per_s = experiment.actuation.vent_bar_per_s,
          .longest_validity_s = experiment.safety.command_validity_s,
          .wait_for_zero = experiment.safety.arming == Arming::explicit_};
}

/// The words that go over the wire, and the requests they go with.
class TerminalLink {
 public:
  TerminalLink(const ValveDriverSettings& settings, double max_pressure_bar)
      : settings_(settings),
        max_pressure_bar_(max_pressure_bar),
        terminal_(settings),
        read_back_(static_cast<int>(settings.order.size())),
        out_(static_cast<std::size_t>(write_size(settings.registers, settings.order))),
        in_(static_cast<std::size_t>(read_size(settings.registers, settings.order))) {}

  ModbusTerminal& terminal() { return terminal_; }
  const ReadBack& read_back() const { return read_back_; }

  /// Sets the terminal's time-out and reads it back; the second tells whether they agree.
  std::pair<LinkResult, bool> secure() noexcept {
    std::array<std::uint16_t, 2> wanted{}, found{};
    put_timeout(settings_.registers, settings_.failsafe_timeout_s, wanted);
    const auto count = static_cast<std::size_t>(settings_.registers.timeout_words);
    const int address = settings_.registers.timeout_address;
    LinkResult result = terminal_.write(address, std::span(wanted).first(count));
    if (result == LinkResult::ok) result = terminal_.read(address, std::span(found).first(count));
    found_timeout_s_.reset();
    if (result == LinkResult::ok) found_timeout_s_ = timeout_s_of(settings_.registers, found);
    return {result, result == LinkResult::ok &&
                        std::equal(found.begin(), found.begin() + settings_.registers.timeout_words,
                                   wanted.begin())};
  }
  /// What `secure` read back; it could not where there is none.
  std::optional<double> found_timeout_s() const { return found_timeout_s_; }

  LinkResult write(const Eigen::VectorXd& set_points_bar) noexcept {
    put_set_points(settings_.registers, settings_.order, set_points_bar, max_pressure_bar_, out_);
    return terminal_.write(settings_.registers.write_address, out_);
  }

  /// One block write, one block read.
  LinkResult exchange(const Eigen::VectorXd& set_points_bar) noexcept {
    LinkResult result = write(set_points_bar);
    if (result == LinkResult::ok) result = terminal_.read(settings_.registers.read_address, in_);
    if (result == LinkResult::ok)
      take_read_back(settings_.registers, settings_.order, in_, read_back_);
    return result;
  }

 private:
  ValveDriverSettings settings_;
  double max_pressure_bar_;
  ModbusTerminal terminal_;
  ReadBack read_back_;
  std::vector<std::uint16_t> out_, in_;
  std::optional<double> found_timeout_s_;
};

class ValveLoop {
 public:
  ValveLoop(const Experiment& experiment, LineLog& log, ServiceNotifier& service)
      : lcm_(experiment.transport.lcm),
        settings_(experiment.valves),
        log_(log),
        service_(service),
        node_(lcm_.url),
        link_(experiment.valves, experiment.actuation.max_pressure_bar),
        guard_(guard_settings(experiment)),
        pressure_bar_(static_cast<std::size_t>(chambers_of(experiment))),
        zero_(Eigen::VectorXd::Zero(chambers_of(experiment))) {
    command_message_.pressure_bar.reserve(kMaxChambers);
    measurement_message_.num_chambers = static_cast<std::int16_t>(chambers_of(experiment));
    measurement_message_.pressure_bar.assign(pressure_bar_.size(), 0.0F);
    status_message_.num_chambers = measurement_message_.num_chambers;
    status_message_.set_point_bar = measurement_message_.pressure_bar;
    status_message_.actual_bar = measurement_message_.pressure_bar;
    node_.subscribe(lcm_.command_channel, kCommandCapacity,
                    [this](const ReceivedMessage& packet) { take(packet); });
  }

  /// Until a stop was requested and zero was confirmed, or cannot be; says which.
  bool run() {
    const std::int64_t start_ns = monotonic_now_ns();
    PeriodicDeadline deadline(to_ns(1.0 / settings_.rate_hz), start_ns);
    std::int64_t stop_ns = 0;
    while (true) {
      // Commands are taken as they come, so that their validity counts from their arrival.
      while (monotonic_now_ns() < deadline.next_ns()) node_.wait_until(deadline.next_ns());
      const std::int64_t now_ns = monotonic_now_ns();
      if (stop_requested != 0 && stop_ns == 0) {
        stop_ns = now_ns;
        guard_.stop();
      }
      cycle(now_ns);
      const std::int64_t missed = deadline.advance(monotonic_now_ns());
      late_cycles_ += missed;
      publish_status(now_ns);
      report(now_ns - start_ns);
      service_.report(now_ns, {.state = name(guard_.state()),
                               .reason = name(guard_.reason()),
                               .on_time = missed == 0,
                               .stopping = stop_ns != 0});
      if (stop_ns == 0) continue;
      const bool may_still =
          guard_.state() != ValveState::disconnected && now_ns - stop_ns < kMostStopping_ns;
      if ((cycles_since_stop_ > 0 && guard_.zero_confirmed()) || !may_still) {
        link_.terminal().close();
        return guard_.zero_confirmed();
      }
    }
  }

  void print_summary() const {
    const ValveCounters& counters = guard_.counters();
    say(fmt::format(
        "softarm-valves: {} cycles, {} missed; {} connections, {} lost, {} late answers, {} "
        "exception replies, {} doubts; {} commands refused\n",
        counters.cycles, late_cycles_, counters.connections, counters.broken, counters.no_answers,
        counters.exceptions, counters.doubts, refused_));
  }

 private:
  static constexpr int kCommandCapacity = 64;
  static constexpr std::int64_t kMostStopping_ns = 700'000'000;
  static constexpr std::int64_t kStatusPeriod_ns = 100'000'000;

  void take(const ReceivedMessage& packet) noexcept {
    if (discarding_) return;
    if (!decode(packet.bytes, command_message_)) {
      ++refused_;
      return;
    }
    const auto& pressures = command_message_.pressure_bar;
    const std::size_t count = std::min(pressures.size(), pressure_bar_.size());
    std::copy_n(pressures.begin(), count, pressure_bar_.begin());
    // A command for more chambers than ours must look wrong, not be cut to fit.
    const bool fits = pressures.size() == pressure_bar_.size();
    const CommandVerdict verdict = guard_.command(
        {.sequence = command_message_.sequence,
         .validity_ns = std::int64_t{command_message_.validity_us} * 1000,
         .shadow = command_message_.shadow != 0,
         .pressure_bar = std::span<const double>(pressure_bar_).first(fits ? count : 0)},
        monotonic_now_ns());
    refused_ += verdict == CommandVerdict::malformed;
  }

  void cycle(std::int64_t now_ns) noexcept {
    discarding_ = !guard_.wake(now_ns);
    node_.drain(kCommandCapacity);  // what a queue holds; a flood must not hold us
    discarding_ = false;
    switch (guard_.next(now_ns)) {
      case ValveAction::wait:
        break;
      case ValveAction::connect:
        guard_.connected(link_.terminal().connect(), monotonic_now_ns());
        break;
      case ValveAction::secure: {
        const auto [result, as_written] = link_.secure();
        guard_.secured(result, as_written, now_ns);
        break;
      }
      case ValveAction::exchange:
        // Held up since it was decided, it may come to a terminal that has vented by itself.
        guard_.wake(monotonic_now_ns());
        exchange(now_ns);
        break;
    }
    if (guard_.state() == ValveState::disconnected && link_.terminal().is_open()) {
      // Should it still listen, it vents at once, not by its time-out.
      if (guard_.reason() != ValveReason::no_connection) link_.write(zero_);
      link_.terminal().close();
    }
  }

  void exchange(std::int64_t now_ns) noexcept {
    const LinkResult result = link_.exchange(guard_.set_points_bar());
    const std::int64_t sequence = guard_.sequence();
    for (std::size_t i = 0; i < pressure_bar_.size(); ++i)
      status_message_.set_point_bar[i] =
          static_cast<float>(guard_.set_points_bar()[static_cast<Eigen::Index>(i)]);
    guard_.exchanged(result, link_.read_back(), now_ns);
    if (result != LinkResult::ok) return;
    if (stop_requested != 0) ++cycles_since_stop_;
    for (std::size_t i = 0; i < pressure_bar_.size(); ++i)
      measurement_message_.pressure_bar[i] =
          static_cast<float>(link_.read_back().actual_bar[static_cast<Eigen::Index>(i)]);
    measurement_message_.sequence = sequence;
    measurement_message_.time_us = now_ns / 1000;
    node_.publish(lcm_.measurement_channel, measurement_message_);
  }

  bool changed() const {
    return status_message_.state != static_cast<std::int8_t>(guard_.state()) ||
           status_message_.reason != static_cast<std::int8_t>(guard_.reason()) ||
           status_message_.chamber != guard_.chamber();
  }

  void publish_status(std::int64_t now_ns) noexcept {
    changed_ = changed();
    if (!changed_ && now_ns < next_status_ns_) return;
    next_status_ns_ = now_ns + kStatusPeriod_ns;
    const ValveCounters& counters = guard_.counters();
    auto& message = status_message_;
    message.time_us = now_ns / 1000;
    message.sequence = guard_.sequence();
    message.cycles = counters.cycles;
    message.state = static_cast<std::int8_t>(guard_.state());
    message.reason = static_cast<std::int8_t>(guard_.reason());
    message.chamber = static_cast<std::int16_t>(guard_.chamber());
    message.connections = static_cast<std::int32_t>(counters.connections);
    message.exceptions = static_cast<std::int32_t>(counters.exceptions);
    message.no_answers = static_cast<std::int32_t>(counters.no_answers);
    message.broken = static_cast<std::int32_t>(counters.broken);
    message.doubts = static_cast<std::int32_t>(counters.doubts);
    message.late_cycles = static_cast<std::int32_t>(late_cycles_);
    message.commands_refused = static_cast<std::int32_t>(refused_);
    message.actual_bar = measurement_message_.pressure_bar;
    node_.publish(lcm_.valves_channel, message);
  }

  void report(std::int64_t since_start_ns) noexcept {
    if (!changed_) return;
    const double t_s = to_seconds(since_start_ns);
    const ValveReason reason = guard_.reason();
    const char* opening = reason == ValveReason::none ? "" : " (";
    const char* closing = reason == ValveReason::none ? "" : ")";
    if (reason == ValveReason::failsafe_refused) {
      constexpr const char* kCure =
          "no pressure is written. Set valves.failsafe_timeout_s to what the terminal takes, or "
          "valves.registers.timeout_address";
      const double set_s = settings_.failsafe_timeout_s;
      const int address = settings_.registers.timeout_address;
      if (const auto found_s = link_.found_timeout_s()) {
        log_.add("{:.3f} s: {} ({}: set {} s at register {}, read back {} s); {}", t_s,
                 name(guard_.state()), name(reason), set_s, address, *found_s, kCure);
      } else {
        log_.add("{:.3f} s: {} ({}: {} s at register {}: {}); {}", t_s, name(guard_.state()),
                 name(reason), set_s, address, link_.terminal().error(), kCure);
      }
    } else if (guard_.chamber() >= 0) {
      const auto at = static_cast<std::size_t>(guard_.chamber());
      log_.add("{:.3f} s: {}{}{}{}: chamber {} (valve {}) set to {:.3f} bar reads {:.3f} bar", t_s,
               name(guard_.state()), opening, name(reason), closing, guard_.chamber(),
               settings_.order[at], status_message_.set_point_bar[at],
               measurement_message_.pressure_bar[at]);
    } else if (guard_.state() == ValveState::disconnected) {
      log_.add("{:.3f} s: {}{}{}{}: {}:{}: {}", t_s, name(guard_.state()), opening, name(reason),
               closing, settings_.host, settings_.port, link_.terminal().error());
    } else {
      log_.add("{:.3f} s: {}{}{}{}", t_s, name(guard_.state()), opening, name(reason), closing);
    }
  }

  LcmSettings lcm_;
  ValveDriverSettings settings_;
  LineLog& log_;
  ServiceNotifier& service_;
  LcmNode node_;
  TerminalLink link_;
  ValveGuard guard_;
  std::vector<double> pressure_bar_;
  Eigen::VectorXd zero_;
  bool discarding_ = false;
  bool changed_ = false;
  int cycles_since_stop_ = 0;
  std::int64_t late_cycles_ = 0;
  std::int64_t refused_ = 0;
  std::int64_t next_status_ns_ = 0;
  softarm_messages::pressure_command_t command_message_{};
  softarm_messages::pressure_measurement_t measurement_message_{};
  softarm_messages::valves_status_t status_message_{};
};

int serve(const std::string& path) {
  const Experiment experiment = load_experiment(path);
  if (experiment.actuation.kind == ActuationKind::torque)
    throw ConfigError(path, 0, "actuation.kind", "chambers: a terminal has valves, not moments",
                      "torque");
  const LcmSettings& lcm = experiment.transport.lcm;
  const ValveDriverSettings& valves = experiment.valves;
  const InstanceLock commands_lock(lock_name("valves of " + lcm.command_channel, lcm.url));
  const InstanceLock measurement_lock(lock_name(lcm.measurement_channel, lcm.url));
  const InstanceLock terminal_lock(
      fmt::format("terminal {}:{} unit {}", valves.host, valves.port, valves.unit_id));
  catch_stop_signals();
  ignore_broken_pipes();
  say(fmt::format(
      "softarm-valves {} commit {} configuration {}: {}, {} valves of {} at {}:{}, {} Hz\n",
      version_text(), commit_text(), hash_text(experiment.hash), experiment.name,
      valves.order.size(), kTerminalNames[static_cast<std::size_t>(valves.terminal)], valves.host,
      valves.port, valves.rate_hz));
  if (valves.host != "127.0.0.1")
    say("softarm-valves: warning: these registers were not tried on hardware; see "
        "docs/valves.md\n");
  ServiceNotifier service;
  if (!service.problem().empty())
    say(fmt::format("softarm-valves: warning: {}\n", service.problem()));
  LineLog log("softarm-valves",
              say);  // before the scheduling changes, which its thread would inherit
  RealtimeSettings realtime = experiment.realtime;
  realtime.cpu = -1;  // the tick's own
  realtime.priority = std::max(1, realtime.priority - 1);
  for (const std::string& refused : apply_realtime_settings(realtime))
    say(fmt::format("softarm-valves: warning: {}\n", refused));
  ValveLoop loop(experiment, log, service);
  const bool vented = loop.run();
  log.finish();
  loop.print_summary();
  if (vented) return kExitOk;
  print_error("softarm-valves",
              fmt::format("the terminal did not confirm set points of zero; it vents by its own "
                          "time-out of {} s",
                          valves.failsafe_timeout_s));
  return kExitFailure;
}

}  // namespace
}  // namespace softarm

int main(int argc, char** argv) {
  CLI::App app("Pressure commands to a valve terminal on Modbus TCP, measured pressures back",
               "softarm-valves");
  std::string config;
  app.add_option("CONFIG", config, "experiment in YAML")->required();
  return softarm::run_program(argc, argv, app, [&] { return softarm::serve(config); });
}
