#include "softarm/simulation/valves.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace softarm {
namespace {

TEST(Valves, FollowAStepAsAFirstOrderLagDoes) {
  Valves valves({.lag_s = 0.02, .supply_pressure_bar = 2.0}, 2);
  valves.command(std::array{1.5, 0.4});
  for (int k = 1; k <= 200; ++k) {
    valves.advance(0.5e-3);
    const double t = 0.5e-3 * k;
    EXPECT_NEAR(valves.pressures_bar()[0], 1.5 * (1.0 - std::exp(-t / 0.02)), 1e-13);
    EXPECT_NEAR(valves.pressures_bar()[1], 0.4 * (1.0 - std::exp(-t / 0.02)), 1e-13);
  }
}

TEST(Valves, StepsOfAnySizeLeadToTheSamePressure) {
  Valves once({.lag_s = 0.03, .supply_pressure_bar = 2.0}, 1);
  Valves often = once;
  once.command(std::array{1.0});
  often.command(std::array{1.0});
  once.advance(0.05);
  for (int k = 0; k < 50000; ++k) often.advance(1e-6);
  EXPECT_NEAR(once.pressures_bar()[0], often.pressures_bar()[0], 1e-12);
  // What an integrator looks ahead to is where the valve then is.
  Eigen::VectorXd ahead(1);
  once.after(0.01, ahead);
  once.advance(0.01);
  EXPECT_NEAR(once.pressures_bar()[0], ahead[0], 1e-15);
}

TEST(Valves, WithoutLagTheCommandIsThePressure) {
  Valves valves({.lag_s = 0.0, .supply_pressure_bar = 2.0}, 1);
  valves.command(std::array{0.7});
  EXPECT_EQ(valves.pressures_bar()[0], 0.7);
}

TEST(Valves, NeverLeaveTheSupply) {
  Valves valves({.lag_s = 0.01, .supply_pressure_bar = 2.0}, 3);
  valves.command(std::array{7.0, -3.0, std::numeric_limits<double>::quiet_NaN()});
  for (int k = 0; k < 100; ++k) {
    valves.advance(0.01);
    EXPECT_LE(valves.pressures_bar().maxCoeff(), 2.0);
    EXPECT_GE(valves.pressures_bar().minCoeff(), 0.0);
  }
  EXPECT_NEAR(valves.pressures_bar()[0], 2.0, 1e-12);
  EXPECT_EQ(valves.pressures_bar()[1], 0.0);
  EXPECT_EQ(valves.pressures_bar()[2], 0.0);
}

TEST(Valves, FillAndVentWithDifferentLags) {
  Valves valves({.lag_s = 0.6, .supply_pressure_bar = 2.0, .vent_lag_s = 1.5}, 1);
  EXPECT_FALSE(valves.exponential());
  valves.command(std::array{1.0});
  for (int k = 0; k < 300; ++k) valves.advance(0.01);
  const double top = 1.0 - std::exp(-3.0 / 0.6);
  EXPECT_NEAR(valves.pressures_bar()[0], top, 1e-13);
  valves.command(std::array{0.2});
  for (int k = 0; k < 150; ++k) valves.advance(0.01);
  EXPECT_NEAR(valves.pressures_bar()[0], 0.2 + (top - 0.2) * std::exp(-1.0), 1e-13);
}

TEST(Valves, BacklashAndDeadBandLieBetweenSetPointAndAim) {
  Valves valves({.supply_pressure_bar = 2.0, .play_bar = 0.05}, 1);
  const auto at = [&](double bar) {
    valves.command(std::array{bar});
    return valves.pressures_bar()[0];
  };
  EXPECT_NEAR(at(1.0), 0.95, 1e-15);
  EXPECT_NEAR(at(0.92), 0.95, 1e-15) << "within the backlash";
  EXPECT_NEAR(at(0.5), 0.55, 1e-15);
  EXPECT_NEAR(at(1.0), 0.95, 1e-15);
  Valves lazy({.supply_pressure_bar = 2.0, .dead_band_bar = 0.05}, 1);
  lazy.command(std::array{1.0});
  lazy.command(std::array{1.04});
  EXPECT_EQ(lazy.pressures_bar()[0], 1.0);
  lazy.command(std::array{1.06});
  EXPECT_EQ(lazy.pressures_bar()[0], 1.06);
}

/// n chambers that are all to have the full supply fill as one with the lag T + n sag: from
/// T p' = S - p and S = P - n sag p'. A full one keeps its pressure, one that vents does not count.
TEST(Valves, ASupplyThatSagsFillsChambersMoreSlowly) {
  const double lag_s = 0.1, sag_s = 0.05, full_bar = 2.0;
  double before = 0.0;
  for (const double step_s : {1e-3, 0.5e-3}) {
    Valves valves({.lag_s = lag_s, .supply_pressure_bar = full_bar, .supply_sag_s = sag_s}, 5);
    valves.reset(std::array{0.0, 0.0, 0.0, 1.9, 1.0});
    EXPECT_EQ(valves.supply_bar(), full_bar);
    valves.command(std::array{full_bar, full_bar, full_bar, full_bar, 0.0});
    EXPECT_NEAR(valves.supply_bar(), full_bar * lag_s / (lag_s + 3.0 * sag_s), 1e-12);
    double worst = 0.0, t = 0.0;
    for (; t < 0.3; t += step_s) {
      worst = std::max(worst, std::abs(valves.pressures_bar()[1] -
                                       full_bar * -std::expm1(-t / (lag_s + 3.0 * sag_s))));
      EXPECT_EQ(valves.pressures_bar()[3], 1.9);
      EXPECT_NEAR(valves.pressures_bar()[4], std::exp(-t / lag_s), 1e-12);
      valves.advance(step_s);
    }
    EXPECT_LT(worst, 5e-3);
    if (before > 0.0) {
      EXPECT_NEAR(worst, 0.5 * before, 0.05 * before) << "first order";
    }
    before = worst;
    for (; t < 5.0; t += step_s) valves.advance(step_s);
    EXPECT_NEAR(valves.supply_bar(), full_bar, 1e-6) << "without flow";
  }
  Valves stiff({.lag_s = 0.1, .supply_pressure_bar = 2.0, .supply_sag_s = 1e-12}, 1);
  stiff.command(std::array{1.0});
  stiff.advance(0.07);
  EXPECT_NEAR(stiff.pressures_bar()[0], -std::expm1(-0.7), 1e-9);
}

TEST(Valves, RefuseSettingsThatMeanNothing) {
  EXPECT_THROW(Valves({.supply_sag_s = 0.1}, 1), std::invalid_argument) << "an infinite flow";
  EXPECT_THROW(Valves({.lag_s = 0.1, .supply_sag_s = 0.1}, 2, true), std::invalid_argument);
  EXPECT_THROW(Valves({.lag_s = -0.1}, 1), std::invalid_argument);
  EXPECT_THROW(Valves({.lag_s = std::nan("")}, 1), std::invalid_argument);
  EXPECT_THROW(Valves({.lag_s = 0.0, .supply_pressure_bar = -1.0}, 1), std::invalid_argument);
  EXPECT_THROW(Valves(ValveSettings{}, -1), std::invalid_argument);
}

}  // namespace
}  // namespace softarm
