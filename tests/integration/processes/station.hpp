// A daemon, its plant and all that they send: a separate configuration and network port, processes
// that end with the test, and what came over the wire.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "dev/soak/command_steps.hpp"
#include "integration/processes/process.hpp"
#include "own_url.hpp"
#include "softarm/base/time.hpp"
#include "softarm/client/arm_client.hpp"
#include "softarm/config/load.hpp"
#include "test_folder.hpp"

namespace softarm::test {

inline constexpr std::int64_t kSecond = 1'000'000'000;

class Station {
 public:
  Station() {
    // No daemon finds the FAULT of another test.
    setenv("XDG_STATE_HOME", folder_.path().c_str(), 1);
    unsetenv("STATE_DIRECTORY");
    write_config("paper_arm.yaml", std::string("  safety: {") + kPatientSafety + "}\n");
  }

  /// Begins to listen to an arm with as many segments as that of config/BASE.
  /// @throws TransportError
  void listen(const std::string& base = "paper_arm.yaml") {
    Experiment arm = load_experiment(SOFTARM_SOURCE_DIR "/config/" + base);
    arm.transport.lcm.url = url_;
    client_ = std::make_unique<ArmClient>(arm);
    client_->on_status([this](const ArmStatus& status) {
      status_ = status;
      ++statuses_;
      ++statuses_of_[static_cast<std::size_t>(status_.mode)];
      shutdown_statuses_ += reason() == Reason::shutdown ? 1 : 0;
      active_in_row_ = mode() == Mode::active ? active_in_row_ + 1 : 0;
      seen_.insert({mode(), reason()});
      saw_bounded_ |= status.bounded;
      saw_saturated_ |= status.saturated;
      saw_slew_limited_ |= status.slew_limited;
    });
    client_->on_plant([this](const PlantState& plant) {
      plant_ = plant;
      ++plant_states_;
    });
    client_->on_command([this](const ChamberCommand& command) {
      command_ = command;
      ++commands_;
      largest_step_bar_ = std::max(largest_step_bar_, steps_.take(command));
      if (command.pressure_bar.size() == 0) return;
      all_finite_ &= command.pressure_bar.allFinite();
      lowest_bar_ = std::min(lowest_bar_, command.pressure_bar.minCoeff());
      highest_bar_ = std::max(highest_bar_, command.pressure_bar.maxCoeff());
    });
  }

  /// `more` is YAML of two spaces that belongs under `daemon:`, `rest` of none.
  void write_config(const std::string& base, const std::string& more,
                    const std::string& rest = "") {
    config_ = folder_ / "config.yaml";
    std::ofstream(config_) << "include: "
                           << std::filesystem::path(SOFTARM_SOURCE_DIR) / "config" / base
                           << "\nname: under_test\n"
                           << rest << "daemon:\n  lcm: {url: \"" << url_
                           << "\", command_validity_s: " << validity_s_ << lcm_ << "}\n"
                           << more;
  }

  std::unique_ptr<Process> start(const std::string& program,
                                 std::vector<std::string> arguments = {}) {
    arguments.push_back(config_.string());
    return start_as_is(program, arguments);
  }
  /// Without the configuration as its last argument.
  std::unique_ptr<Process> start_as_is(const std::string& program,
                                       const std::vector<std::string>& arguments) {
    return std::make_unique<Process>(program, arguments,
                                     folder_ / (std::filesystem::path(program).filename().string() +
                                                std::to_string(started_++)));
  }
  /// The simulated arm behind a valve terminal, at a port that the kernel chooses: Process::port().
  std::unique_ptr<Process> start_terminal() { return start("softarm-plant", {"--modbus", "0"}); }

