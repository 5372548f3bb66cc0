// What a running arm says over LCM: frames, measured pressures, whether somebody else commands it.
#pragma once

#include <cstdint>
#include <deque>
#include <set>
#include <softarm_messages/controller_status_t.hpp>
#include <softarm_messages/pressure_command_t.hpp>
#include <softarm_messages/pressure_measurement_t.hpp>
#include <string>

#include "softarm/base/time.hpp"
#include "softarm/client/observation.hpp"
#include "softarm/config/experiment.hpp"
#include "softarm/estimation/curvature_estimator.hpp"
#include "softarm/transport/lcm_node.hpp"
#include "softarm/transport/mocap_source.hpp"

namespace softarm {

/// Subscribes and keeps. Time comes from LCM's receive thread. Experiment and node must outlive it.
class ArmListener {
 public:
  /// @param keep  collect everything in `seen`; otherwise only the newest is known
  /// @throws TransportError
  ArmListener(const Experiment& experiment, LcmNode& node, bool keep);

  Observation& seen() { return seen_; }
  /// Ends waiting for bodies that have a channel of their own and are not seen. Once in a while.
  void look_at_clock();

  /// u (2n, rad) of the newest frame that showed every segment; empty before the first.
  const Eigen::VectorXd& u_rad() const { return u_rad_; }
  /// Its arrival; kNever before the first.
  std::int64_t whole_frame_ns() const { return whole_frame_ns_; }
  /// When it was captured, as far as `daemon.capture_time` lets us know; kNever before the first.
  std::int64_t captured_ns() const { return captured_ns_; }
  /// Largest bend of a segment in that frame, and fastest over the last 50 ms, in rad and rad/s.
  double largest_theta_rad() const;
  double fastest_radps() const;
  /// Measured last; empty before the first.
  const std::vector<double>& measured_bar() const { return measured_bar_; }

  /// Who else commands the arm, for a person; empty where nobody was heard to: no command that
  /// moves valves was seen before `commanding`, and no daemon is armed.
  std::string other_commander() const;
  /// From now on commands on the channel are our own.
  void commanding() { commanding_ = true; }
  /// A daemon that is armed or pressurises the arm said so within the last second.
  bool daemon_armed(std::int64_t now_ns) const;
  /// Why a motion that a tool commands must end, for a person; empty where it may go on. A daemon
  /// is armed, no frame showed every segment for `lost_ns`, a segment bends beyond
  /// identification.max_theta_rad or moves faster than max_speed_radps.
  std::string beyond_limits(std::int64_t lost_ns) const;
  /// "ACTIVE (none)", or "not heard".
  std::string daemon_text() const;

 private:
  void take_packet(std::size_t channel, const ReceivedMessage& packet);
  void take_frame(std::int64_t arrival_ns);
  void note_ids(std::span<const std::byte> bytes);
  void take_pressures(const ReceivedMessage& packet);

  struct Bent {
    std::int64_t arrival_ns;
    Eigen::VectorXd u_rad;
  };

  const Experiment& experiment_;
  bool keep_;
  bool commanding_ = false;
  MocapSource mocap_, in_other_order_;
  CurvatureEstimator estimator_;
  Observation seen_;
  std::set<int> known_ids_;
  Eigen::VectorXd u_rad_;
  std::deque<Bent> recent_;
  std::int64_t whole_frame_ns_ = kNever, captured_ns_ = kNever;
  std::int64_t last_number_ = kNever;
  std::int64_t status_ns_ = kNever;
  std::vector<double> measured_bar_;
  MocapFrame frame_, other_frame_;
  CurvatureEstimate estimate_;
  softarm_messages::pressure_measurement_t measurement_message_;
  softarm_messages::pressure_command_t command_message_;
  softarm_messages::controller_status_t status_, newest_status_;
};

}  // namespace softarm
