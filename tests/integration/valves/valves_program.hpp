// Programs around the valve driver, and what a test receives from them over LCM.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>

#include "integration/processes/station.hpp"
#include "softarm/transport/lcm_node.hpp"
#include "softarm/transport/message_decoding.hpp"

namespace softarm::test {

inline constexpr int kChambers = 12;

class ValvesProgram : public ::testing::Test, protected Station {
 protected:
  void SetUp() override {
    try {
      listen();
      node_ = std::make_unique<LcmNode>(url_);
    } catch (const TransportError& error) {
      GTEST_SKIP() << error.what();
    }
    client_->on_message([this](const ArmMessage& message) {
      if (message.channel == "SOFTARM_VALVES") ++valve_statuses_;
      if (message.channel == "SOFTARM_PRESSURE" && decode(message.bytes, measured_))
        ++measurements_;
    });
    sent_.num_chambers = kChambers;
    sent_.validity_us = 300'000;
    sent_.pressure_bar.assign(kChambers, 0.0F);
  }

  /// `valves` and `safety` are further keys of these, each with a comma before it.
  void configure(int port, const std::string& valves = "", const std::string& safety = "") {
    // A machine that is busy with other things must not look like a faulty terminal.
    const bool has_rate = valves.find("rate_hz") != std::string::npos;
    write_config("paper_arm_modbus.yaml", "  safety: {valve_readback: false" + safety + "}\n",
                 "valves: {port: " + std::to_string(port) +
                     ", failsafe_timeout_s: 0.3, tolerated_failures: 2" +
                     (has_rate ? "" : ", rate_hz: 20, response_timeout_s: 0.049") + valves + "}\n");
  }

  /// Commands `bar` in every chamber until `reached`.
  bool command_until(double bar, const std::function<bool()>& reached) {
    meanwhile_ = [this, bar] {
      sent_.pressure_bar.assign(kChambers, static_cast<float>(bar));
      publish();
    };
    const bool done = wait_for(reached);
    meanwhile_ = {};
    return done;
  }
  void publish() {
    ++sent_.sequence;
    node_->publish("SOFTARM_PRESSURE_COMMAND", sent_);
  }

  /// The newest status of the driver, or a disconnected one before the first.
  ValvesStatus valves() const { return client_->valves().value_or(ValvesStatus{}); }
  bool is(ValveState state, ValveReason reason) const {
    return client_->valves() && valves().state == state && valves().reason == reason;
  }
  /// Measured pressures all near `bar`, in the plant itself and as the driver reports them.
  bool pressure_is(double bar) const {
    const auto near = [bar](const PressureVector& pressures) {
      return pressures.size() == kChambers && ((pressures.array() - bar).abs() < 0.02).all();
    };
    return near(plant_.pressure_bar) && client_->measured() && near(client_->measured()->bar);
  }

  std::unique_ptr<LcmNode> node_;  ///< sends what a client of ours would not
  softarm_messages::pressure_command_t sent_{};
  softarm_messages::pressure_measurement_t measured_{};
  int valve_statuses_ = 0, measurements_ = 0;
};

}  // namespace softarm::test
