// Where the segments' ends are, from how they are bent and how long they are.
#pragma once

#include <Eigen/Core>
#include <span>

#include "softarm/commissioning/identification/motion_record.hpp"

namespace softarm {

/// The bend of the chord beside that of the ends' frames. For a constant-curvature segment they are
/// the same; where a segment bends unevenly, or begins beside its marker frame, they are not, and the
/// positions that u gives are off by millimetres although u is right.
struct ChordMap {
  Eigen::MatrixX3d of_bend;  ///< 2n rows: a component of the chord's bend by [u_x, u_y, 1]

  /// u itself. @param segments  n
  static ChordMap identity(Eigen::Index segments);
  /// The chord's bend, 2n columns, rad.
  Eigen::MatrixXd bend_rad(const Eigen::MatrixXd& u_rad) const;
};

/// Twice the angle between chord and axis, as a vector like u: one row per frame, 2n columns, rad.
Eigen::MatrixXd chord_bends_rad(const Eigen::MatrixXd& chord_m);

/// Least squares over all frames compared.
ChordMap fit_chords(std::span<const MotionRecord> records);

/// Chords of constant-curvature segments, 3n columns, m. @param bend_rad  2n columns of the chord
/// @param length_m  n columns
Eigen::MatrixXd chords_m(const Eigen::MatrixXd& bend_rad, const Eigen::MatrixXd& length_m);

/// Origins of S_n in S_0, m, one row per row of `u_rad` (2n, of the frames) and `chord_m` (3n).
Eigen::MatrixX3d tips_m(const Eigen::MatrixXd& u_rad, const Eigen::MatrixXd& chord_m);

}  // namespace softarm
