// What an experiment leaves behind: log.csv while it runs, summary.json and timing.json at its end.
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

/// Writes DIR/log.csv.
class ExperimentLog {
 public:
  /// @throws std::runtime_error if the folder or the file cannot be made
  ExperimentLog(const std::filesystem::path& folder, const Experiment& experiment);

  void add(const LogRow& row);

  /// Flushes; @throws std::runtime_error if anything could not be written (a full disk).
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

/// The `# softarm VERSION commit ...` line that every log begins with.
std::string provenance_line(const Experiment& experiment);

/// Durations of a run for timing.json.
struct TimingReport {
  double real_time_factor = 0.0;  ///< simulated over wall time; 1 for the daemon
  struct Named {
    const char* name;
    DurationCounts counts;
    double max_us;
  };
  std::vector<Named> histograms;
};
std::string timing_json(const TimingReport& report);

/// @throws std::runtime_error if the file cannot be written
void write_text(const std::filesystem::path& path, const std::string& text);

}  // namespace softarm
