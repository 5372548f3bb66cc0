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

namespace softarm {

/// One number per segment.
using SegmentScalars = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxSegments, 1>;

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
  explicit PressureAllocator(const ActuationSettings& settings);

  /// Number of segments.
  int segments() const noexcept { return segments_; }
  /// Chambers of all segments together.
  int chambers() const noexcept { return chambers_; }
  /// Index in a PressureVector of the first chamber of a segment (from 0).
  int first_chamber(int segment) const noexcept;
  /// Number of chambers of a segment (from 0).
  int chambers_of(int segment) const noexcept;

  /// tau_actuation_nm: 2n, (tau_x, tau_y) about the local axes. Finds per segment the largest s <=
  /// 1 for which s tau is reachable within the pressure limits, then the pressures nearest the bias
  /// that give exactly s tau. No slew limit.
  void allocate(ConstVectorRef tau_actuation_nm, Allocation& out) const noexcept;

  /// scale: n, the largest s <= 1 of every segment for which s tau is reachable, without the
  /// pressures that give it.
  void largest_scale(ConstVectorRef tau_actuation_nm, SegmentScalars& scale) const noexcept;

  /// tau_A (2n, N m) that pressures (all chambers, bar) give.
  void torque(ConstVectorRef pressures_bar, VectorRef tau_actuation_nm) const noexcept;

  /// Generalized force f in u (2n, N m) that pressures give: A_chamber tau_A.
  void generalized_force(ConstVectorRef pressures_bar, VectorRef force_nm) const noexcept;

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
};

}  // namespace softarm
