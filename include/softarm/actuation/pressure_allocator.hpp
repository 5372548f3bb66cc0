// From actuation torques to chamber pressures, and back.
//
// A chamber at angle chi with gain g adds -g p (cos chi, sin chi) to the generalized force f in u.
// With f = A_chamber tau_A that is tau_A = W p, one column w_j = g_j (sin chi_j, -cos chi_j) a
// chamber.
#pragma once

#include <array>
#include <vector>

#include "softarm/actuation/settings.hpp"
#include "softarm/model/arm.hpp"
#include "softarm/model/chambers.hpp"
#include "softarm/model/coordinates.hpp"

namespace softarm {

/// The chambers of one segment: which tau_A they can reach, and the pressures that give it.
/// `Dimension` is the number of torque components: two, or one in the plane of a planar arm.
template <int Dimension>
class ChamberMap {
 public:
  using Torque = std::array<double, Dimension>;
  using Pressures = std::array<double, kMaxChambersPerSegment>;

  ChamberMap() = default;
  /// columns: w_j (N m per bar), at most kMaxChambersPerSegment of them; limits and bias in bar.
  ChamberMap(const std::vector<Torque>& columns, double min_pressure_bar, double max_pressure_bar,
             double bias_pressure_bar);

  /// Number of chambers.
  int size() const noexcept { return size_; }
  /// Smallest distance (N m) from zero torque to a facet of the reachable set; negative: zero is
  /// outside the set.
  double weakest_torque_nm() const noexcept;
  /// Largest such distance (N m).
  double strongest_torque_nm() const noexcept;

  /// Largest s in [0, 1] for which s torque is reachable; exact, one pass over the facets of the
  /// zonotope W [p_min, p_max].
  double largest_scale(const Torque& torque_nm) const noexcept;

  /// The pressures nearest the bias (2-norm) among those in the box with W p = s torque. Returns s
  /// as above. A torque that is not finite counts as unreachable: s = 0.
  double allocate(const Torque& torque_nm, Pressures& pressures_bar) const noexcept;

  /// W p (N m) of `size()` pressures (bar).
  Torque torque(const double* pressures_bar) const noexcept;

 private:
  struct Facet {
    Torque normal{};      ///< unit, outward
    double offset = 0.0;  ///< normal' tau <= offset inside
    int column = -1;      ///< the column parallel to the facet (two dimensions)
  };

  double scale_and_facet(const Torque& torque_nm, int& facet) const noexcept;
  bool project(const Torque& target_nm, Pressures& pressures_bar) const noexcept;
  void on_facet(const Facet& facet, const Torque& target_nm,
                Pressures& pressures_bar) const noexcept;
  void inside(const Torque& target_nm, Pressures& pressures_bar) const noexcept;

  int size_ = 0;
  int facets_ = 0;
  double min_ = 0.0, max_ = 0.0, bias_ = 0.0;
  std::array<Torque, kMaxChambersPerSegment> column_{};
  std::array<Facet, 2 * kMaxChambersPerSegment> facet_{};
};

/// The chambers of one segment that stretches: pressures push, so they also lengthen it. Which axial
/// forces go with a torque, and the pressures that give both.
class AxialChamberMap {
 public:
  using Torque = ChamberMap<2>::Torque;
  using Pressures = ChamberMap<2>::Pressures;

  AxialChamberMap() = default;
  /// columns: w_j (N m per bar); areas: N per bar; limits and bias in bar.
  AxialChamberMap(const std::vector<Torque>& columns, const std::vector<double>& areas_n_per_bar,
                  double min_pressure_bar, double max_pressure_bar, double bias_pressure_bar);

  /// An interval of axial forces.
  struct Range {
    double low_n, high_n;
  };
  /// The axial forces that are within reach together with exactly this torque, which is reachable
  /// itself. Exact, one pass over the facets of the zonotope of (torque, axial force).
  Range axial_range(const Torque& torque_nm) const noexcept;

  /// The axial force nearest to `wanted_n` that goes with this torque, smoothly: a soft maximum of
  /// `wanted_n` and the lower facets, then a soft minimum with the upper ones, each of the form
  /// w log sum exp(x / w) with w = smoothing() . Infinitely differentiable in both arguments, and
  /// above the lower limit by at most w log(facets + 1).
  double within_reach(const Torque& torque_nm, double wanted_n) const noexcept;
  /// w of within_reach(), N: what 0.02 bar of a chamber gives.
  double smoothing_n() const noexcept { return smoothing_n_; }

  /// Bending first: the largest s in [0, 1] for which s torque is reachable, then the axial force
  /// that goes with it and is nearest to `axial_n`, then the pressures nearest the bias. Continuous.
  /// Torque and axial force are met to 1e-9 of what all chambers give together. What is not finite
  /// is out of reach: s = 0, or the lowest axial force. Returns s.
  double allocate(const Torque& torque_nm, double axial_n, Pressures& pressures_bar) const noexcept;

