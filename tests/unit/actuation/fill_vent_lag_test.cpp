#include "softarm/actuation/fill_vent_lag.hpp"

#include <gtest/gtest.h>

namespace softarm {
namespace {

TEST(FillVentLag, FillsAndVentsWithItsOwnTime) {
  const FillVentLag lag{0.6, 1.5};
  EXPECT_NEAR(lag.step(0.0, 1.0, 0.6), 1.0 - std::exp(-1.0), 1e-15);
  EXPECT_NEAR(lag.step(1.0, 0.0, 1.5), std::exp(-1.0), 1e-15);
  EXPECT_NEAR(lag.step(lag.step(1.0, 0.2, 0.3), 0.2, 0.4), lag.step(1.0, 0.2, 0.7), 1e-15);
}

TEST(FillVentLag, WithoutTimesFollowsAtOnce) {
  EXPECT_EQ(FillVentLag{}.step(0.3, 0.8, 1e-3), 0.8);
  const FillVentLag venting{0.0, 1.0};
  EXPECT_EQ(venting.step(0.3, 0.8, 1e-3), 0.8);
  EXPECT_GT(venting.step(0.8, 0.3, 1e-3), 0.79);
}

}  // namespace
}  // namespace softarm
