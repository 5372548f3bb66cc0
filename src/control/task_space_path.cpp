#include "softarm/control/task_space_path.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace softarm {

TipReference evaluate(const TipPathReference& path, double time_s) noexcept {
  TipReference out;
  out.position_m = path.centre_m;
  if (path.shape == TipPathShape::point) return out;
  const double first = path.rate_radps;
  const double second = path.shape == TipPathShape::lemniscate ? 2.0 * first : first;
  const double cosine = std::cos(first * time_s), sine = std::sin(second * time_s);
  out.position_m += path.first_axis_m * cosine + path.second_axis_m * sine;
  out.velocity_mps = -path.first_axis_m * (first * std::sin(first * time_s)) +
                     path.second_axis_m * (second * std::cos(second * time_s));
  out.acceleration_mps2 =
      -path.first_axis_m * (first * first * cosine) - path.second_axis_m * (second * second * sine);
  return out;
}

double largest_distance_m(const TipPathReference& path, const Eigen::Vector3d& from_m) noexcept {
  constexpr int kInstants = 720;
  TipPathReference unit = path;
  unit.rate_radps = 1.0;
  double largest = 0.0;
  for (int k = 0; k < kInstants; ++k) {
    const double angle = 2.0 * std::numbers::pi * k / kInstants;
    largest = std::max(largest, (evaluate(unit, angle).position_m - from_m).norm());
  }
  return largest;
}

}  // namespace softarm
