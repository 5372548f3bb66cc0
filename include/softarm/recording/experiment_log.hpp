// The files of an experiment: log.csv while it runs, summary.json and timing.json at its end.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "softarm/base/histogram.hpp"
#include "softarm/base/output_file.hpp"
#include "softarm/config/experiment.hpp"
#include "softarm/runtime/log_row.hpp"

namespace softarm {

/// Writes FOLDER/log.csv, one row per tick.
class ExperimentLog {
 public:
  /// @param inputs  files that are read beside the experiment's
  /// @throws OutputIsInput, OutputError if the folder or the file cannot be made
  ExperimentLog(const std::filesystem::path& folder, const Experiment& experiment,
                const Files& inputs = {});

  /// Appends a row. @throws OutputError if it could not be written (a full disk); whole rows are
  /// kept
  void add(const LogRow& row);

  /// Flushes and closes. @throws OutputError if anything could not be written
  void close() { file_.commit(); }

 private:
  void cell(double value);
  template <class Values>
  void cells(const Values& values, Eigen::Index first, Eigen::Index count);

  OutputFile file_;
  int segments_;
  bool stretches_;
  int chambers_;
  std::string line_;
};

/// summary.json and timing.json of a run. Opened before it, with space for them: a disk that fills
/// up meanwhile does not take them.
class SummaryFiles {
 public:
  /// @throws OutputIsInput, OutputError
  SummaryFiles(const std::filesystem::path& folder, const Experiment& experiment,
               const Files& inputs = {});
  /// @throws OutputError
  void write(const std::string& summary, const std::string& timing);

 private:
  OutputFile summary_, timing_;
};

/// The files of an experiment and `more`: what none of its outputs may replace.
Files inputs_of(const Experiment& experiment, const Files& more);

/// The line `# softarm VERSION commit ...` at the start of every log.
std::string provenance_line(const Experiment& experiment);

/// Durations of a run for timing.json.
struct TimingReport {
  double real_time_factor = 0.0;  ///< simulated over wall time; 1 for the daemon
  /// A histogram with its name in the file.
  struct Named {
    const char* name;
    DurationCounts counts;
    double max_us;
  };
  std::vector<Named> histograms;
};
/// The text of timing.json: quantiles, maxima and counts of all histograms, in us.
std::string timing_json(const TimingReport& report);

}  // namespace softarm
