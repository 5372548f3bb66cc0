// The steps of softarm commission.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "softarm/commissioning/identification/fit_report.hpp"

namespace softarm {

/// What a step did.
struct StepOutcome {
  int code = 0;            ///< of the program, kExitOk where the next step may begin
  std::string found = {};  ///< one line for the report
  std::string next = {};   ///< what to do, where it may not
};

struct CommissionSettings {
  std::filesystem::path config, folder;
  double rest_s = 5.0, track_s = 10.0;
  GainSharing gains = GainSharing::arm;

  std::filesystem::path calibrated() const { return folder / "calibrated.yaml"; }
  std::filesystem::path identified() const { return folder / "identified.yaml"; }
  /// Of a motion, "bend" or "track".
  std::filesystem::path motion(const std::string& name) const { return folder / (name + ".yaml"); }
};

struct CommissionStep {
  const char* name;
  const char* what;                                                 ///< it does
  bool moves;                                                       ///< the arm
  std::filesystem::path (*begins_with)(const CommissionSettings&);  ///< an experiment
  StepOutcome (*run)(const CommissionSettings&);
};

/// In the order in which they are done.
const std::vector<CommissionStep>& commission_steps();

}  // namespace softarm
