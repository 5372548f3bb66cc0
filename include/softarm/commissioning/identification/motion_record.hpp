// A measured motion of an arm, with the input that caused it.
#pragma once

#include <Eigen/Core>

namespace softarm {

/// The input of the arm over time: bar of every chamber, or tau_A in N m with actuation by torque.
struct InputTrack {
  Eigen::VectorXd time_s;  ///< ascending
  Eigen::MatrixXd value;   ///< one row per time
  bool held = true;        ///< true: held until the next sample; false: linear between samples
};

/// Measured u and input of a motion.
struct MotionRecord {
  Eigen::VectorXd time_s;  ///< of the frames that showed every segment, ascending
  Eigen::MatrixXd u_rad;   ///< one row per frame, 2n columns
  InputTrack input;
  double scored_from_s = 0.0;  ///< frames before this time are simulated, but not compared

  /// The frames within [from_s, to_s), with a simulation that starts `lead_s` earlier.
  MotionRecord part(double from_s, double to_s, double lead_s) const;
  /// The record without frames less than `apart_s` after the last one kept.
  MotionRecord thinned(double apart_s) const;
};

/// The response of a first-order lag after a dead time to a track; exact for steps and straight
/// lines.
class LaggedInput {
 public:
  /// Starts settled at the first value. @param track  must outlive this
  LaggedInput(const InputTrack& track, double lag_s, double dead_time_s);

  /// Writes the value at `t_s`, which must not decrease from call to call, to `out`. At a jump
  /// (without a lag): the value after the jump, or before it if `before`.
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
