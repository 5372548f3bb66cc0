// The elongation that a reference can have: what is asked for, as far as pressures that push can give
// it while they bend the arm.
#pragma once

#include <vector>

#include "softarm/actuation/pressure_allocator.hpp"
#include "softarm/control/reference.hpp"
#include "softarm/model/arm.hpp"
#include "softarm/model/dynamics.hpp"
#include "softarm/model/model_correction.hpp"
#include "softarm/runtime/settings.hpp"

namespace softarm {

/// e (n, m) at rest in the straight pose with this pressure in all chambers and gravity: with the bias
/// pressure the natural elongation of segments that stretch. Zero for segments that do not. For load
/// time: allocates. @throw std::invalid_argument where k_a or beta_a of a segment is not positive.
SegmentScalars straight_elongation(const ArmParameters& arm, const ActuationSettings& actuation,
                                   double pressure_bar);

/// Follows the reference of an arm whose segments stretch and replaces e, e', e'' of its samples by
/// those of an axial spring and damper under the axial force N that the chambers can give:
///
///   beta_a e' = N - k_a e - I(q_ref),   N = within_reach(tau_ref, k_a e_w + beta_a e_w' + I(q_ref))
///
/// with e_w what is asked for, tau_ref what (17) asks for on the reference, I the e row of B u'' +
/// C u' + G, and within_reach() as in AxialChamberMap: bending first, and smooth, so that N and with
/// it the moment that e'' makes have no kinks where a pressure reaches zero. Inertia along e is part
/// of I, with the latest e''. Where bending decides about N, e'' follows the derivative of this with a
/// lag of m / beta_a, some milliseconds, with m as if the straight arm's segments stretched alike.
///
/// What is within reach is followed as asked (an initial difference fades with k_a / beta_a); where
/// bending asks for more axial force than e_w does, the reference stretches as the arm will, so that
/// (17) feeds it forward. O(n) a call, no allocation, no clock.
class ElongationReference {
 public:
  /// @param allocator of an arm whose segments stretch; kept
  ElongationReference(const ArmParameters& arm, const ActuationSettings& actuation,
                      const PressureAllocator& allocator);

  /// From e and at rest, at `time_s`. @param q 3n
  void start(double time_s, ConstVectorRef q) noexcept;

  /// On to `time_s`, with the reference as asked for at and around that time, and e of all three
  /// samples replaced. @param window that of Reference, `lookahead_s` > 0
  /// @param correction of the arm, or null: what is within reach is that of the corrected arm, with
  /// the unknown forces where (17) compensates them, too (`forces`)
  void advance(double time_s, double lookahead_s, ReferenceWindow& window,
               const ModelCorrection* correction = nullptr, bool forces = false) noexcept;

  /// Replaces e of a sample of any time near that advanced to.
  void replace(double time_s, ReferenceSample& sample) const noexcept;

  /// The axial force of segments that do not stretch: that of the bias pressures.
  void hold_constant_lengths(SegmentVector& tau_actuation_nm) const noexcept;

  /// How far before and after now the reference is needed, s, at least.
  static constexpr double kLookahead_s = 2.5e-3;

 private:
  void force_beside_spring(double time_s, const ReferenceSample& sample,
                           const ModelCorrection* correction, bool forces,
                           bool exact = false) noexcept;

  ArmParameters arm_;
  const PressureAllocator& allocator_;
  DynamicsWorkspace workspace_;
  HorizontalLoad horizontal_;
  double time_s_ = 0.0;
  SegmentScalars e_, rate_, acceleration_, jerk_;      ///< at time_s_
  SegmentScalars force_, force_before_, force_after_;  ///< N - I
  SegmentScalars follows_;                             ///< dN / d(what is asked of N), 0 to 1
  SegmentScalars stiffness_, damping_;                 ///< k_a and beta_a, corrected
  SegmentScalars carried_kg_;                          ///< m of the lag of e''
  ReferenceSample sample_;
  SegmentVector tau_, along_x_, along_y_;
  SegmentScalars bias_n_;
};

}  // namespace softarm
