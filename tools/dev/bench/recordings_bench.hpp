// Recordings of real arms: identified, and predicted where they were not seen.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "softarm/commissioning/identification/term_selection.hpp"

namespace softarm {

/// One recording that the arena knows, or an unseen one with the columns of one.
struct ArenaRecording {
  std::string name;
  std::string table;       ///< file in the folder of data
  std::string map;         ///< file in config/recordings
  std::string experiment;  ///< file in config
  double skip_s = 0.0;     ///< simulated and not compared: the chambers fill
  /// Whose rest window is the zero of this one too, and whose parameters predict it; empty: itself.
  std::string partner_of;
};

/// Errors of a prediction beside what moved, over the frames compared. Tips in S_0, m: lateral is
/// the RMS of the 2-vector across its z axis, axial that along.
struct ArenaScore {
  double u_rad = 0.0, motion_rad = 0.0;  ///< RMS of a component
  double lateral_m = 0.0, axial_m = 0.0;
  double motion_lateral_m = 0.0, motion_axial_m = 0.0;  ///< about the mean
  /// As the published twin of the four-column arm was judged: the mean motion over cycles of 10 s,
  /// its mean removed, after the best rotation about the axis. 0 where the input does not repeat so.
  double cycle_lateral_m = 0.0, cycle_axial_m = 0.0;
};

/// One model on one recording.
struct ArenaRow {
  std::string recording, model, what;  ///< what: "whole", "second by first", "by NAME"
  Eigen::Index parameters = 0;
  ArenaScore score;
  double seconds = 0.0;  ///< of the search
  bool converged = true;
};

/// Which terms one recording asked for.
struct ArenaChoice {
  std::string recording;
  SelectedModel bend, stretch;
};

/// Everything found in a folder.
struct ArenaReport {
  std::vector<ArenaRow> rows;
  std::vector<ArenaChoice> choices;
  std::vector<std::string> skipped;  ///< messages for a person
};

/// The known recordings, in the order of the report.
std::vector<ArenaRecording> known_recordings();

/// Settings of run_arena.
struct ArenaOptions {
  std::filesystem::path data;
  std::filesystem::path config;  ///< the folder config of the source tree or installation
  std::string only;              ///< recordings whose name contains this
  std::filesystem::path out;     ///< for the motions that the chosen model predicts; empty: none
  int threads = 1;
};

/// Identifies and predicts every recording in the folder. A file that is not known but has the
/// columns of one that is, is an unseen partner of it: predicted, never identified from.
ArenaReport run_arena(const ArenaOptions& options,
                      const std::function<void(const std::string&)>& progress);

std::string table(const ArenaReport& report);
std::string json(const ArenaReport& report);

}  // namespace softarm
