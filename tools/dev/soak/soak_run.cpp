#include "dev/soak/soak_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "apps/program.hpp"
#include "apps/progress.hpp"
#include "apps/signals.hpp"
#include "softarm/base/clock.hpp"
#include "softarm/base/realtime.hpp"
#include "softarm/base/time.hpp"
#include "softarm/config/load.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {
namespace {

using namespace std::chrono_literals;

constexpr int kSteadyStatuses = 50;  ///< ACTIVE in a row: recovered

}  // namespace

std::filesystem::path write_soak_config(const SoakOptions& options) {
  const std::filesystem::path path = options.folder / "soak.yaml";
  const std::string text = fmt::format(
      "include: {}\nname: soak\nseed: {}\n"
      "reference: [{{kind: live, timeout_s: 1}}]\n"
      "daemon:\n"
      "  rate_hz: 500\n"
      "  lcm: {{url: \"udpm://239.255.76.67:{}?ttl=0\", deadman_channel: SOFTARM_SOAK_GO}}\n"
      "  safety: {{arming: explicit, frame_period_s: 0.002, hold_after_s: 0.1, vent_after_s: "
      "0.25,\n"
      "    valve_readback: true, valve_silence_s: 0.4, deadman_timeout_s: 1.5}}\n"
      "{}"
      "plant: {{mocap: {{rate_hz: 500}}}}\n",
      std::filesystem::absolute(options.config).string(), options.seed, 20000 + getpid() % 12000,
      // Above a flood that is sent at the priority of this program.
      runs_under_fifo() ? "  realtime: {fifo: true, priority: 50}\n" : "");
  const auto files = load_experiment(options.config).files;
  write_text(path, text, files);
  write_text(options.folder / "soak_plant.yaml",
             fmt::format("include: soak.yaml\nname: soak_plant\n"
                         "daemon: {{lcm: {{command_channel: {}, measurement_channel: "
                         "SOFTARM_SOAK_UNHEARD}}}}\n",
                         kSoakValvesChannel),
             files);
  return path;
}

SoakRun::SoakRun(const SoakOptions& options)
    : options_(options),
      config_(write_soak_config(options)),
      experiment_(load_experiment(config_)),
      random_(options.seed),
      arm_(experiment_),
      relay_(experiment_.transport.lcm, kSensorSuffix, 0, kSoakValvesChannel),
      sender_(experiment_.transport.lcm.url),
      terminal_(static_cast<int>(experiment_.valves.order.size())),
      daemon_{.name = "softarmd", .arguments = {config_.string()}, .process = {}, .record = {}},
      plant_{.name = "softarm-plant",
             .arguments = {(options.folder / "soak_plant.yaml").string(), "--sensor-suffix",
                           kSensorSuffix},
             .process = {},
             .record = {}},
      valves_{.name = "softarm-valves",
              .arguments = {(options.folder / "soak_valves.yaml").string()},
              .process = {},
              .record = {}},
      replace_until_s_(std::min(0.25 * options.duration_s, 300.0)),
      warm_up_s_(replace_until_s_ + std::min(0.125 * options.duration_s, 60.0)) {
  setenv("XDG_STATE_HOME", std::filesystem::absolute(options.folder).c_str(), 1);  // of the daemon
  if (experiment_.actuation.kind == ActuationKind::torque)
    throw ConfigError(options.config, 0, "actuation.kind",
                      "chambers: a soak watches pressures and valves", "torque");
  if (experiment_.transport.mocap.source != softarm_mocap())
    throw ConfigError(options.config, 0, "daemon.mocap.source",
                      "softarm, the only frames that a soak can corrupt", "another source");
  for (const SoakFault& fault : soak_faults()) counters_.faults.push_back({.name = fault.name});
#ifndef SOFTARM_SANITIZED  // whose runtime must be loaded first
  if (std::filesystem::exists(SOFTARM_WALL_CLOCK)) {
    clocks_.emplace((options.folder / "clocks").string());
    valves_clocks_.emplace((options.folder / "valves_clocks").string());
  }
#endif
  write_text(options.folder / "soak_valves.yaml",
             fmt::format("include: soak.yaml\nname: soak_valves\n"
                         "daemon: {{lcm: {{command_channel: {}, measurement_channel: {}{}}}}}\n"
                         "valves: {{port: {}, terminal: cpx_vppm, rate_hz: 100, "
                         "response_timeout_s: 0.009,\n"
                         "  tolerated_failures: 10, failsafe_timeout_s: 0.3}}\n",
                         kSoakValvesChannel, experiment_.transport.lcm.measurement_channel,
                         kSensorSuffix, terminal_.port()),
             experiment_.files);
}

