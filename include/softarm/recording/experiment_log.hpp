// The files of an experiment: log.csv while it runs, summary.json and timing.json at its end.
#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "softarm/base/histogram.hpp"
#include "softarm/config/experiment.hpp"
#include "softarm/runtime/log_row.hpp"

namespace softarm {

/// Writes FOLDER/log.csv, one row per tick.
class ExperimentLog {
 public:
  /// @throws std::runtime_error if the folder or the file cannot be made
  ExperimentLog(const std::filesystem::path& folder, const Experiment& experiment);

  /// Appends a row.
  void add(const LogRow& row);

  /// Flushes and closes. @throws std::runtime_error if anything could not be written (a full disk).
  void close();

 private:
  struct Closer {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  void cell(double value);
  void cells(const double* values, int count, int expected);

  std::filesystem::path path_;
  std::unique_ptr<std::FILE, Closer> file_;
  int segments_;
  int chambers_;
  std::string line_;
};

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

/// Writes a text file. @throws std::runtime_error if it cannot be written
void write_text(const std::filesystem::path& path, const std::string& text);

}  // namespace softarm
