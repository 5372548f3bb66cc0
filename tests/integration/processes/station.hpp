// A daemon, its plant and all they say: a configuration and a network port of their own, processes
// that end with the test, and what came over the wire.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
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
#include "softarm/base/time.hpp"
#include "softarm/runtime/safety_monitor.hpp"
#include "softarm/transport/lcm_node.hpp"
#include "softarm/transport/message_decoding.hpp"

namespace softarm::test {

inline constexpr std::int64_t kSecond = 1'000'000'000;

class Station {
 public:
  Station() {
    static int stations = 0;
    const int number = stations++;
    const std::string text = std::to_string(getpid()) + "_" + std::to_string(number);
    folder_ = std::filesystem::temp_directory_path() / ("softarm_" + text);
    std::filesystem::create_directories(folder_);
    // A port of its own, so that tests may run side by side.
    url_ = "udpm://239.255.76.67:" + std::to_string(20000 + (8 * getpid() + number) % 40000) +
           "?ttl=0";
    write_config("paper_arm.yaml", "");
  }
  ~Station() { std::filesystem::remove_all(folder_); }
  Station(const Station&) = delete;
  Station& operator=(const Station&) = delete;

  /// Begins to listen. @throws TransportError
  void listen() {
    node_ = std::make_unique<LcmNode>(url_);
    node_->subscribe("SOFTARM_STATUS", 4096, [this](const ReceivedMessage& packet) {
      if (!decode(packet.bytes, status_)) return;
      ++statuses_;
      active_in_row_ = mode() == Mode::active ? active_in_row_ + 1 : 0;
      seen_.insert({mode(), reason()});
      flags_seen_ |= status_.flags;
    });
    node_->subscribe("SOFTARM_PLANT", 4096, [this](const ReceivedMessage& packet) {
      if (decode(packet.bytes, plant_)) ++plant_states_;
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
                           << rest << "daemon:\n  lcm: {url: \"" << url_ << "\"" << lcm_ << "}\n"
                           << more;
  }

  std::unique_ptr<Process> start(const std::string& program,
                                 std::vector<std::string> arguments = {}) {
    arguments.push_back(config_.string());
    return std::make_unique<Process>(
        program, arguments,
        (folder_ /
         (std::filesystem::path(program).filename().string() + std::to_string(started_++)))
            .string());
  }

  /// Handles messages until `reached`, or `patience_s` have passed; says which.
  bool wait_for(const std::function<bool()>& reached, double patience_s = 10.0) {
    const std::int64_t end_ns = monotonic_now_ns() + to_ns(patience_s);
    while (monotonic_now_ns() < end_ns) {
      if (reached()) return true;
      node_->wait_until(monotonic_now_ns() + kSecond / 100);
    }
    return reached();
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

  std::filesystem::path folder_, config_;
  std::string url_;
  std::string lcm_;  ///< more keys of daemon.lcm, each with a comma before it
  std::unique_ptr<LcmNode> node_;
  softarm_messages::controller_status_t status_{};
  softarm_messages::plant_state_t plant_{};
  softarm_messages::pressure_command_t command_{};
  CommandSteps steps_;
  int statuses_ = 0, plant_states_ = 0, commands_ = 0, started_ = 0;
  int active_in_row_ = 0;                   ///< statuses up to the newest
  std::set<std::pair<Mode, Reason>> seen_;  ///< since `forget`
  int flags_seen_ = 0;
  // Of all commands so far, bar.
  float lowest_ = 0.0F, highest_ = 0.0F, largest_step_ = 0.0F;
  bool all_finite_ = true;
};

}  // namespace softarm::test
