// VENT ends at zero, exactly and within its bound, from every pressure.
#include <gtest/gtest.h>

#include <cmath>

#include "softarm/actuation/pressure_ramps.hpp"

namespace softarm {
namespace {

TEST(RampProof, VentReachesZeroWithinItsBound) {
  for (const double rate_bar_per_s : {0.7, 2.5, 10.0, 40.0}) {
    for (const double period_s : {0.001, 0.002, 1.0 / 300.0, 0.01, 0.1}) {
      ActuationSettings settings;
      settings.vent_bar_per_s = rate_bar_per_s;
      const PressureRamps ramps(settings);
      PressureVector bar = PressureVector::LinSpaced(kMaxChambers, -0.2, 2.0), before = bar;
      const double bound = std::ceil(2.0 / (rate_bar_per_s * period_s));
      for (int tick = 0; tick <= static_cast<int>(bound); ++tick) {
        before = bar;
        ramps.vent(bar, period_s, bar);
        for (Eigen::Index j = 0; j < bar.size(); ++j)
          ASSERT_TRUE(bar[j] == 0.0 || std::abs(bar[j]) < std::abs(before[j]));
      }
      EXPECT_TRUE(bar.isZero(0.0)) << rate_bar_per_s << " bar/s, " << period_s << " s";
    }
  }
}

TEST(RampProof, AStepOfTheWholeWayArrivesExactly) {
  for (int a = 0; a <= 200; ++a) {
    for (int b = 0; b <= 200; ++b) {
      const double previous = 0.01 * a, wanted = 0.01 * b;
      ASSERT_EQ(step_towards(previous, wanted, std::abs(wanted - previous)), wanted);
    }
  }
}

}  // namespace
}  // namespace softarm
