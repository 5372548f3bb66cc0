// The integrator on systems whose solution is known in closed form.
#include "simulation/arkode_integrator.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "softarm/simulation/plant_error.hpp"
#include "unit/simulation/oscillators.hpp"

namespace softarm {
namespace {

class Methods : public ::testing::TestWithParam<IntegratorMethod> {};

TEST_P(Methods, MeetTheClosedFormWithinTheToleranceAndConverge) {
  double previous = INFINITY;
  for (const double tolerance : {1e-4, 1e-6, 1e-8}) {
    Oscillators system(vec({1.0, 2.0}), vec({0.3, 0.1}), vec({40.0, 900.0}));
    ArkodeIntegrator integrator(system, {.method = GetParam(),
                                         .relative_tolerance = tolerance,
                                         .absolute_tolerance = 1e-2 * tolerance,
                                         .absolute_tolerance_velocity = tolerance});
    integrator.reset(0.0, vec({1.0, -0.5}), vec({0.0, 0.0}));
    double worst = 0.0;
    for (int k = 1; k <= 50; ++k) {
      const double t = 0.1 * k;
      integrator.advance(t);
      EXPECT_EQ(integrator.time_s(), t);
      worst = std::max(worst, std::abs(integrator.x()[0] - released(1.0, 0.3, 40.0, 1.0, t)));
      worst = std::max(worst, std::abs(integrator.x()[1] - released(2.0, 0.1, 900.0, -0.5, t)));
    }
    EXPECT_LT(worst, 1000.0 * tolerance);
    EXPECT_LT(worst, 0.2 * previous);
    previous = worst;
  }
}

INSTANTIATE_TEST_SUITE_P(Dirk, Methods,
                         ::testing::Values(IntegratorMethod::sdirk2, IntegratorMethod::cash4,
                                           IntegratorMethod::sdirk4));

TEST(ArkodeIntegrator, TakesRatesOfAMillionInItsStride) {
  // Rates of 1e7 1/s beside a motion of seconds: the stiff one must neither ring nor force small
  // steps.
  Oscillators system(vec({1e-9, 1.0}), vec({1e-2, 0.5}), vec({1.0, 10.0}));
  ArkodeIntegrator integrator(system, {});
  integrator.reset(0.0, vec({0.1, 0.1}), vec({0.0, 0.0}));
  integrator.advance(2.0);
  EXPECT_NEAR(integrator.x()[0], 0.1 * std::exp(-2.0 / 1e-2), 1e-7);
  EXPECT_NEAR(integrator.x()[1], released(1.0, 0.5, 10.0, 0.1, 2.0), 1e-5);
  EXPECT_LT(integrator.counters().steps, 2000);
}

TEST(ArkodeIntegrator, AStepInTheForceNeedsNoRestart) {
  Oscillators system(vec({1.0}), vec({2.0}), vec({100.0}));
  ArkodeIntegrator integrator(system, {.relative_tolerance = 1e-9,
                                       .absolute_tolerance = 1e-11,
                                       .absolute_tolerance_velocity = 1e-9});
  integrator.reset(0.0, vec({0.0}), vec({0.0}));
  // Superposition of steps, each of which is known.
  const auto step = [](double t) {
    return t > 0.0 ? (1.0 - released(1.0, 2.0, 100.0, 1.0, t)) / 100.0 : 0.0;
  };
  double expected = 0.0;
  for (int k = 0; k < 500; ++k) {
    system.force[0] = (k / 7) % 2 == 0 ? 1.0 : -2.0;
    integrator.advance(1e-3 * (k + 1));
  }
  for (int k = 0; k < 500; ++k) {
    const double now = (k / 7) % 2 == 0 ? 1.0 : -2.0;
    const double before = k == 0 ? 0.0 : ((k - 1) / 7) % 2 == 0 ? 1.0 : -2.0;
    expected += (now - before) * step(0.5 - 1e-3 * k);
  }
  EXPECT_NEAR(integrator.x()[0], expected, 1e-10);
  EXPECT_LT(integrator.counters().linearizations, 50);
}

TEST(ArkodeIntegrator, AccountsForEnergy) {
  Oscillators system(vec({1.0}), vec({0.7}), vec({30.0}));
  system.force[0] = 3.0;
  ArkodeIntegrator integrator(system, {.relative_tolerance = 1e-8, .account_energy = true});
  integrator.reset(0.0, vec({0.0}), vec({0.0}));
  integrator.advance(1.3);
  const double x = integrator.x()[0];
  const double v = integrator.v()[0];
  EXPECT_NEAR(integrator.supplied_j(), 3.0 * x, 1e-6);
  EXPECT_NEAR(0.5 * v * v + 15.0 * x * x, integrator.supplied_j() - integrator.dissipated_j(),
              1e-6);
  EXPECT_GT(integrator.dissipated_j(), 0.01);
}

TEST(ArkodeIntegrator, AFailureThatPassesIsRetriedAndForgotten) {
  Oscillators healthy(vec({1.0}), vec({0.3}), vec({40.0}));
  Oscillators sick = healthy;
  ArkodeIntegrator one(healthy, {});
  ArkodeIntegrator two(sick, {});
  for (ArkodeIntegrator* integrator : {&one, &two}) {
    integrator->reset(0.0, vec({1.0}), vec({0.0}));
    integrator->advance(0.1);
  }
  sick.failures_left = 15;  // more than one call's own attempts
  one.advance(0.2);
  two.advance(0.2);
  EXPECT_EQ(two.counters().retries, 1);
  EXPECT_NEAR(one.x()[0], two.x()[0], 1e-5);
}

TEST(ArkodeIntegrator, AFailureThatLastsIsAnErrorWithEvidenceAndNoStateIsLost) {
  Oscillators system(vec({1.0}), vec({0.3}), vec({40.0}));
  system.broken_from = 0.15;
  ArkodeIntegrator integrator(system, {});
  integrator.reset(0.0, vec({1.0}), vec({0.0}));
  integrator.advance(0.1);
  const double x = integrator.x()[0];
  try {
    integrator.advance(0.2);
    FAIL() << "expected a PlantError";
  } catch (const PlantError& error) {
    EXPECT_GE(error.time_s, 0.1);
    EXPECT_LE(error.time_s, 0.1501);
    EXPECT_EQ(error.cause.rfind("ARK_", 0), 0u) << error.cause;
    ASSERT_EQ(error.u_rad.size(), 1);
    EXPECT_NEAR(error.u_rad[0], released(1.0, 0.3, 40.0, 1.0, error.time_s), 1e-4);
    EXPECT_NE(std::string(error.what()).find(error.cause), std::string::npos);
  }
  EXPECT_EQ(integrator.time_s(), 0.1);
  EXPECT_EQ(integrator.x()[0], x);
  system.broken_from = INFINITY;  // and it can go on
  integrator.advance(0.2);
  EXPECT_NEAR(integrator.x()[0], released(1.0, 0.3, 40.0, 1.0, 0.2), 1e-4);
}

TEST(ArkodeIntegrator, AnAbsurdToleranceIsAnErrorNotAWrongState) {
  Oscillators system(vec({1.0}), vec({0.3}), vec({40.0}));
  ArkodeIntegrator integrator(system, {.relative_tolerance = 1e-30,
                                       .absolute_tolerance = 1e-30,
                                       .absolute_tolerance_velocity = 1e-30});
  integrator.reset(0.0, vec({1.0}), vec({0.0}));
  EXPECT_THROW(integrator.advance(0.5), PlantError);
  EXPECT_EQ(integrator.x()[0], 1.0);
  EXPECT_THROW(ArkodeIntegrator(system, {.relative_tolerance = 0.0}), std::invalid_argument);
  EXPECT_THROW(ArkodeIntegrator(system, {.absolute_tolerance = std::nan("")}),
               std::invalid_argument);
}

TEST(ArkodeIntegrator, GoingNowhereChangesNothing) {
  Oscillators system(vec({1.0}), vec({0.3}), vec({40.0}));
  ArkodeIntegrator integrator(system, {});
  integrator.reset(1.0, vec({1.0}), vec({0.0}));
  integrator.advance(1.0);
  integrator.advance(0.5);
  EXPECT_EQ(integrator.time_s(), 1.0);
  EXPECT_EQ(integrator.x()[0], 1.0);
}

}  // namespace
}  // namespace softarm