double SoakRun::passed_s() const { return to_seconds(monotonic_now_ns() - start_ns_); }

void SoakRun::start(Program& program) {
  const int number = program.process ? ++program.record.instances : 1;
  std::string path = program_beside_this(program.name);
  std::vector<std::string> arguments = program.arguments;
  const auto& clocks = &program == &daemon_ ? clocks_ : valves_clocks_;
  if (&program != &plant_ && clocks) {
    arguments.insert(arguments.begin(), path);
    const std::vector<std::string> preload = clocks->preload();
    arguments.insert(arguments.begin(), preload.begin(), preload.end());
    path = "env";
  }
  program.process = std::make_unique<ChildProcess>(
      path, arguments, (options_.folder / fmt::format("{}_{}.txt", program.name, number)).string());
  program.record.name = program.name;
}

void SoakRun::end(Program& program) {
  program.process->signal(SIGTERM);
  if (const int code = program.process->wait(5s); code != 0)
    counters_.troubles.push_back(
        code < 0 ? fmt::format("{} did not end in 5 s after SIGTERM", program.name)
                 : fmt::format("{} ended with exit code {} after SIGTERM", program.name, code));
}

/// A process that ended by itself ends the soak.
void SoakRun::look_after_processes() {
  for (Program* program : {&daemon_, &plant_, &valves_}) {
    const int code = program->process->wait(0ms);
    if (code < 0) continue;
    counters_.troubles.push_back(fmt::format("{} ended by itself after {:.1f} s, exit code {}",
                                             program->name, passed_s(), code));
    stop_ = true;
  }
}

void SoakRun::measure_after_warm_up(double now_s) {
  for (Program* program : {&daemon_, &plant_, &valves_}) {
    ProcessRecord& record = program->record;
    const auto use = process_use(program->process->pid());
    if (!use) continue;
    if (!record.measured && now_s >= warm_up_s_) {
      record.after_warm_up = *use;
      record.measured = true;
    }
    record.at_end = *use;
  }
}

/// What an operator would do: acknowledge a fault, then arm.
bool SoakRun::operate_until_active(double patience_s) {
  arm_.reset_active_count();
  const double end_s = passed_s() + patience_s;
  const auto active = [&] { return arm_.active_in_row() >= kSteadyStatuses; };
  while (passed_s() < end_s && stop_requested == 0 && !stop_) {
    if (arm_.wait_for(active, 0.2)) return true;
    look_after_processes();
    if (arm_.mode() == Mode::fault) {
      arm_.request(OperatorRequest::disarm);
    } else if (arm_.reason() == Reason::waiting_for_arm) {
      arm_.request(OperatorRequest::arm);
    }
  }
  return active();
}

void SoakRun::wait_between_faults() {
  arm_.forget();
  const double pause_s = options_.between_s * std::uniform_real_distribution(0.5, 1.5)(random_);
  arm_.wait_for([] { return stop_requested != 0; }, pause_s);
  if (!arm_.left_active()) return;
  ++counters_.unprovoked;
  operate_until_active(kPatience_s);
}

/// All faults in random order, then all again, those that replace a process first, and only at the
/// beginning of the run.
const SoakFault& SoakRun::next_fault(double now_s) {
  const std::span<const SoakFault> faults = soak_faults();
  while (true) {
    if (cycle_.empty()) {
      cycle_.resize(faults.size());
      std::iota(cycle_.begin(), cycle_.end(), std::size_t{0});
      std::shuffle(cycle_.begin(), cycle_.end(), random_);
      std::stable_partition(cycle_.begin(), cycle_.end(),
                            [&](std::size_t k) { return !faults[k].replaces_process(); });
    }
    const SoakFault& fault = faults[cycle_.back()];
    cycle_.pop_back();
    if (!clocks_ &&
        (fault.action == SoakAction::suspend || fault.action == SoakAction::suspend_valves))
      continue;
    if (!fault.replaces_process() || now_s < replace_until_s_) return fault;
  }
}

