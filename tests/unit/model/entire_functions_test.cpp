// c_k(s) against their power series in quadruple precision.
#include "softarm/model/entire_functions.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace softarm {
namespace {

using Quad = __float128;

Quad exact(int k, double s) {
  Quad term = 1;
  for (int i = 2; i <= k; ++i) term /= i;
  Quad sum = term;
  for (int j = 1; j < 120; ++j) {
    term *= -static_cast<Quad>(s) / ((k + 2 * j) * (k + 2 * j - 1));
    sum += term;
  }
  return sum;
}

/// Error in units of 2^-52 of max(|c_k|, 1/k!).
double error_in_ulp(int k, double s, double got) {
  const Quad want = exact(k, s);
  const double scale = std::max(std::abs(static_cast<double>(want)), 1.0 / std::tgamma(k + 1.0));
  return std::abs(static_cast<double>(want - static_cast<Quad>(got))) /
         (scale * std::numeric_limits<double>::epsilon());
}

TEST(EntireFunctions, WithinAFewUlpOfTheirScale) {
  double worst = 0.0;
  for (double s = 0.0; s < 100.0; s += 0.0137) {
    const auto c = entire_functions(s);
    for (int k = 0; k < kEntireFunctions; ++k) {
      worst = std::max(worst, error_in_ulp(k, s, c[static_cast<std::size_t>(k)]));
    }
  }
  EXPECT_LT(worst, 8.0);
  std::printf("  worst %.2f ulp\n", worst);
}

TEST(EntireFunctions, ContinuousAcrossEverySwitch) {
  for (const double s : {4.0, 12.0, 33.0}) {
    const auto below = entire_functions(std::nextafter(s, 0.0));
    const auto at = entire_functions(s);
    for (std::size_t k = 0; k < kEntireFunctions; ++k) {
      const double scale = 1.0 / std::tgamma(static_cast<double>(k) + 1.0);
      EXPECT_NEAR(below[k], at[k], 8.0 * std::numeric_limits<double>::epsilon() * scale)
          << "c" << k << " at " << s;
    }
  }
}

TEST(EntireFunctions, TinyArgumentsAreExact) {
  for (const double s : {0.0, 5e-324, 1e-300, 1e-160}) {
    const auto c = entire_functions(s);
    for (std::size_t k = 0; k < kEntireFunctions; ++k) {
      EXPECT_DOUBLE_EQ(c[k], 1.0 / std::tgamma(static_cast<double>(k) + 1.0));
    }
  }
}

TEST(EntireFunctions, NotANumberStaysNotANumber) {
  for (const double s : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_TRUE(std::isnan(entire_functions(s)[0]));
    EXPECT_TRUE(std::isnan(entire_functions(s)[11]));
  }
}

}  // namespace
}  // namespace softarm
