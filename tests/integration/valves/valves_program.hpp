// Programs around the valve driver, and what a test hears of them over LCM.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "integration/processes/process.hpp"
#include "softarm/base/clock.hpp"
#include "softarm/transport/lcm_node.hpp"
#include "softarm/transport/message_decoding.hpp"
#include "softarm/valves/valve_guard.hpp"

namespace softarm::test {

inline constexpr std::int64_t kSecond = 1'000'000'000;
inline constexpr int kChambers = 12;

class ValvesProgram : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() /
              ("softarm_" + std::to_string(getpid()) + "_" +
               ::testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::create_directories(folder_);
    url_ = "udpm://239.255.76.67:" + std::to_string(20000 + getpid() % 12000) + "?ttl=0";
    try {
      node_ = std::make_unique<LcmNode>(url_);
      node_->subscribe("SOFTARM_VALVES", 4096, [this](const ReceivedMessage& packet) {
        if (decode(packet.bytes, status_)) ++statuses_;
      });
      node_->subscribe("SOFTARM_PRESSURE", 4096, [this](const ReceivedMessage& packet) {
        if (decode(packet.bytes, measured_)) ++measurements_;
      });
      node_->subscribe("SOFTARM_PLANT", 4096,
                       [this](const ReceivedMessage& packet) { decode(packet.bytes, plant_); });
    } catch (const TransportError& error) {
      GTEST_SKIP() << error.what();
    }
    command_.num_chambers = kChambers;
    command_.pressure_bar.assign(kChambers, 0.0F);
    command_.validity_us = 300'000;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  /// `valves` and `more` are YAML of their own.
  void write_config(int port, const std::string& valves = "", const std::string& safety = "") {
    config_ = folder_ / "config.yaml";
    // A machine that is busy with other things must not look like a faulty terminal.
    std::ofstream(config_)
        << "include: " << std::filesystem::path(SOFTARM_SOURCE_DIR) / "config/paper_arm_modbus.yaml"
        << "\nname: under_test\ndaemon:\n  lcm: {url: \"" << url_
        << "\"}\n  safety: {valve_readback: false" << safety << "}\nvalves: {port: " << port
        << ", failsafe_timeout_s: 0.3, tolerated_failures: 2"
        << (valves.find("rate_hz") == std::string::npos ? ", rate_hz: 20, response_timeout_s: 0.049"
                                                        : "")
        << valves << "}\n";
  }

  std::unique_ptr<Process> start(const std::string& program,
                                 std::vector<std::string> arguments = {}) {
    arguments.push_back(config_.string());
    return std::make_unique<Process>(program, arguments,
                                     (folder_ / ("output" + std::to_string(started_++))).string());
  }

  /// The simulated arm behind its server, at a port of the kernel's choice.
  std::unique_ptr<Process> start_plant() { return start("softarm-plant", {"--modbus", "0"}); }

  /// Handles messages, and commands `bar` in every chamber (unless negative), until `reached`.
  bool wait_for(const std::function<bool()>& reached, double bar = -1.0, double patience_s = 20.0) {
    const std::int64_t end_ns = monotonic_now_ns() + to_ns(patience_s);
    while (monotonic_now_ns() < end_ns) {
      if (reached()) return true;
      if (bar >= 0.0) send(bar);
      node_->wait_until(monotonic_now_ns() + kSecond / 100);
      node_->drain(1000);
    }
    return reached();
  }
  void send(double bar) {
    ++command_.sequence;
    command_.pressure_bar.assign(kChambers, static_cast<float>(bar));
    node_->publish("SOFTARM_PRESSURE_COMMAND", command_);
  }

  ValveState state() const {
    return statuses_ > 0 ? static_cast<ValveState>(status_.state) : ValveState::disconnected;
  }
  ValveReason reason() const { return static_cast<ValveReason>(status_.reason); }
  bool is(ValveState wanted, ValveReason why) const {
    return statuses_ > 0 && state() == wanted && reason() == why;
  }
  /// Measured pressures all near `bar`, in the plant itself and as the driver reports them.
  bool pressure_is(double bar) const {
    const auto near = [bar](const std::vector<float>& list) {
      return list.size() == kChambers && std::all_of(list.begin(), list.end(), [bar](float p) {
               return std::abs(static_cast<double>(p) - bar) < 0.02;
             });
    };
    return near(plant_.pressure_bar) && near(measured_.pressure_bar);
  }

  std::filesystem::path folder_, config_;
  std::string url_;
  std::unique_ptr<LcmNode> node_;
  softarm_messages::valves_status_t status_{};
  softarm_messages::pressure_measurement_t measured_{};
  softarm_messages::plant_state_t plant_{};
  softarm_messages::pressure_command_t command_{};
  int statuses_ = 0, measurements_ = 0, started_ = 0;
};

}  // namespace softarm::test
