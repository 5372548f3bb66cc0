// What an experiment leaves behind: log.csv while it runs, summary.json and timing.json at its end.
#pragma once

#include <array>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "softarm/actuation/pressure_allocator.hpp"
#include "softarm/config/experiment.hpp"
#include "softarm/daemon/histogram.hpp"
#include "softarm/daemon/safety_monitor.hpp"
#include "softarm/estimation/frame_validator.hpp"

namespace softarm {

class JsonWriter;

/// One tick. Vectors may be left empty where a quantity is not known; its cells stay empty.
struct LogRow {
  double t_s = 0.0;
  Mode mode = Mode::init;
  Reason reason = Reason::none;
  bool saturated = false;
  double frame_age_s = std::numeric_limits<double>::quiet_NaN();
  SegmentVector u, velocity, reference, truth;        ///< 2n each, rad and rad/s
  SegmentVector tau_actuation;                        ///< 2n, N m
  SegmentVector residual_twist, residual_length;      ///< n each, rad and m
  PressureVector commanded, real;                     ///< bar
  std::optional<Eigen::Vector3d> tip, tip_reference;  ///< m, world
};

/// How well a reference was tracked, accumulated tick by tick: reference minus the plant's true u,
/// from `tracking_from_s` after each ACTIVE on.
class TrackingSummary {
 public:
  TrackingSummary(int segments, double tracking_from_s);

  void add(const LogRow& row, double period_s);

  /// Tells what became of the frames; without it the summary does not speak of them.
  void set_frames(const FrameCounters& frames, std::int64_t late) {
    frames_ = frames;
    late_frames_ = late;
  }

  double duration_s() const { return ticks_ > 0 ? last_t_s_ - first_t_s_ : 0.0; }

  /// As JSON; byte-identical for identical rows.
  std::string json() const;

  /// Every change of mode, in order; at most kMaxTransitions of them.
  struct Transition {
    double t_s;
    Mode mode;
    Reason reason;
  };
  static constexpr std::size_t kMaxTransitions = 10'000;
  const std::vector<Transition>& transitions() const { return transitions_; }

  /// A table for people.
  std::string table() const;

 private:
  struct MeanSquare {
    double sum = 0.0;
    std::int64_t count = 0;
    void add(double error) {
      sum += error * error;
      ++count;
    }
    double rms() const;  ///< NaN when empty
  };
  void add_tracking(const LogRow& row);
  void write_tracking(JsonWriter& json) const;
  void write_frames(JsonWriter& json) const;

  int segments_;
  double tracking_from_s_;
  double active_since_s_ = std::numeric_limits<double>::quiet_NaN();
  double first_t_s_ = std::numeric_limits<double>::quiet_NaN();
  double last_t_s_ = 0.0;
  std::int64_t ticks_ = 0;
  std::int64_t active_ticks_ = 0;
  std::int64_t saturated_ticks_ = 0;
  MeanSquare u_;
  double u_max_rad_ = std::numeric_limits<double>::quiet_NaN();
  std::vector<MeanSquare> u_of_segment_, theta_, phi_;
  std::vector<std::pair<double, double>> tip_squared_;  ///< time and squared error, for the halves
  double pressure_max_bar_ = 0.0;
  std::array<double, 6> mode_s_{};
  std::vector<Transition> transitions_;
  std::optional<FrameCounters> frames_;
  std::int64_t late_frames_ = 0;
};

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
