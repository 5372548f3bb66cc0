// The first day with an arm, step by step (softarm commission): what has been done, and the
// experiments that later steps run.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "softarm/config/experiment.hpp"

namespace softarm {

/// Steps done in a folder, with what they found, in FOLDER/journal.txt: one line each. A step counts
/// as done while the experiment that it began with is the same.
class Journal {
 public:
  /// A step that is done.
  struct Entry {
    std::string step;
    std::uint64_t experiment = 0;  ///< Experiment::hash
    std::string found;             ///< one line
  };

  /// Reads what is there; a line that is none is left out. @throws OutputError without a folder
  explicit Journal(const std::filesystem::path& folder);

  /// Whether a step has been done in this folder.
  static bool is_in(const std::filesystem::path& folder);

  /// What the step found with this experiment; nullptr if it has not been done.
  const Entry* find(std::string_view step, std::uint64_t experiment) const;
  /// Notes a step and forgets those that were noted after it. @throws OutputError
  void note(const Entry& entry);
  const std::vector<Entry>& entries() const { return entries_; }

 private:
  std::filesystem::path file_;
  std::vector<Entry> entries_;
};

/// The bend of a first motion and of a first tracked trajectory (rad): 0.2 and 0.3, or a quarter and
/// three eighths of control.max_theta_rad where that is less.
double first_bend_rad(const Experiment& experiment);
double first_track_rad(const Experiment& experiment);

/// Time that `first_bend_yaml` takes, s.
double first_bend_s(const Experiment& experiment);
/// An experiment that includes `config` and bends one segment after the other, towards the side of
/// its first chamber, by first_bend_rad within 2 s, and back.
std::string first_bend_yaml(const Experiment& experiment, const std::string& config);
/// An experiment that includes `config` and follows the paper's (24) with first_track_rad.
std::string first_track_yaml(const Experiment& experiment, const std::string& config);

}  // namespace softarm
