#include <algorithm>
#include <cmath>
#include <limits>

#include "actuation/box_projection.hpp"
#include "softarm/actuation/pressure_allocator.hpp"

namespace softarm {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

template <int D>
double dot(const std::array<double, D>& a, const std::array<double, D>& b) {
  double sum = 0.0;
  for (int i = 0; i < D; ++i) sum += a[i] * b[i];
  return sum;
}

/// normal' column, with zero for a column that is parallel to the facet.
template <int D>
double across(const std::array<double, D>& normal, const std::array<double, D>& column) {
  const double value = dot<D>(normal, column);
  return std::abs(value) <= kParallel * std::sqrt(dot<D>(column, column)) ? 0.0 : value;
}

/// Pressures with a' p = target if the point nearest to the bias cannot be computed: on the line
/// between the two extremes.
double mix(double low, double high, double target) {
  return high > low ? std::clamp((target - low) / (high - low), 0.0, 1.0) : 0.0;
}

}  // namespace

template <int D>
ChamberMap<D>::ChamberMap(const std::vector<Torque>& columns, double min_pressure_bar,
                          double max_pressure_bar, double bias_pressure_bar)
    : size_(static_cast<int>(columns.size())),
      min_(min_pressure_bar),
      max_(max_pressure_bar),
      bias_(std::clamp(bias_pressure_bar, min_pressure_bar, max_pressure_bar)) {
  std::copy(columns.begin(), columns.end(), column_.begin());
  const auto add = [this](const Torque& normal, int column) {
    Facet facet{normal, 0.0, column};
    for (int j = 0; j < size_; ++j) {
      const double reach = across<D>(normal, column_[j]);
      facet.offset += std::max(reach * min_, reach * max_);
    }
    facet_[facets_++] = facet;
  };
  if constexpr (D == 1) {
    add({1.0}, -1);
    add({-1.0}, -1);
  } else {
    for (int j = 0; j < size_; ++j) {
      const Torque& w = column_[j];
      const double length = std::hypot(w[0], w[1]);
      if (length == 0.0) continue;
      add({w[1] / length, -w[0] / length}, j);
      add({-w[1] / length, w[0] / length}, j);
    }
  }
}

template <int D>
double ChamberMap<D>::weakest_torque_nm() const noexcept {
  double weakest = kInfinite;
  for (int f = 0; f < facets_; ++f) weakest = std::min(weakest, facet_[f].offset);
  return weakest;
}

template <int D>
double ChamberMap<D>::strongest_torque_nm() const noexcept {
  double strongest = -kInfinite;
  for (int f = 0; f < facets_; ++f) strongest = std::max(strongest, facet_[f].offset);
  return strongest;
}

template <int D>
double ChamberMap<D>::scale_and_facet(const Torque& torque_nm, int& facet) const noexcept {
  double scale = 1.0;
  facet = -1;
  for (int f = 0; f < facets_; ++f) {
    const double outward = dot<D>(facet_[f].normal, torque_nm);
    // The comparison comes first: no division where the facet does not limit.
    if (outward > 0.0 && facet_[f].offset < scale * outward) {
      scale = std::max(facet_[f].offset, 0.0) / outward;
      facet = f;
    }
  }
  return scale;
}

template <int D>
double ChamberMap<D>::largest_scale(const Torque& torque_nm) const noexcept {
  int facet;
  return scale_and_facet(torque_nm, facet);
}

template <int D>
double ChamberMap<D>::allocate(const Torque& torque_nm, Pressures& pressures_bar) const noexcept {
  for (double component : torque_nm) {
    if (!std::isfinite(component)) {
      inside(Torque{}, pressures_bar);
      return 0.0;
    }
  }
  int facet;
  const double scale = scale_and_facet(torque_nm, facet);
  Torque target = torque_nm;
  for (double& component : target) component *= scale;
  if (facet >= 0) {
    on_facet(facet_[facet], target, pressures_bar);
  } else {
    inside(target, pressures_bar);
  }
  return scale;
}

