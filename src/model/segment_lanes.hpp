// What the recursion of inverse_dynamics needs of four neighbouring segments before it knows how
// their frames move: one lane a segment, everything in the segment's own S_{i-1}.
#pragma once

#include "model/arc_moments.hpp"

namespace softarm {

/// The acceleration of a curve's point (P u, Q) within S_{i-1}, twice along a and b and once along
/// x; `spin` likewise is the angular one. What the frame's own motion adds is in the recursion.
struct SegmentLanes {
  Lanes ux, uy, c0;
  Lanes mass;
  CurveOf<Lanes> tip, centre;
  SpinOf<Lanes> turn_rate;
  DirectionOf<Lanes> a, b;
  Vec3<Lanes> spin_a, spin_b;  ///< angular velocity of S_i relative to S_{i-1} along a, b
  Vec3<Lanes> own_tip, own_centre, own_spin;
  /// Distributed mass: moments of the arc, and the integrals of P, Q and (P1 u, Q1) times the
  /// acceleration within S_{i-1}.
  ArcMomentsOf<Lanes> arc;
  Vec3<Lanes> own_p, own_q;
  Lanes own_stretch;
};

/// Inputs of inverse_dynamics, 2n numbers each.
struct BilinearInputs {
  const double* u;
  const double* a;
  const double* b;
  const double* x;
};

}  // namespace softarm
