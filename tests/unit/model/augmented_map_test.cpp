// b and eta of (7) and (8): against their Taylor series near 0, against trigonometry in long double
// elsewhere, their derivatives against differences in long double.
#include "model/augmented_map.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

namespace softarm {
namespace {

using Real = long double;

constexpr double kLength = 0.7;
constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

struct Exact {
  Real b, eta;
};

/// From the sides of the triangle in figure 3(c), no series: loses nothing at |theta| >= 0.1 that
/// long double would miss here.
Exact from_triangle(Real theta) {
  const Real y = theta / 2;
  const Real along = std::sin(y) / y, across = (std::sin(y) / y - std::cos(y)) / y;
  return {Real(kLength) / 2 * std::sqrt(along * along + across * across),
          std::atan2(across, along)};
}

TEST(CentreOfMass, TaylorSeriesNearZero) {
  for (const double size :
       {0.0, 5e-324, 1e-310, 1e-300, 1e-160, 1e-20, 1e-12, 1e-8, 1e-5, 1e-3, 1e-2, 5e-2, 0.1}) {
    for (const double theta : {size, -size}) {
      const CentreOfMass m = centre_of_mass(kLength, theta);
      const Real t = theta, s = t * t, L = kLength;
      const Real b =
          L *
          (0.5L + s * (-1.0L / 72 + s * (1.0L / 6480 + s * (-11.0L / 16329600 + s / 293932800))));
      const Real b_1 =
          L * t * (-1.0L / 36 + s * (4.0L / 6480 + s * (-66.0L / 16329600 + s * 8 / 293932800)));
      const Real b_2 =
          L * (-1.0L / 36 + s * (12.0L / 6480 + s * (-330.0L / 16329600 + s * 56 / 293932800)));
      const Real eta =
          t * (1.0L / 6 + s * (1.0L / 810 + s * (1.0L / 68040 + s * (1.0L / 6123600))));
      const Real eta_1 = 1.0L / 6 + s * (3.0L / 810 + s * (5.0L / 68040 + s * (7.0L / 6123600)));
      const Real eta_2 = t * (6.0L / 810 + s * (20.0L / 68040 + s * (42.0L / 6123600)));
      const auto near = [&](double got, Real want, double ulps, Real truncation) {
        EXPECT_LE(std::abs(got - want), ulps * kEpsilon * std::abs(want) + truncation + 5e-324L)
            << theta;
      };
      const Real s_4 = s * s * s * s;
      near(m.b, b, 2, s_4 * s * 1e-9L);
      near(m.b_1, b_1, 8, s_4 * 1e-9L);
      near(m.b_2, b_2, 12, s_4 * 1e-8L);
      near(m.eta, eta, 4, s_4 * 2e-8L);
      near(m.eta_1, eta_1, 8, s_4 * 2e-8L);
      near(m.eta_2, eta_2, 24, s_4 * 2e-6L);
    }
  }
}

TEST(CentreOfMass, TrigonometryAndDifferences) {
  for (double size = 0.1; size < 20.0; size += 0.0173) {
    for (const double theta : {size, -size}) {
      const CentreOfMass m = centre_of_mass(kLength, theta);
      const Exact at = from_triangle(theta);
      // Relative to 1 / y, the size of b / L at large theta.
      EXPECT_LE(std::abs(m.b - at.b), 8 * kEpsilon * at.b) << theta;
      EXPECT_LE(std::abs(std::remainder(m.eta - at.eta, 2 * std::numbers::pi_v<Real>)),
                8 * kEpsilon * std::max(1.0L, std::abs(at.eta)))
          << theta;

      constexpr Real h = 1e-3L;  // fourth order: h^4 / 30 of the fifth derivative
      const Exact a = from_triangle(theta - 2 * h), b = from_triangle(theta - h),
                  c = from_triangle(theta + h), d = from_triangle(theta + 2 * h);
      const auto step = [&](Real eta) {
        return std::remainder(eta - at.eta, 2 * std::numbers::pi_v<Real>);
      };
      const auto first = [](Real w, Real x, Real y, Real z) {
        return (8 * (y - x) - (z - w)) / (12 * h);
      };
      const auto second = [](Real w, Real x, Real middle, Real y, Real z) {
        return (16 * (x + y) - (w + z) - 30 * middle) / (12 * h * h);
      };
      EXPECT_NEAR(m.b_1, double(first(a.b, b.b, c.b, d.b)), 1e-12) << theta;
      EXPECT_NEAR(m.b_2, double(second(a.b, b.b, at.b, c.b, d.b)), 1e-11) << theta;
      EXPECT_NEAR(m.eta_1, double(first(step(a.eta), step(b.eta), step(c.eta), step(d.eta))), 1e-11)
          << theta;
      EXPECT_NEAR(m.eta_2, double(second(step(a.eta), step(b.eta), 0, step(c.eta), step(d.eta))),
                  1e-10)
          << theta;
    }
  }
}

TEST(CentreOfMass, EvenAndOdd) {
  for (double theta = 0.0; theta < 20.0; theta += 0.031) {
    const CentreOfMass plus = centre_of_mass(kLength, theta);
    const CentreOfMass minus = centre_of_mass(kLength, -theta);
    EXPECT_GT(plus.b, 0.0);
    EXPECT_EQ(plus.b, minus.b);
    EXPECT_EQ(plus.b_1, -minus.b_1);
    EXPECT_EQ(plus.b_2, minus.b_2);
    EXPECT_EQ(plus.eta, -minus.eta);
    EXPECT_EQ(plus.eta_1, minus.eta_1);
    EXPECT_EQ(plus.eta_2, -minus.eta_2);
  }
}

TEST(CentreOfMass, NotANumber) {
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    const CentreOfMass m = centre_of_mass(kLength, bad);
    for (const double x : {m.b, m.b_1, m.b_2, m.eta, m.eta_1, m.eta_2}) EXPECT_TRUE(std::isnan(x));
  }
}

}  // namespace
}  // namespace softarm
