// What repeats along a periodic reference: learnt by its phase, and compensated before it is seen.
#pragma once

#include <Eigen/Core>

#include "softarm/control/settings.hpp"
#include "softarm/model/arm.hpp"
#include "softarm/model/model_correction.hpp"

namespace softarm {

/// The disturbance d that the observer finds is late by what it averages over. Of what repeats with
/// the reference it is known what comes next: a table over the phase of the reference has
///   w = d a lead later - d,
/// and d is raised by w before it is cancelled. w follows what is seen with the part kGain a period,
/// as linear interpolation between kNodes nodes; the weight of a node is that of the interpolation,
/// even about it, so the mean has no phase. What does not move leaves nothing.
///
/// The observer knows what is commanded: on an arm as its (corrected) model, d does not depend on w,
/// and w converges. Where the moments are off by the part D, d has D w in it, and the difference of
/// two instants at most 2 D w: w still converges for D < 1/2 at any frequency (small gain; the mean
/// is at most 1). w of a period follows from the periods before it: within one it is a force known
/// beforehand, which changes no margin of the loop.
///
/// Nothing is learnt in the first period, in which the reference is joined. |w| is at most kLargest
/// times the torque that bends the segment by 1 rad (along e: times sqrt(k k_a)).
///
/// Iterative learning along the phase (Bristow, Tharayil, Alleyne, IEEE Control Systems 26(3), 2006)
/// with the disturbance observer's estimate in place of the error, and a lead for its lag (Longman,
/// Int. J. Control 73(10), 2000). O(n) a tick; allocates at construction alone.
class RepetitiveCompensation {
 public:
  static constexpr int kNodes = 64;        ///< of a period
  static constexpr double kGain = 0.3;     ///< of what is seen, a period
  static constexpr double kLargest = 0.1;  ///< of w

  /// `step_s` from tick to tick. Does nothing before start().
  RepetitiveCompensation(const ArmParameters& arm, double lead_s, double step_s);

  /// Forgets everything. From here on the reference repeats after period_s; 0: it does not, and
  /// nothing is learnt or added.
  void start(double period_s) noexcept;

  /// One tick, `time_s` after start(), in order: adds w to what was found. @param learn whether what
  /// is seen now counts: not while pushed, saturated or surprised
  void advance(double time_s, bool learn, ModelCorrection& found) noexcept;

 private:
  struct Place {
    int before, after;  ///< nodes
    double part;        ///< of the way from the one to the other
  };
  Place place(double time_s) const noexcept;
  void follow(double time_s) noexcept;

  double step_s_;
  Eigen::Index ticks_;  ///< of the lead
  double period_s_ = 0.0;
  bool stretches_;
  int segments_;
  SegmentVector largest_, now_, target_;  ///< as u, and with e of segments that stretch
  Eigen::MatrixXd table_;                 ///< w, a column a node
  Eigen::MatrixXd seen_;                  ///< d of the last ticks_, a column each
  Eigen::Index next_ = 0;                 ///< the oldest of these, and where the next one goes
  Eigen::Index in_row_ = 0;               ///< ticks that count, up to ticks_
};

}  // namespace softarm
