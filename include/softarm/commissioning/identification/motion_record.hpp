// A motion of an arm as it was seen, and what was asked of its valves meanwhile.
#pragma once

#include <Eigen/Core>

namespace softarm {

/// What acts on the arm: bar of every chamber, or tau_A in N m with actuation by torque.
struct InputTrack {
  Eigen::VectorXd time_s;  ///< ascending
  Eigen::MatrixXd value;   ///< a row for every time
  bool held = true;  ///< set points hold until the next one; measurements lie on straight lines
};

struct MotionRecord {
  Eigen::VectorXd time_s;  ///< of the frames that showed every segment, ascending
  Eigen::MatrixXd u_rad;   ///< a row for every frame, 2n columns
  InputTrack input;
  double scored_from_s = 0.0;  ///< frames before are simulated, but not compared

  /// The frames from `from_s` until before `to_s`, whose simulation starts `lead_s` earlier.
  MotionRecord part(double from_s, double to_s, double lead_s) const;
  /// Without the frames that come less than `apart_s` after the last one kept.
  MotionRecord thinned(double apart_s) const;
};

/// What a first-order lag after a dead time makes of a track; exact for steps and straight lines.
class LaggedInput {
 public:
  /// Starts settled at the first value.
  LaggedInput(const InputTrack& track, double lag_s, double dead_time_s);

  /// The value at `t_s`, which must not decrease from call to call. Where it jumps (without a
  /// lag): after the jump, or before it.
  void at(double t_s, Eigen::Ref<Eigen::VectorXd> out, bool before = false);

 private:
  void advance(double t_s);

  const InputTrack& track_;
  double lag_s_, dead_time_s_;
  double now_s_;
  Eigen::Index index_ = 0;  ///< the last sample that has been reached
  Eigen::VectorXd state_;
};

}  // namespace softarm
