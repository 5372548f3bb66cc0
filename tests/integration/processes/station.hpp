// A daemon, its plant and all they say: a configuration and a network port of their own, processes
// that end with the test, and what came over the wire.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
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
#include "softarm/client/arm_client.hpp"
#include "softarm/config/load.hpp"

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
    url_ = "udpm://239.255.76.67:" + std::to_string(20000 + (8 * getpid() + number) % 12000) +
           "?ttl=0";
    write_config("paper_arm.yaml", "");
  }
  ~Station() { std::filesystem::remove_all(folder_); }
  Station(const Station&) = delete;
  Station& operator=(const Station&) = delete;

  /// Begins to listen to an arm with as many segments as that of config/BASE. @throws TransportError
  void listen(const std::string& base = "paper_arm.yaml") {
    Experiment arm = load_experiment(SOFTARM_SOURCE_DIR "/config/" + base);
    arm.transport.lcm.url = url_;
    client_ = std::make_unique<ArmClient>(arm);
    client_->on_status([this](const ArmStatus& status) {
      status_ = status;
      ++statuses_;
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
    return client_->wait_for(reached, patience_s);
  }

  Mode mode() const { return statuses_ > 0 ? status_.mode : Mode::init; }
  Reason reason() const { return status_.reason; }
  /// "VENT (frames_stale)", of now and of all that was seen.
  std::string told() const {
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

  std::filesystem::path folder_, config_;
  std::string url_;
  std::string lcm_;  ///< more keys of daemon.lcm, each with a comma before it
  std::unique_ptr<ArmClient> client_;
  ArmStatus status_;
  PlantState plant_;
  ChamberCommand command_;
  CommandSteps steps_;
  int statuses_ = 0, plant_states_ = 0, commands_ = 0, started_ = 0;
  int active_in_row_ = 0;                   ///< statuses up to the newest
  std::set<std::pair<Mode, Reason>> seen_;  ///< since `forget`
  bool saw_bounded_ = false, saw_saturated_ = false, saw_slew_limited_ = false;
  // Of all commands so far.
  double lowest_bar_ = 0.0, highest_bar_ = 0.0, largest_step_bar_ = 0.0;
  bool all_finite_ = true;
};

}  // namespace softarm::test
