// Paths of the tip: points, circles and the lemniscate (22).
#include <algorithm>
#include <cmath>
#include <numbers>

#include "softarm/control/reference_kinds.hpp"

namespace softarm {

const char* TipPathReference::name() const noexcept {
  switch (shape) {
    case TipPathShape::point:
      return "tip_point";
    case TipPathShape::circle:
      return "tip_circle";
    case TipPathShape::lemniscate:
      break;
  }
  return "tip_lemniscate";
}

void TipPathReference::describe(Keys& key) {
  const Form place = from(-1e3, 1e3);
  key("centre_m", centre_m, place,
      "of the path, in the world; left out, this and what follows are (22)");
  if (shape == TipPathShape::point) return;
  key("first_axis_m", first_axis_m, place, "times cos(rate t)");
  key("second_axis_m", second_axis_m, place, "times sin(rate t), in a lemniscate sin(2 rate t)");
  key("rate_radps", rate_radps, from(0, 1e3), "of the path");
}

void TipPathReference::check(const ReferencePlace& place, const ControllerSettings&, int) const {
  place.require(centre_m.allFinite() && first_axis_m.allFinite() && second_axis_m.allFinite() &&
                    std::isfinite(rate_radps),
                "a path of finite numbers", "one that is not");
}

double TipPathReference::period_s() const noexcept {
  return shape != TipPathShape::point && rate_radps > 0.0 ? 2.0 * std::numbers::pi / rate_radps
                                                          : 0.0;
}

TipReference TipPathReference::tip(double time_s) const noexcept {
  TipReference out;
  out.position_m = centre_m;
  if (shape == TipPathShape::point) return out;
  const double first = rate_radps;
  const double second = shape == TipPathShape::lemniscate ? 2.0 * first : first;
  const double cosine = std::cos(first * time_s), sine = std::sin(second * time_s);
  out.position_m += first_axis_m * cosine + second_axis_m * sine;
  out.velocity_mps = -first_axis_m * (first * std::sin(first * time_s)) +
                     second_axis_m * (second * std::cos(second * time_s));
  out.acceleration_mps2 =
      -first_axis_m * (first * first * cosine) - second_axis_m * (second * second * sine);
  return out;
}

double TipPathReference::largest_distance_m(const Eigen::Vector3d& from_m) const noexcept {
  constexpr int kInstants = 720;
  TipPathReference unit = *this;
  unit.rate_radps = 1.0;
  double largest = 0.0;
  for (int k = 0; k < kInstants; ++k) {
    const double angle = 2.0 * std::numbers::pi * k / kInstants;
    largest = std::max(largest, (unit.tip(angle).position_m - from_m).norm());
  }
  return largest;
}

}  // namespace softarm