  /// Handles messages until `reached`; gives up after `patience_s`. Returns whether it was reached.
  /// How long it takes depends on the machine: the patience only bounds a test that fails.
  bool wait_for(const std::function<bool()>& reached, double patience_s = kPatience_s) {
    std::int64_t next_ns = 0;
    const auto reached_meanwhile = [&] {
      if (reached()) return true;
      if (const std::int64_t now_ns = monotonic_now_ns(); meanwhile_ && now_ns >= next_ns) {
        meanwhile_();
        next_ns = now_ns + kSecond / 100;
      }
      return false;
    };
    return client_->wait_for(reached_meanwhile, patience_s);
  }
  /// From now on arms whenever the daemon waits for that, as an operator beside the arm would, and
  /// acknowledges a fault first: a busy machine may drive the arm beyond a soft limit.
  void arm_when_asked() {
    meanwhile_ = [this, k = 0]() mutable {
      const bool asked = mode() == Mode::fault || reason() == Reason::waiting_for_arm;
      if (statuses_ == 0 || !asked || ++k % 10 != 0) return;
      client_->send(mode() == Mode::fault ? OperatorRequest::disarm : OperatorRequest::arm);
    };
  }
  /// Handles messages for this long.
  void go_on(double seconds) {
    wait_for([] { return false; }, seconds);
  }
  /// Waits for the end of a process: its exit code, -1 if it does not end.
  int end_of(Process& process) {
    int code = -1;
    wait_for([&] { return (code = process.wait(std::chrono::milliseconds(0))) >= 0; });
    return code;
  }
  /// Ends a process by a signal; `shutdown_statuses_` counts what a daemon reported meanwhile.
  int end(Process& process, int signal = SIGTERM) {
    shutdown_statuses_ = 0;
    process.signal(signal);
    const int code = end_of(process);
    client_->update(client_->now_ns());
    return code;
  }

  Mode mode() const { return statuses_ > 0 ? status_.mode : Mode::init; }
  Reason reason() const { return status_.reason; }
  /// "VENT (frames_stale)", of now and of all that was seen.
  std::string seen_text() const {
    std::string text = status_.text() + ", seen:";
    for (const auto& [m, r] : seen_) text += std::string(" ") + name(m) + "(" + name(r) + ")";
    return text;
  }
  void forget() { seen_.clear(); }
  bool saw(Mode m, Reason r) const { return seen_.count({m, r}) > 0; }

  static double largest(const PressureVector& pressures) {
    return pressures.size() > 0 ? pressures.maxCoeff() : 0.0;
  }
  bool under_pressure() const {
    return mode() == Mode::active && largest(plant_.pressure_bar) > 0.1;
  }

  static constexpr double kPatience_s = 60.0;
  /// Keys of daemon.safety: thresholds that a machine does not reach by being busy for a moment.
  static constexpr const char* kPatientSafety =
      "hold_after_s: 0.1, vent_after_s: 0.25, max_latency_s: 0.2, good_frames: 20";

  TestFolder folder_;
  std::filesystem::path config_;
  std::string url_ = own_url();
  std::string lcm_;          ///< more keys of daemon.lcm, each with a comma before it
  double validity_s_ = 0.3;  ///< of a command; longer than a busy machine delays one
  std::unique_ptr<ArmClient> client_;
  std::function<void()> meanwhile_;  ///< called 100 times a second while it waits; may be empty
  ArmStatus status_;
  PlantState plant_;
  ChamberCommand command_;
  CommandSteps steps_;
  int statuses_ = 0, plant_states_ = 0, commands_ = 0, started_ = 0;
  int active_in_row_ = 0;                   ///< statuses up to the newest
  int shutdown_statuses_ = 0;               ///< of a daemon that ends: how many ticks it took
  std::array<int, 8> statuses_of_{};        ///< by mode
  std::set<std::pair<Mode, Reason>> seen_;  ///< since `forget`
  bool saw_bounded_ = false, saw_saturated_ = false, saw_slew_limited_ = false;
  // Of all commands so far.
  double lowest_bar_ = 0.0, highest_bar_ = 0.0, largest_step_bar_ = 0.0;
  bool all_finite_ = true;
};

}  // namespace softarm::test
