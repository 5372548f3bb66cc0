// Chambers by another route: the fibre measured along the arc, its force by virtual work.
#include "softarm/model/chambers.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "random_arm.hpp"
#include "softarm/model/segment.hpp"

namespace softarm {
namespace {

using testing_support::RandomArm;

/// Where the fibre is at arc fraction x.
Eigen::Vector3d fibre_point(double length, const Eigen::Vector2d& u, double r, double chi,
                            double x) {
  return segment_point(length, u, x) +
         segment_rotation(x * u) * Eigen::Vector3d(r * std::cos(chi), r * std::sin(chi), 0.0);
}

TEST(Chambers, FibreIsAsLongAsItMeasures) {
  RandomArm random(1);
  for (int k = 0; k < 20; ++k) {
    const Eigen::Vector2d u = random.bending(1, 4.0);
    const double l = random.uniform(0.08, 0.2), r = random.uniform(0.0, 0.015);
    const double chi = random.uniform(-4.0, 4.0);
    const auto chords = [&](int pieces) {
      double sum = 0.0;
      for (int i = 0; i < pieces; ++i) {
        sum += (fibre_point(l, u, r, chi, (i + 1.0) / pieces) -
                fibre_point(l, u, r, chi, double(i) / pieces))
                   .norm();
      }
      return sum;
    };
    const double measured = (4.0 * chords(200) - chords(100)) / 3.0;
    EXPECT_NEAR(fibre_length(l, u, r, chi), measured, 1e-9);
  }
}

TEST(Chambers, ForceDoesTheWorkOfTheVolume) {
  RandomArm random(2);
  const ChamberGeometry chambers{
      .angles_rad = {0.3, 1.9, 3.4, -1.2}, .offset_m = 0.013, .area_n_per_bar = 60.0};
  const double pressures[] = {0.7, 0.0, 1.9, 0.4};
  const Eigen::Vector2d u = random.bending(1, 5.0);
  const double l = 0.13;
  const Eigen::Vector3d force = chamber_force(chambers, pressures);
  const auto work = [&](const Eigen::Vector3d& q) {  // bar area times length, in N m
    double sum = 0.0;
    for (std::size_t j = 0; j < 4; ++j) {
      sum += pressures[j] * chambers.area_n_per_bar *
             fibre_length(l + q.z(), u + q.head<2>(), chambers.offset_m, chambers.angles_rad[j]);
    }
    return sum;
  };
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d step = 1e-3 * Eigen::Vector3d::Unit(k);
    EXPECT_NEAR(force(k), (work(step) - work(-step)) / 2e-3, 1e-10);
  }
}

TEST(Chambers, ShortestFibreVanishesAtTheBound) {
  // r theta < l is where every fibre has a positive length.
  const double l = 0.1, r = 0.0125, bound = l / r;
  for (const double chi : {0.0, 0.7, -2.0}) {
    const Eigen::Vector2d direction(std::cos(chi), std::sin(chi));
    EXPECT_NEAR(fibre_length(l, bound * direction, r, chi), 0.0, 1e-16);
    EXPECT_GT(fibre_length(l, (1.0 - 1e-14) * bound * direction, r, chi), 0.0);
    EXPECT_LT(fibre_length(l, (1.0 + 1e-14) * bound * direction, r, chi), 0.0);
    EXPECT_NEAR(fibre_length(l, bound * direction, r, chi + M_PI), 2.0 * l, 1e-15);
  }
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(std::isnan(fibre_length(nan, {0.1, 0.2}, r, 0.0)));
  EXPECT_TRUE(std::isnan(fibre_length(l, {nan, 0.2}, r, 0.0)));
}

}  // namespace
}  // namespace softarm
