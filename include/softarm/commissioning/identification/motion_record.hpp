// A measured motion of an arm, with the input that caused it.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "softarm/actuation/fill_vent_lag.hpp"

namespace softarm {

/// The input of the arm over time: bar of every chamber, or tau_A in N m with actuation by torque.
struct InputTrack {
  Eigen::VectorXd time_s;  ///< ascending
  Eigen::MatrixXd value;   ///< one row per time
  bool held = true;        ///< true: held until the next sample; false: linear between samples

  /// Measured samples averaged over spans of `span_s`; the first and the last stay. Held ones stay.
  InputTrack averaged(double span_s) const;
};

/// What is known of the lengths while the bend is identified.
struct KnownLengths {
  /// Length of every segment that pressures alone give, m: one row per frame, n columns; empty: not
  /// known.
  Eigen::MatrixXd pressed_m;
  double by_bend_m_per_rad2 = 0.0;  ///< what a bend adds, by |u|^2
};

/// Measured u and input of a motion.
struct MotionRecord {
  Eigen::VectorXd time_s;  ///< of the frames that showed every segment, ascending
  Eigen::MatrixXd u_rad;   ///< one row per frame, 2n columns
  /// Origin of S_i in S_{i-1}, m: one row per frame, 3n columns; empty: not recorded.
  Eigen::MatrixXd chord_m;
  KnownLengths lengths;  ///< by an elongation that was identified before
  InputTrack input;
  double scored_from_s = 0.0;  ///< frames before this time are simulated, but not compared
  /// RMS of a component of u that the noise configured for the frames explains; 0: not known.
  double noise_rad = 0.0;

  /// The frames within [from_s, to_s), with a simulation that starts `lead_s` earlier.
  MotionRecord part(double from_s, double to_s, double lead_s) const;
  /// The record without frames less than `apart_s` after the last one kept.
  MotionRecord thinned(double apart_s) const;
};

/// The length of every segment by its chord, as that of a constant-curvature segment whose chord has
/// this direction: |t| x / sin x with x the angle between chord and axis; m, one row per frame, n
/// columns.
Eigen::MatrixXd chord_lengths_m(const MotionRecord& record);

/// The response of a first-order lag after a dead time to a track. Exact for steps; for straight
/// lines exact where filling and venting take the same time, otherwise but for the sample in which
/// one becomes the other.
class LaggedInput {
 public:
  /// Starts settled at the first value. @param track  must outlive this
  LaggedInput(const InputTrack& track, double lag_s, double dead_time_s);
  /// @param lags  one per column of the track
  LaggedInput(const InputTrack& track, std::vector<FillVentLag> lags, double dead_time_s);

  /// Writes the value at `t_s`, which must not decrease from call to call, to `out`. At a jump
  /// (without a lag): the value after the jump, or before it if `before`.
  void at(double t_s, Eigen::Ref<Eigen::VectorXd> out, bool before = false);

 private:
  void advance(double t_s);

  const InputTrack& track_;
  std::vector<FillVentLag> lags_;
  double dead_time_s_;
  double now_s_;
  Eigen::Index index_ = 0;  ///< the last sample that has been reached
  Eigen::VectorXd state_;
};

}  // namespace softarm