  /// N of `size()` pressures (bar).
  double axial_force(const double* pressures_bar) const noexcept;
  /// N m of `size()` pressures (bar).
  Torque torque(const double* pressures_bar) const noexcept {
    return bending_.torque(pressures_bar);
  }
  const ChamberMap<2>& bending() const noexcept { return bending_; }
  int size() const noexcept { return bending_.size(); }

 private:
  static constexpr int kMostFacets = kMaxChambersPerSegment * (kMaxChambersPerSegment - 1) / 2;
  using Column = std::array<double, 3>;
  /// axial <= value + slope' torque where it is an upper one, >= where it is a lower one; N, N m.
  struct Facet {
    Torque slope{};
    double value = 0.0;
    double at(const Torque& t) const noexcept { return value + slope[0] * t[0] + slope[1] * t[1]; }
  };

  ChamberMap<2> bending_;
  std::array<Column, kMaxChambersPerSegment> column_{};  ///< N m, N m, axial force times lever_m_
  double min_ = 0.0, max_ = 0.0, bias_ = 0.0;
  double lever_m_ = 1.0;  ///< makes the third row comparable with the others
  double smoothing_n_ = 0.0;
  double most_n_ = 0.0;  ///< all chambers together
  int facets_ = 0;       ///< lower ones, and as many upper ones
  std::array<Facet, kMostFacets> lower_{}, upper_{};
};

/// Result of PressureAllocator::allocate.
struct Allocation {
  PressureVector pressures_bar;
  SegmentScalars scale;    ///< s of every segment; below 1 the torque was out of reach
  bool saturated = false;  ///< any s < 1
};

/// The chambers of all segments. A planar arm's out-of-plane torque is dropped in both directions:
/// its structure carries it. With actuation by torque the "pressures" are tau_A itself, scaled down
/// per segment where a component exceeds the limit.
class PressureAllocator {
 public:
  /// @throws std::invalid_argument (segment, expected, got, fix) for a map that cannot reach every
  /// torque direction: fewer than 3 chambers (2 if planar) or more than kMaxChambersPerSegment, a
  /// gain that is not positive, all chambers in a half plane, limits that exclude zero torque.
  /// @param extensible of an arm whose segments stretch: tau_A has three rows a segment below,
  /// (tau_x, tau_y, N) with N the axial force in N; neither planar nor with actuation by torque.
  explicit PressureAllocator(const ActuationSettings& settings, bool extensible = false);

  /// Number of segments.
  int segments() const noexcept { return segments_; }
  /// Chambers of all segments together.
  int chambers() const noexcept { return chambers_; }
  /// Components of tau_A of the whole arm: 2n, or 3n where segments stretch.
  int dimension() const noexcept { return (axial_.empty() ? 2 : 3) * segments_; }
  /// Index in a PressureVector of the first chamber of a segment (from 0).
  int first_chamber(int segment) const noexcept;
  /// Number of chambers of a segment (from 0).
  int chambers_of(int segment) const noexcept;

  /// tau_actuation_nm: 2n, (tau_x, tau_y) about the local axes. Finds per segment the largest s <=
  /// 1 for which s tau is reachable within the pressure limits, then the pressures nearest the bias
  /// that give exactly s tau. No slew limit. Where segments stretch, 3n: as AxialChamberMap.
  void allocate(ConstVectorRef tau_actuation_nm, Allocation& out) const noexcept;

  /// scale: n, the largest s <= 1 of every segment for which s tau is reachable, without the
  /// pressures that give it.
  void largest_scale(ConstVectorRef tau_actuation_nm, SegmentScalars& scale) const noexcept;

  /// tau_A (2n, N m) that pressures (all chambers, bar) give.
  void torque(ConstVectorRef pressures_bar, VectorRef tau_actuation_nm) const noexcept;

  /// Generalized force f in u (2n, N m) that pressures give: A_chamber tau_A.
  void generalized_force(ConstVectorRef pressures_bar, VectorRef force_nm) const noexcept;

  /// Of a segment (from 0) that stretches.
  const AxialChamberMap& axial(int segment) const noexcept { return axial_[segment]; }

 private:
  struct Segment {
    int first = 0;
    ChamberMap<2> spatial;
    ChamberMap<1> planar;
  };
  int segments_ = 0;
  int chambers_ = 0;
  double max_torque_nm_ = 0.0;  ///< of actuation by torque, 0 with chambers
  bool planar_ = false;
  std::array<double, 2> plane_{};  ///< direction of tau_A that bends in the plane
  std::vector<Segment> segment_;
  std::vector<AxialChamberMap> axial_;  ///< one a segment where segments stretch
};

}  // namespace softarm
