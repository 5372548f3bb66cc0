// Input of the pre-run checks: recorded frames, pressures and pulses with their times.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "softarm/base/time.hpp"
#include "softarm/estimation/mocap_frame.hpp"

namespace softarm {

/// One motion-capture frame as it was received.
struct SeenFrame {
  std::int64_t arrival_ns = 0;  ///< on our monotonic clock
  std::int64_t sender_us = 0;   ///< time stamp of the sender
  std::int64_t number = 0;
  std::vector<BodyPose> body;  ///< n + 1 as configured, the base first
  /// The same with the quaternions read in the order that is not configured (QuaternionOrder).
  std::vector<BodyPose> in_other_order;
  /// On our monotonic clock as the daemon takes it; kNever: arrival less the declared latency.
  std::int64_t capture_ns = kNever;
};

/// Pressures measured by the valves.
struct SeenPressures {
  std::int64_t arrival_ns = 0;
  std::vector<double> bar;  ///< of every chamber, in the order of the command
};

/// One chamber filled at low pressure, held and vented, with all others at their minimum. Times are
/// those of our monotonic clock.
struct Pulse {
  int segment = 0;  ///< counted from 0
  int chamber = 0;  ///< of the segment, counted from 0
  int valve = 0;    ///< of the command, counted from 0
  double pressure_bar = 0.0;
  std::int64_t before_ns = 0;  ///< from here to start_ns the arm was at rest
  std::int64_t start_ns = 0;   ///< the pressure began to rise
  std::int64_t held_ns = 0;    ///< from here to end_ns it was held and the arm had settled
  std::int64_t end_ns = 0;     ///< it began to fall
};

/// Everything observed during the checks.
struct Observation {
  std::int64_t start_ns = 0;          ///< listening began
  std::int64_t rest_end_ns = 0;       ///< up to here we commanded nothing
  std::vector<std::string> channels;  ///< of motion capture
  std::vector<SeenFrame> frames;
  std::vector<SeenPressures> pressures;
  std::vector<Pulse> pulses;
  std::vector<int> other_ids;        ///< bodies on the channel that the configuration does not name
  std::int64_t not_frames = 0;       ///< packets on the channels that are not frames
  bool commanded_by_others = false;  ///< another program commanded pressures
  std::int64_t wall_minus_ns = 0;    ///< wall clock minus our monotonic clock
};

}  // namespace softarm
