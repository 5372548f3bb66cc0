#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "actuation/box_projection.hpp"
#include "softarm/actuation/pressure_allocator.hpp"

namespace softarm {
namespace {

/// Of what all chambers give together: how far inside the reachable set a target is kept, so that
/// the projection onto the box never has to find a vertex by round-off.
constexpr double kInside = 1e-9;
constexpr double kSmoothing_bar = 0.02;

}  // namespace

AxialChamberMap::AxialChamberMap(const std::vector<Torque>& columns,
                                 const std::vector<double>& areas_n_per_bar,
                                 double min_pressure_bar, double max_pressure_bar,
                                 double bias_pressure_bar)
    : bending_(columns, min_pressure_bar, max_pressure_bar, bias_pressure_bar),
      min_(min_pressure_bar),
      max_(max_pressure_bar),
      bias_(std::clamp(bias_pressure_bar, min_pressure_bar, max_pressure_bar)) {
  const std::size_t count = columns.size();
  const double area = std::reduce(areas_n_per_bar.begin(), areas_n_per_bar.end());
  double moment = 0.0;
  for (const Torque& w : columns) moment += std::hypot(w[0], w[1]);
  lever_m_ = moment / area;
  smoothing_n_ = kSmoothing_bar * area / static_cast<double>(count);
  most_n_ = area * std::max(std::abs(min_), std::abs(max_));
  for (std::size_t j = 0; j < count; ++j)
    column_[j] = {columns[j][0], columns[j][1], lever_m_ * areas_n_per_bar[j]};

  // A facet of the zonotope is spanned by two columns; all others are at a limit. Those that are
  // parallel to the axial force bound the torque alone.
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = i + 1; j < count; ++j) {
      const Eigen::Map<const Eigen::Vector3d> a(column_[i].data()), b(column_[j].data());
      Eigen::Vector3d normal = a.cross(b);
      const double size = normal.norm();
      if (!(size > kParallel * a.norm() * b.norm())) continue;
      normal /= normal.z() < 0.0 ? -size : size;
      if (!(normal.z() > kParallel)) continue;
      double highest = 0.0, lowest = 0.0;  // of normal' (torque, lever N)
      for (std::size_t k = 0; k < count; ++k) {
        if (k == i || k == j) {
          continue;
        }
        const Eigen::Map<const Eigen::Vector3d> c(column_[k].data());
        double reach = normal.dot(c);
        if (std::abs(reach) <= kParallel * c.norm()) reach = 0.0;
        highest += std::max(reach * min_, reach * max_);
        lowest += std::min(reach * min_, reach * max_);
      }
      const double axial = normal.z() * lever_m_;
      const Torque slope{-normal.x() / axial, -normal.y() / axial};
      upper_[facets_] = {slope, highest / axial};
      lower_[facets_++] = {slope, lowest / axial};
    }
  }
}

AxialChamberMap::Range AxialChamberMap::axial_range(const Torque& torque_nm) const noexcept {
  Range range{-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  for (int f = 0; f < facets_; ++f) {
    range.low_n = std::max(range.low_n, lower_[f].at(torque_nm));
    range.high_n = std::min(range.high_n, upper_[f].at(torque_nm));
  }
  return range;
}

double AxialChamberMap::within_reach(const Torque& torque_nm, double wanted_n) const noexcept {
  const Range range = axial_range(torque_nm);
  // Relative to the largest, so that no exponential overflows.
  const auto soft = [&](double extreme, double other, const auto& facets, double sign) {
    const double largest = sign > 0.0 ? std::max(extreme, other) : std::min(extreme, other);
    double sum = std::exp(sign * (other - largest) / smoothing_n_);
    for (int f = 0; f < facets_; ++f)
      sum += std::exp(sign * (facets[f].at(torque_nm) - largest) / smoothing_n_);
    return largest + sign * smoothing_n_ * std::log(sum);
  };
  const double above = soft(range.low_n, wanted_n, lower_, 1.0);
  return soft(range.high_n, above, upper_, -1.0);
}

double AxialChamberMap::allocate(const Torque& torque_nm, double axial_n,
                                 Pressures& pressures_bar) const noexcept {
  const bool finite = std::isfinite(torque_nm[0]) && std::isfinite(torque_nm[1]);
  const double scale = finite ? bending_.largest_scale(torque_nm) : 0.0;
  const double inside = scale < 1.0 ? scale * (1.0 - kInside) : 1.0;
  const Torque torque = finite ? Torque{inside * torque_nm[0], inside * torque_nm[1]} : Torque{};
  const Range range = axial_range(torque);
  const double margin_n = kInside * most_n_;
  const double low = range.low_n + margin_n, high = range.high_n - margin_n;
  double axial = 0.5 * (range.low_n + range.high_n);
  if (low < high) axial = std::isfinite(axial_n) ? std::clamp(axial_n, low, high) : low;
  BoxProjection<3, kMaxChambersPerSegment> projection(size(), column_.data(), min_, max_, bias_);
  if (!projection.solve({torque[0], torque[1], lever_m_ * axial}, pressures_bar))
    bending_.allocate(torque, pressures_bar);  // round-off at the very edge: the torque alone
  return scale;
}

double AxialChamberMap::axial_force(const double* pressures_bar) const noexcept {
  double sum = 0.0;
  for (int j = 0; j < size(); ++j) sum += column_[j][2] * pressures_bar[j];
  return sum / lever_m_;
}

}  // namespace softarm
