// A recorded LCM log as a motion to identify from.
#pragma once

#include <filesystem>
#include <string>

#include "softarm/commissioning/identification/motion_record.hpp"
#include "softarm/config/experiment.hpp"

namespace softarm {

/// Which pressures drive the model.
enum class LoggedInput {
  commanded,  ///< set points, held from one to the next; commands in shadow count too
  measured    ///< what sensors read, on straight lines between readings
};

struct LoggedMotion {
  MotionRecord record;
  std::string damage;  ///< what of the log was not used, for people; empty: it is whole
};

/// Frames and pressures of the experiment's channels; times in s since the first frame. Frames that
/// are repeated, or do not show every segment, are left out. What precedes and follows damage is
/// used.
/// @throws std::runtime_error where the log cannot be read or holds too little of either
LoggedMotion read_log(const Experiment& experiment, const std::filesystem::path& log,
                      LoggedInput input);

}  // namespace softarm
