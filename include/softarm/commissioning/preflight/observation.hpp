// What a pre-flight check looks at: frames, pressures and pulses with their times, nothing that is
// live.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "softarm/estimation/mocap_frame.hpp"

namespace softarm {

/// One motion-capture frame as it came.
struct SeenFrame {
  std::int64_t arrival_ns = 0;  ///< our monotonic clock
  std::int64_t sender_us = 0;   ///< the sender's stamp
  std::int64_t number = 0;
  std::vector<BodyPose> body;  ///< n + 1 as configured, the base first
  /// The same with the quaternions read in the order that is not configured.
  std::vector<BodyPose> in_other_order;
};

/// Pressures as the valve side measured them.
struct SeenPressures {
  std::int64_t arrival_ns = 0;
  std::vector<double> bar;  ///< every chamber, order of the command
};

/// One chamber filled softly, held and vented, all others at their least. Times are of our
/// monotonic clock.
struct Pulse {
  int segment = 0;  ///< counted from 0
  int chamber = 0;  ///< of the segment, counted from 0
  int valve = 0;    ///< of the command, counted from 0
  double pressure_bar = 0.0;
  std::int64_t before_ns = 0;  ///< from here to start_ns the arm hung still
  std::int64_t start_ns = 0;   ///< the pressure began to rise
  std::int64_t held_ns = 0;    ///< from here to end_ns it was held and the arm had settled
  std::int64_t end_ns = 0;     ///< it began to fall
};

/// All that was seen.
struct Observation {
  std::int64_t start_ns = 0;          ///< listening began
  std::int64_t rest_end_ns = 0;       ///< up to here nothing was commanded by us
  std::vector<std::string> channels;  ///< of motion capture
  std::vector<SeenFrame> frames;
  std::vector<SeenPressures> pressures;
  std::vector<Pulse> pulses;
  std::vector<int> other_ids;        ///< bodies on the channel that the configuration does not name
  std::int64_t not_frames = 0;       ///< packets on the channel that are no frame
  bool commanded_by_others = false;  ///< somebody else commanded pressures while we listened
  std::int64_t wall_minus_ns = 0;    ///< wall clock minus our monotonic clock
};

}  // namespace softarm
