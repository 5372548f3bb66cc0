// The command line of softarm identify.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>
#include <vector>

#include "softarm/commissioning/identification/coverage.hpp"
#include "softarm/commissioning/identification/fit_report.hpp"
#include "softarm/commissioning/identification/identify.hpp"
#include "softarm/commissioning/identification/log_record.hpp"

namespace softarm {

struct IdentifyCommand {
  std::string config, output, out;
  std::vector<std::string> logs, held_out;  ///< to identify from, and to judge by
  std::string damage;                       ///< of the log, found while it is read
  LoggedInput input = LoggedInput::commanded;
  FitChoice choice;
  StepPlan plan;
  CoverageStudy study;
  IdentifyOptions options;
  double from_s = 0.0, to_s = 0.0, skip_s = 0.0, apart_s = 0.0;
  std::uint64_t seed = 0;
  bool has_seed = false, has_hold = false, no_lag = false, no_delay = false;
  bool no_stiffness = false, no_damping = false, no_inertia = false;
  bool linear = false, predict = false, compare = false, coverage = false, live = false;
  bool choose = false, stretch = false;
};

/// Adds every option of `softarm identify` to the sub-command; they are stored in `options` when
/// the command line is parsed.
void add_identify_options(CLI::App& command, IdentifyCommand& options);

}  // namespace softarm
