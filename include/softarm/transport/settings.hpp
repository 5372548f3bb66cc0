// Settings of the transport: LCM's network and channels, and the meaning of motion-capture
// messages. config/template.yaml documents every setting.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "softarm/estimation/clock_relation.hpp"
#include "softarm/transport/mocap_format.hpp"

namespace softarm {

/// LCM provider and channels; two arms on one machine need different ones.
struct LcmSettings {
  std::string url = "udpm://239.255.76.67:7667?ttl=0";
  std::string mocap_channel = "SOFTARM_MOCAP";
  std::string command_channel = "SOFTARM_PRESSURE_COMMAND";
  std::string measurement_channel = "SOFTARM_PRESSURE";
  std::string reference_channel = "SOFTARM_REFERENCE";
  std::string operator_channel = "SOFTARM_OPERATOR";
  std::string status_channel = "SOFTARM_STATUS";
  std::string timing_channel = "SOFTARM_TIMING";
  std::string observer_channel = "SOFTARM_OBSERVER";
  std::string tick_channel = "SOFTARM_TICK";
  std::string valves_channel = "SOFTARM_VALVES";
  std::string plant_channel = "SOFTARM_PLANT";
  std::string deadman_channel;
  std::string tip_channel = "SOFTARM_TIP_TARGET";
  std::string law_state_channel = "SOFTARM_LAW_STATE";
  std::string law_channel = "SOFTARM_LAW";
};

/// Where the server of a source without LCM is.
struct MocapNetworkSettings {
  std::string host = "127.0.0.1";         ///< IPv4 address of the server
  int port = 1510;                        ///< where it takes requests
  std::string local_address = "0.0.0.0";  ///< of our network card; 0.0.0.0: the system chooses
  std::string multicast = {};             ///< group of the frames; empty: unicast
  int data_port = 1511;                   ///< of the frames by multicast
  std::string version = {};               ///< of the protocol
};

/// Meaning of the numbers in a frame.
struct MocapSourceSettings {
  MocapSourceKind source = softarm_mocap();
  LengthUnit unit = LengthUnit::metre;
  QuaternionOrder quaternion = QuaternionOrder::wxyz;
  /// p_world = axes * p_sent: from the sender's world to ours, whose z axis points up.
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  MocapNetworkSettings network = {};
};

/// A marker frame: the pose of the segment frame S_i in the frame of the rigid body that is
/// tracked.
struct MarkerFrameSettings {
  std::string name;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  /// Rotation vector of S_i in the body's frame: R_world_S = R_world_body exp(rotation^).
  Eigen::Vector3d rotation_rad = Eigen::Vector3d::Zero();

  /// Equal in every field.
  bool operator==(const MarkerFrameSettings&) const = default;
};

/// The channel of a body where every body has a separate one (MocapSourceKind::rigid_transform).
inline std::string body_channel(const LcmSettings& lcm, const MarkerFrameSettings& frame) {
  return lcm.mocap_channel + "_" + frame.name;
}

/// Which bodies of the motion-capture frame carry the base and the segment ends.
struct BodySettings {
  int base_id = 0;                             ///< -1: the base is fixed by arm.base
  std::vector<int> segment_ids;                ///< n ids, from the base to the tip
  MarkerFrameSettings base_marker_frame = {};  ///< unused where the base is fixed
  std::vector<MarkerFrameSettings> segment_marker_frames =
      {};  ///< n, or none: S_i are then the body frames
};

/// Connections of softarmd.
struct TransportSettings {
  LcmSettings lcm;
  MocapSourceSettings mocap;
  BodySettings bodies;
  /// How the capture time of a frame is converted to our monotonic clock; safety.frame_latency_s is
  /// the declared latency in both modes.
  ClockMode capture_time = ClockMode::sender;
};

}  // namespace softarm
