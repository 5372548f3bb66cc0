// The tracking errors of an experiment: the numbers of summary.json.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "softarm/estimation/frame_validator.hpp"
#include "softarm/model/arm.hpp"
#include "softarm/runtime/log_row.hpp"

namespace softarm {

/// Tracking errors, accumulated tick by tick: reference minus the true u of the plant, beginning
/// `tracking_from_s` after each entry into ACTIVE. For a reference that is a path of the tip, also
/// when the tip came near it.
class TrackingSummary {
 public:
  /// @param segments  number n of segments
  /// @param tracking_from_s  time in ACTIVE before errors count, s
  TrackingSummary(int segments, double tracking_from_s);

  /// Declares that commands are moments (N m), not pressures (bar).
  void commands_are_torques() { torques_ = true; }

  /// Adds what a plot needs to place the arm in the world: lengths and base.
  void set_arm(const ArmParameters& arm) { arm_ = arm; }

  /// Adds one tick. @param period_s  of the tick
  void add(const LogRow& row, double period_s);

  /// Adds the frame counters to the summary, which otherwise does not contain them.
  /// @param late  frames that arrived too late
  void set_frames(const FrameCounters& frames, std::int64_t late) {
    frames_ = frames;
    late_frames_ = late;
  }

  /// A tip nearer than this to its path has arrived.
  static constexpr double kTipNear_m = 0.01;

  /// Time from the first row to the end of the last, s.
  double duration_s() const { return ticks_ > 0 ? last_t_s_ - first_t_s_ : 0.0; }

  /// The text of summary.json; byte-identical for identical rows.
  std::string json() const;

  /// A change of mode.
  struct Transition {
    double t_s;
    Mode mode;
    Reason reason;
  };
  static constexpr std::size_t kMaxTransitions = 10'000;
  /// The changes of mode in order, the first kMaxTransitions of them.
  const std::vector<Transition>& transitions() const { return transitions_; }

  /// Root mean square and largest error of a component of u (rad), of the tip (m); NaN where there
  /// was none.
  double u_rms_rad() const { return u_.rms(); }
  double u_max_rad() const { return u_max_rad_; }
  double tip_rms_m() const { return tip_.since(-std::numeric_limits<double>::infinity()).rms(); }
  /// Of a model-based observer in ACTIVE: the mean of its innovations' squares, a component, and the
  /// part of the time in which they were too large; NaN where there was none.
  double nis() const { return nis_sum_ / static_cast<double>(observed_ticks_); }
  double surprised_fraction() const {
    return static_cast<double>(surprised_ticks_) / static_cast<double>(observed_ticks_);
  }

  /// The newest report of a model-based observer in ACTIVE, if there was one.
  const std::optional<ObserverReport>& observer() const { return observer_; }

  /// The summary as a table for a person.
  std::string table() const;

 private:
  struct MeanSquare {
    double sum = 0.0;
    std::int64_t count = 0;
    void add(double error) {
      sum += error * error;
      ++count;
    }
    void add(const MeanSquare& other) {
      sum += other.sum;
      count += other.count;
    }
    double rms() const;  ///< NaN when empty
  };
  /// Squared errors of the tip in intervals, so that those of the second half of the run can be
  /// summed although its beginning is not known before the end. At first an interval is one row;
  /// whenever there are too many, neighbours are merged in pairs.
  class TipErrors {
   public:
    void add(double t_s, double error_m);
    MeanSquare since(double t_s) const;  ///< of the intervals that begin at t_s or later

   private:
    static constexpr std::size_t kMostStretches = 65'536;
    struct Stretch {
      double begin_s;
      MeanSquare errors;
    };
    std::vector<Stretch> stretches_;
    std::int64_t rows_a_stretch_ = 1;
  };
  struct Json;  ///< makes the parts of json()
  void add_tracking(const LogRow& row);
  void add_elongation(const LogRow& row);
  void add_observer(const ObserverReport& report);
  std::string observer_table() const;
  void add_tip(const LogRow& row);
  std::string tip_line() const;

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
  std::vector<MeanSquare> elongation_;  ///< of segments that stretch
  double elongation_max_m_ = 0.0;       ///< largest error of one
  TipErrors tip_;
  double tip_max_m_ = std::numeric_limits<double>::quiet_NaN();
  bool tip_is_asked_ = false;    ///< the reference was a path of the tip
  double tip_last_far_s_ = 0.0;  ///< after the latest ACTIVE: when the tip was last kTipNear_m off
  double tip_last_s_ = 0.0;
  std::optional<ObserverReport> observer_;
  std::vector<MeanSquare> disturbance_;  ///< of every segment, N m
  double disturbance_max_nm_ = 0.0, nis_sum_ = 0.0;
  std::int64_t observed_ticks_ = 0, surprised_ticks_ = 0, wrong_model_ticks_ = 0;
  double command_max_ = 0.0;  ///< bar, or N m
  bool torques_ = false;
  std::array<double, 6> mode_s_{};
  std::vector<Transition> transitions_;
  std::optional<FrameCounters> frames_;
  std::int64_t late_frames_ = 0;
  std::optional<ArmParameters> arm_;
};

}  // namespace softarm
