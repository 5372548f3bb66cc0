// The simulated arm in real time between LCM, or a Modbus server, and the clock.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <softarm_messages/plant_state_t.hpp>
#include <softarm_messages/pressure_command_t.hpp>
#include <softarm_messages/pressure_measurement_t.hpp>
#include <softarm_messages/torque_command_t.hpp>
#include <vector>

#include "softarm/base/clock.hpp"
#include "softarm/config/experiment.hpp"
#include "softarm/simulation/simulated_arm.hpp"
#include "softarm/simulation/valve_side.hpp"
#include "softarm/transport/lcm_node.hpp"
#include "softarm/transport/mocap_source.hpp"
#include "softarm/transport/settings.hpp"
#include "softarm/valves/modbus_server.hpp"
#include "softarm/valves/simulated_terminal.hpp"

namespace softarm {

/// A valve terminal in front of the arm, polled by the loop of the plant.
struct ModbusSide {
  ModbusSide(const ValveDriverSettings& valves, int port)
      : server(port), terminal(valves.registers, valves.order) {}

  ModbusServer server;
  SimulatedTerminal terminal;
  std::int64_t sequence = 0;
};

/// Belongs to one thread. Prints events of the arm on stderr.
class PlantProcess {
 public:
  /// @param modbus_port port of a valve terminal to serve at 127.0.0.1 (0: any); none: commands
  /// come over LCM @throws TransportError, std::runtime_error if the port cannot be served
  PlantProcess(const Experiment& experiment, std::optional<int> modbus_port);

  /// Runs until a stop is requested.
  void run();

 private:
  bool vented() const { return valve_side_ ? valve_side_->vented() : arm_.vented(); }
  void take_commands(std::int64_t deadline_ns);
  void serve_requests(std::int64_t deadline_ns);
  std::int64_t arm_now_ns();
  void advance();
  void advance_valve_side(std::int64_t now_ns);
  void take_command();
  template <class Message, class Values>
  void take_command(const Message& message, const Values& values);
  void publish_state();

  LcmSettings lcm_;
  MocapSender mocap_;
  LcmNode node_;
  SimulatedArm arm_;
  std::unique_ptr<ModbusSide> modbus_;
  std::optional<ValveSide> valve_side_;  ///< where commands come over LCM
  Eigen::VectorXd set_points_;           ///< that the arm's valves follow
  PauseWatch pause_;
  std::int64_t shortened_us_ = 0;  ///< reported validity of commands that are not held so long
  bool local_, degraded_ = false;
  bool by_torque_;
  std::int64_t report_period_ns_;
  std::int64_t lost_ns_ = 0;
  bool command_received_ = false;
  std::vector<double> pressure_bar_;
  softarm_messages::pressure_command_t command_message_;
  softarm_messages::torque_command_t torque_message_;
  softarm_messages::pressure_measurement_t measurement_message_;
  softarm_messages::plant_state_t state_message_;
};

}  // namespace softarm
