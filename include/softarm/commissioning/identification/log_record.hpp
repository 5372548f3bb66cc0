// A recorded LCM log as a motion to identify from.
#pragma once

#include <filesystem>
#include <string>

#include "softarm/commissioning/identification/motion_record.hpp"
#include "softarm/config/experiment.hpp"

namespace softarm {

/// The pressures that drive the model.
enum class LoggedInput {
  commanded,  ///< set points, held from one to the next; including commands of a shadow
  measured    ///< sensor readings, interpolated linearly
};

/// The motion in a log.
struct LoggedMotion {
  MotionRecord record;
  std::string damage;  ///< what was not used, for a person; empty: the log is intact
  std::string notes;   ///< what was bridged: the logger's clock was set, nothing was logged
};

/// Reads frames and pressures of the experiment's channels; times are those of LogTimeline, in s
/// since the first frame. Frames that are repeated or do not show every segment are left out.
/// Everything before and after damage is used. Where pressures or frames are missing for so long
/// that the motion is not known from them, the longest part between such gaps is used, and the rest
/// reported as damage.
/// @throws std::runtime_error if the log cannot be read or contains too few frames or pressures
LoggedMotion read_log(const Experiment& experiment, const std::filesystem::path& log,
                      LoggedInput input);

}  // namespace softarm