template <int D>
bool ChamberMap<D>::project(const Torque& target_nm, Pressures& pressures_bar) const noexcept {
  BoxProjection<D, kMaxChambersPerSegment> projection(size_, column_.data(), min_, max_, bias_);
  return projection.solve(target_nm, pressures_bar);
}

// On a facet every column that points across it is at a limit; those parallel to it share what is
// left along it.
template <int D>
void ChamberMap<D>::on_facet(const Facet& facet, const Torque& target_nm,
                             Pressures& pressures_bar) const noexcept {
  for (int j = 0; j < size_; ++j) {
    pressures_bar[j] = across<D>(facet.normal, column_[j]) > 0.0 ? max_ : min_;
  }
  if constexpr (D == 2) {
    const Torque along{-facet.normal[1], facet.normal[0]};
    std::array<std::array<double, 1>, kMaxChambersPerSegment> parallel{};
    std::array<int, kMaxChambersPerSegment> index{};
    int count = 0;
    double target = dot<D>(along, target_nm), low = 0.0, high = 0.0;
    for (int j = 0; j < size_; ++j) {
      const double lever = dot<D>(along, column_[j]);
      if (across<D>(facet.normal, column_[j]) != 0.0) {
        target -= lever * pressures_bar[j];
      } else {
        parallel[count][0] = lever;
        index[count++] = j;
        low += std::min(lever * min_, lever * max_);
        high += std::max(lever * min_, lever * max_);
      }
    }
    target = std::clamp(target, low, high);
    Pressures share{};
    BoxProjection<1, kMaxChambersPerSegment> projection(count, parallel.data(), min_, max_, bias_);
    const bool solved = projection.solve({target}, share);
    const double way = mix(low, high, target);
    for (int i = 0; i < count; ++i) {
      const bool rises = parallel[i][0] > 0.0;
      const double from = rises ? min_ : max_, to = rises ? max_ : min_;
      pressures_bar[index[i]] = solved ? share[i] : from + way * (to - from);
    }
  }
}

template <int D>
void ChamberMap<D>::inside(const Torque& target_nm, Pressures& pressures_bar) const noexcept {
  if (project(target_nm, pressures_bar)) return;
  // Round-off near the edge: still the exact torque, on the line from the middle of the box to the
  // point of the boundary beyond the target (where the nearest pressures are known in closed form).
  const double middle = 0.5 * (min_ + max_);
  Torque centre{}, way = target_nm;
  for (int j = 0; j < size_; ++j) {
    for (int i = 0; i < D; ++i) centre[i] += column_[j][i] * middle;
  }
  for (int i = 0; i < D; ++i) way[i] -= centre[i];
  double reach = kInfinite;
  int facet = -1;
  for (int f = 0; f < facets_; ++f) {
    const double outward = dot<D>(facet_[f].normal, way);
    const double margin = facet_[f].offset - dot<D>(facet_[f].normal, centre);
    if (outward > 0.0 && margin / outward < reach) {
      reach = std::max(margin, 0.0) / outward;
      facet = f;
    }
  }
  if (facet < 0 || reach == 0.0) {
    std::fill_n(pressures_bar.begin(), size_, middle);
    return;
  }
  Torque edge = centre;
  for (int i = 0; i < D; ++i) edge[i] += reach * way[i];
  on_facet(facet_[facet], edge, pressures_bar);
  for (int j = 0; j < size_; ++j) {
    const double p = middle + (pressures_bar[j] - middle) / std::max(reach, 1.0);
    pressures_bar[j] = std::clamp(p, min_, max_);
  }
}

template <int D>
typename ChamberMap<D>::Torque ChamberMap<D>::torque(const double* pressures_bar) const noexcept {
  Torque sum{};
  for (int j = 0; j < size_; ++j) {
    for (int i = 0; i < D; ++i) sum[i] += column_[j][i] * pressures_bar[j];
  }
  return sum;
}

template class ChamberMap<1>;
template class ChamberMap<2>;

}  // namespace softarm
