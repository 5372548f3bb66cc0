// A daemon, its plant and all they say: a configuration and a network port of their own, processes
// that end with the test, and what came over the wire.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
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
#include "softarm/base/clock.hpp"
#include "softarm/runtime/safety_monitor.hpp"
#include "softarm/transport/lcm_node.hpp"
#include "softarm/transport/message_decoding.hpp"
#include "test_folder.hpp"

namespace softarm::test {

inline constexpr std::int64_t kSecond = 1'000'000'000;

class Station {
 public:
  Station() {
    static int stations = 0;
    const int number = stations++;
    // A port of its own, so that tests may run side by side.
    url_ = "udpm://239.255.76.67:" + std::to_string(20000 + (8 * getpid() + number) % 40000) +
           "?ttl=0";
    write_config("paper_arm.yaml", std::string("  safety: {") + kPatientSafety + "}\n");
  }

  /// Begins to listen. @throws TransportError
  void listen() {
    node_ = std::make_unique<LcmNode>(url_);
    node_->subscribe("SOFTARM_STATUS", 4096, [this](const ReceivedMessage& packet) {
      if (!decode(packet.bytes, status_)) return;
      ++statuses_;
      ++statuses_of_[static_cast<std::size_t>(status_.mode)];
      shutdown_statuses_ += reason() == Reason::shutdown ? 1 : 0;
      active_in_row_ = mode() == Mode::active ? active_in_row_ + 1 : 0;
      seen_.insert({mode(), reason()});
      flags_seen_ |= status_.flags;
    });
    node_->subscribe("SOFTARM_PLANT", 4096, [this](const ReceivedMessage& packet) {
      if (decode(packet.bytes, plant_)) ++plant_states_;
    });
    node_->subscribe("SOFTARM_VALVES", 4096, [this](const ReceivedMessage& packet) {
      if (decode(packet.bytes, valves_)) ++valve_statuses_;
    });
    node_->subscribe("SOFTARM_PRESSURE", 4096, [this](const ReceivedMessage& packet) {
      if (decode(packet.bytes, measured_)) ++measurements_;
    });
    node_->subscribe("SOFTARM_PRESSURE_COMMAND", 4096, [this](const ReceivedMessage& packet) {
      if (!decode(packet.bytes, command_)) return;
      ++commands_;
      largest_step_ = std::max(largest_step_, steps_.take(command_));
      for (const float bar : command_.pressure_bar) {
        if (!std::isfinite(bar)) all_finite_ = false;
        lowest_ = std::min(lowest_, bar);
        highest_ = std::max(highest_, bar);
      }
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
  /// The simulated arm behind a valve terminal, at a port of the kernel's choice: Process::port().
  std::unique_ptr<Process> start_terminal() { return start("softarm-plant", {"--modbus", "0"}); }

  /// Handles messages until `reached`; gives up after `patience_s`, and says which. How long it
  /// takes is the machine's affair: the patience bounds a test that fails.
  bool wait_for(const std::function<bool()>& reached, double patience_s = kPatience_s) {
    const std::int64_t end_ns = monotonic_now_ns() + static_cast<std::int64_t>(patience_s * 1e9);
    while (monotonic_now_ns() < end_ns) {
      if (reached()) return true;
      if (meanwhile_) meanwhile_();
      node_->wait_until(monotonic_now_ns() + kSecond / 100);
      node_->drain(4096);
    }
    return reached();
  }
  /// From now on arms whenever the daemon waits for that, as an operator beside the arm would, and
  /// acknowledges a fault before: a busy machine may drive the arm beyond a soft limit.
  void arm_when_asked() {
    using Request = softarm_messages::operator_command_t;
    meanwhile_ = [this, request = Request{}, k = 0]() mutable {
      const bool asked = mode() == Mode::fault || reason() == Reason::waiting_for_arm;
      if (statuses_ == 0 || !asked || ++k % 10 != 0) return;
      ++request.sequence;
      request.request = mode() == Mode::fault ? Request::DISARM : Request::ARM;
      node_->publish("SOFTARM_OPERATOR", request);
    };
  }
  /// Handles messages for so long.
  void go_on(double seconds) {
    wait_for([] { return false; }, seconds);
  }
  /// Waits for the end of a process: its exit code, -1 if it does not end.
  int end_of(Process& process) {
    int code = -1;
    wait_for([&] { return (code = process.wait(std::chrono::milliseconds(0))) >= 0; });
    return code;
  }
  /// Ends a process by a signal; what a daemon said of that is in `shutdown_statuses_`.
  int end(Process& process, int signal = SIGTERM) {
    shutdown_statuses_ = 0;
    process.signal(signal);
    const int code = end_of(process);
    node_->drain(4096);
    return code;
  }

  Mode mode() const { return statuses_ > 0 ? static_cast<Mode>(status_.mode) : Mode::init; }
  Reason reason() const { return static_cast<Reason>(status_.reason); }
  /// "VENT (frames_stale)", of now and of all that was seen.
  std::string told() const {
    std::string text = std::string(name(mode())) + " (" + name(reason()) + "), seen:";
    for (const auto& [m, r] : seen_) text += std::string(" ") + name(m) + "(" + name(r) + ")";
    return text;
  }
  void forget() { seen_.clear(); }
  bool saw(Mode m, Reason r) const { return seen_.count({m, r}) > 0; }

  static float largest(const std::vector<float>& pressures) {
    return pressures.empty() ? 0.0F : *std::max_element(pressures.begin(), pressures.end());
  }
  bool under_pressure() const {
    return mode() == Mode::active && largest(plant_.pressure_bar) > 0.1F;
  }

  static constexpr double kPatience_s = 60.0;
  /// Keys of daemon.safety: thresholds that a machine does not reach by being busy for a moment.
  static constexpr const char* kPatientSafety =
      "hold_after_s: 0.1, vent_after_s: 0.25, max_latency_s: 0.2, good_frames: 20";

  TestFolder folder_;
  std::filesystem::path config_;
  std::string url_;
  std::string lcm_;          ///< more keys of daemon.lcm, each with a comma before it
  double validity_s_ = 0.3;  ///< of a command: a machine is busy for less
  std::unique_ptr<LcmNode> node_;
  std::function<void()> meanwhile_;  ///< while it waits, some hundred times a second; may be empty
  softarm_messages::controller_status_t status_{};
  softarm_messages::plant_state_t plant_{};
  softarm_messages::valves_status_t valves_{};
  softarm_messages::pressure_measurement_t measured_{};
  softarm_messages::pressure_command_t command_{};
  CommandSteps steps_;
  int statuses_ = 0, plant_states_ = 0, commands_ = 0, started_ = 0;
  int valve_statuses_ = 0, measurements_ = 0;
  int active_in_row_ = 0;                   ///< statuses up to the newest
  int shutdown_statuses_ = 0;               ///< of a daemon that ends: so many ticks it took
  std::array<int, 8> statuses_of_{};        ///< by mode
  std::set<std::pair<Mode, Reason>> seen_;  ///< since `forget`
  int flags_seen_ = 0;
  // Of all commands so far, bar.
  float lowest_ = 0.0F, highest_ = 0.0F, largest_step_ = 0.0F;
  bool all_finite_ = true;
};

}  // namespace softarm::test