bool SoakRun::answered(const SoakFault& fault, std::int64_t counter_before) {
  if (fault.counter != nullptr)
    return arm_.wait_for(
        [&] { return arm_.status().*fault.counter >= counter_before + fault.counts; }, kPatience_s);
  if (fault.of_valves())
    return arm_.wait_for(
        [&] {
          // Where the driver vents for another reason first, stuck valves are pressures that stay.
          const bool stuck = fault.action == SoakAction::stick_valves;
          const bool named = fault.valves == ValveReason::none || arm_.saw(fault.valves) ||
                             (stuck && arm_.saw(ValveReason::zero_unconfirmed));
          return arm_.left_active() && (terminal_vented() || stuck) && named;
        },
        kPatience_s);
  if (fault.mode == Mode::active)  // a daemon that is no more
    return arm_.wait_for([&] { return arm_.plant_vented(); }, kPatience_s);
  return arm_.wait_for([&] { return arm_.saw(fault.mode, fault.reason); }, kPatience_s);
}

void SoakRun::clear(const SoakFault& fault) {
  relay_.set({});
  arm_.set_dead_man(SoakArm::DeadMan::go);
  terminal_.writes = Writes::obeyed;
  if (fault.action == SoakAction::kill_valves) start(valves_);
  if (fault.action == SoakAction::pause_plant) plant_.process->signal(SIGCONT);
  if (fault.action == SoakAction::restart_plant) start(plant_);
  if (fault.action == SoakAction::end_daemon || fault.action == SoakAction::kill_daemon)
    start(daemon_);
}

void SoakRun::make(const SoakFault& fault, FaultCount& count) {
  ++count.injected;
  arm_.forget();
  const std::int64_t before = fault.counter != nullptr ? arm_.status().*fault.counter : 0;
  const double begin_s = passed_s();
  cause(fault);
  const bool seen = answered(fault, before);
  count.answered += seen ? 1 : 0;
  const double answer_s = passed_s();
  count.longest_answer_s = std::max(count.longest_answer_s, answer_s - begin_s);
  if (fault.counter != nullptr && arm_.left_active()) ++count.disturbed;
  clear(fault);
  const bool recovered = operate_until_active(kPatience_s);
  count.recovered += recovered ? 1 : 0;
  count.longest_recovery_s = std::max(count.longest_recovery_s, passed_s() - answer_s);
  if (!seen || !recovered)
    counters_.troubles.push_back(fmt::format("{} at {:.1f} s: {}; then {} ({})", fault.name,
                                             begin_s, seen ? "not recovered" : "not answered",
                                             name(arm_.mode()), name(arm_.reason())));
}

void SoakRun::soak() {
  Progress progress(true);
  while (passed_s() < options_.duration_s) {
    wait_between_faults();
    look_after_processes();
    if (stop_ || stop_requested != 0) return;
    const SoakFault& fault = next_fault(passed_s());
    const auto index = static_cast<std::size_t>(&fault - soak_faults().data());
    make(fault, counters_.faults[index]);
    look_after_processes();
    measure_after_warm_up(passed_s());
    if (progress.due())
      progress.update(
          fmt::format("softarm-dev soak: {:.0f} / {:.0f} s: {} ticks, {} missed; {} faults, {} "
                      "recovered; softarmd "
                      "{} KiB, softarm-plant {} KiB",
                      passed_s(), options_.duration_s, arm_.ticks(), arm_.overruns(),
                      counters_.injected(), counters_.recovered(),
                      daemon_.record.at_end.resident_kib, plant_.record.at_end.resident_kib));
  }
}

SoakCounters SoakRun::run() {
  start_ns_ = monotonic_now_ns();
  start(plant_);
  start(valves_);
  start(daemon_);
  if (operate_until_active(kPatience_s)) {
    for (Program* program : {&daemon_, &plant_, &valves_})
      program->record.at_start = process_use(program->process->pid()).value_or(ProcessUse{});
    soak();
  } else if (!stop_) {
    counters_.troubles.push_back(
        fmt::format("not ACTIVE within {:g} s, but {} ({})\n{}{}", kPatience_s, name(arm_.mode()),
                    name(arm_.reason()), daemon_.process->printed(),
                    plant_.process->printed() + valves_.process->printed()));
  }
  if (!stop_) {
    end(daemon_);
    arm_.wait_for([] { return false; }, 0.1);  // its last messages
    end(plant_);
    end(valves_);
  }
  counters_.duration_s = passed_s();
  counters_.warm_up_s = warm_up_s_;
  counters_.rate_hz = experiment_.rate_hz;
  counters_.ticks = arm_.ticks();
  counters_.overruns = arm_.overruns();
  counters_.commands = arm_.commands();
  counters_.commands_outside_limits = arm_.commands_outside_limits();
  counters_.straight_poses = arm_.straight_poses();
  for (const Program* program : {&daemon_, &plant_, &valves_})
    counters_.processes.push_back(program->record);
  return counters_;
}

}  // namespace softarm
