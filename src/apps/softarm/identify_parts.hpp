// What the parts of `softarm identify` share.
#pragma once

#include <optional>
#include <vector>

#include "apps/softarm/identify_options.hpp"
#include "softarm/base/output_file.hpp"
#include "softarm/commissioning/identification/refinement.hpp"

namespace softarm {

/// Of this machine.
int identify_threads();

/// One motion as asked for: `--from`, `--to`, `--skip`, `--apart`; damage is added to the command.
MotionRecord record_of(const Experiment& experiment, const std::string& log,
                       IdentifyCommand& command);
/// All to identify from: logs, or steps on the running or simulated arm.
std::vector<MotionRecord> records_of(const Experiment& experiment, IdentifyCommand& command);

/// The files to write; opened before the arm moves, so that a wrong name is refused before.
struct Findings {
  std::optional<OutputFile> residuals, experiment;

  Findings(const Experiment& of, const IdentifyCommand& command);
};

/// Writes them and prints where they are.
void write_findings(const Experiment& experiment, const IdentifyCommand& command,
                    const ArmHypothesis& arm, const Refinement& fit, Findings& findings);

/// Prints how well an arm that stretches predicts the lengths of its segments; nothing of one that
/// does not, or where they were not recorded.
void print_lengths(const ArmHypothesis& arm, const Experiment& experiment, MotionRecord record,
                   const std::string& what);
/// Prints how well an arm predicts the logs that were held out.
void print_held_out(const ArmHypothesis& arm, const Experiment& experiment,
                    const std::vector<MotionRecord>& held_out, const IdentifyCommand& command);
/// --choose-terms.
int choose_terms(const Experiment& experiment, IdentifyCommand& command,
                 const std::vector<MotionRecord>& records,
                 const std::vector<MotionRecord>& held_out, Findings& findings);

}  // namespace softarm
