// Every method behind the one interface: closed forms, one another on every kind of plant, failure.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "simulation/integrator.hpp"
#include "softarm/simulation/arm_plant.hpp"
#include "softarm/simulation/plant_error.hpp"
#include "unit/simulation/oscillators.hpp"
#include "unit/simulation/paper_arm.hpp"

namespace softarm {
namespace {

constexpr IntegratorMethod kMethods[] = {IntegratorMethod::sdirk2, IntegratorMethod::cash4,
                                         IntegratorMethod::sdirk4, IntegratorMethod::erk,
                                         IntegratorMethod::cvode_bdf};

class Integrators : public ::testing::TestWithParam<IntegratorMethod> {
 protected:
  IntegratorSettings settings(double tolerance) const {
    return {.method = GetParam(),
            .relative_tolerance = tolerance,
            .absolute_tolerance = 1e-2 * tolerance,
            .absolute_tolerance_velocity = tolerance};
  }
};

TEST_P(Integrators, MeetTheClosedFormAndErrorsFallWithTheTolerance) {
  double previous = INFINITY;
  for (const double tolerance : {1e-4, 1e-6, 1e-8}) {
    Oscillators system(vec({1.0, 2.0}), vec({0.3, 0.1}), vec({40.0, 900.0}));
    const auto integrator = make_integrator(system, settings(tolerance));
    integrator->reset(0.0, vec({1.0, -0.5}), vec({0.0, 0.0}));
    double worst = 0.0;
    for (int k = 1; k <= 20; ++k) {
      const double t = 0.1 * k;
      integrator->advance(t);
      EXPECT_EQ(integrator->time_s(), t);
      worst = std::max(worst, std::abs(integrator->x()[0] - released(1.0, 0.3, 40.0, 1.0, t)));
      worst = std::max(worst, std::abs(integrator->x()[1] - released(2.0, 0.1, 900.0, -0.5, t)));
    }
    EXPECT_LT(worst, 2000.0 * tolerance);
    EXPECT_LT(worst, 0.2 * previous);
    previous = worst;
  }
}

TEST_P(Integrators, MayLookAheadUnderASmoothInputAndTellTheSame) {
  IntegratorSettings ahead = settings(1e-7);
  ahead.smooth_input = true;
  Oscillators system(vec({1.0}), vec({0.3}), vec({40.0}));
  const auto integrator = make_integrator(system, ahead);
  integrator->reset(0.0, vec({1.0}), vec({0.0}));
  for (int k = 1; k <= 1000; ++k) {
    integrator->advance(1e-3 * k);
    ASSERT_NEAR(integrator->x()[0], released(1.0, 0.3, 40.0, 1.0, 1e-3 * k), 1e-4) << k;
  }
}

TEST_P(Integrators, AStepInTheForceIsFollowed) {
  Oscillators system(vec({1.0}), vec({2.0}), vec({100.0}));
  const auto integrator = make_integrator(system, settings(1e-8));
  integrator->reset(0.0, vec({0.0}), vec({0.0}));
  integrator->advance(0.1);
  system.force[0] = 3.0;
  integrator->input_jumped();
  integrator->advance(0.4);
  EXPECT_NEAR(integrator->x()[0], 0.03 * (1.0 - released(1.0, 2.0, 100.0, 1.0, 0.3)), 1e-7);
}

TEST_P(Integrators, AccountForEnergy) {
  Oscillators system(vec({1.0}), vec({0.7}), vec({30.0}));
  system.force[0] = 3.0;
  IntegratorSettings accounting = settings(1e-8);
  accounting.account_energy = true;
  const auto integrator = make_integrator(system, accounting);
  integrator->reset(0.0, vec({0.0}), vec({0.0}));
  integrator->advance(1.3);
  const double x = integrator->x()[0];
  const double v = integrator->v()[0];
  EXPECT_NEAR(integrator->supplied_j(), 3.0 * x, 1e-5);
  EXPECT_NEAR(0.5 * v * v + 15.0 * x * x, integrator->supplied_j() - integrator->dissipated_j(),
              1e-5);
  EXPECT_GT(integrator->dissipated_j(), 0.01);
}

TEST_P(Integrators, AFailureIsAnErrorWithEvidenceAndNoStateIsLost) {
  Oscillators system(vec({1.0}), vec({0.3}), vec({40.0}));
  system.broken_from = 0.15;
  const auto integrator = make_integrator(system, settings(1e-6));
  integrator->reset(0.0, vec({1.0}), vec({0.0}));
  integrator->advance(0.1);
  const double x = integrator->x()[0];
  try {
    integrator->advance(0.2);
    FAIL() << "expected a PlantError";
  } catch (const PlantError& error) {
    EXPECT_GE(error.time_s, 0.1);
    EXPECT_LE(error.time_s, 0.16);  // an explicit step may end there without having looked
    EXPECT_FALSE(error.cause.empty());
    EXPECT_EQ(error.u_rad.size(), 1);
    EXPECT_NE(std::string(error.what()).find(error.cause), std::string::npos);
  }
  EXPECT_EQ(integrator->time_s(), 0.1);
  EXPECT_EQ(integrator->x()[0], x);
  system.broken_from = INFINITY;  // and it can go on
  integrator->advance(0.2);
  EXPECT_NEAR(integrator->x()[0], released(1.0, 0.3, 40.0, 1.0, 0.2), 1e-3);
}

TEST_P(Integrators, AnAbsurdToleranceIsAnErrorNotAWrongState) {
  Oscillators system(vec({1.0}), vec({0.3}), vec({40.0}));
  const auto integrator = make_integrator(system, settings(1e-30));
  integrator->reset(0.0, vec({1.0}), vec({0.0}));
  EXPECT_THROW(integrator->advance(0.5), PlantError);
  EXPECT_EQ(integrator->x()[0], 1.0);
  EXPECT_EQ(integrator->time_s(), 0.0);
  EXPECT_THROW(make_integrator(system, {.method = GetParam(), .relative_tolerance = 0.0}),
               std::invalid_argument);
  EXPECT_THROW(make_integrator(system, {.method = GetParam(), .absolute_tolerance = std::nan("")}),
               std::invalid_argument);
}

struct Kind {
  MakeKind kind;
  MassModel mass;
};

SegmentVector end_of(const Kind& kind, IntegratorMethod method, double tolerance, double lag_s) {
  PlantSettings settings = paper_arm(kind.mass, 2);
  settings.kind = kind.kind(2);
  settings.valves.lag_s = lag_s;
  settings.method = method;
  settings.relative_tolerance = tolerance;
  settings.absolute_tolerance = 1e-2 * tolerance;
  settings.initial_u_rad = vec({0.5, -0.3, 0.2, 0.6});
  ArmPlant plant(settings);
  for (int k = 0; k < 20; ++k) plant.advance(5e-3 * (k + 1), drive_bar(0.5 + 5e-3 * k, 2));
  EXPECT_EQ(plant.counters().retries, 0);
  return plant.u_rad();
}

TEST_P(Integrators, AgreeOnEveryKindOfPlantBehindValvesAndWithout) {
  for (const Kind& kind : {Kind{kPcc, MassModel::point},
                           {kPcc, MassModel::distributed},
                           {kRefined, MassModel::distributed},
                           {kLinks, MassModel::distributed}}) {
    for (const double lag_s : {0.0, 0.02}) {
      const SegmentVector tight = end_of(kind, IntegratorMethod::cash4, 1e-10, lag_s);
      const auto error = [&](double tolerance) {
        return (end_of(kind, GetParam(), tolerance, lag_s) - tight).lpNorm<Eigen::Infinity>();
      };
      EXPECT_LT(error(1e-4), 2e-3) << kind.kind(2).name() << " lag " << lag_s;
      EXPECT_LT(error(1e-6), 2e-5) << kind.kind(2).name() << " lag " << lag_s;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, Integrators, ::testing::ValuesIn(kMethods));

// Held commands: a one-step method takes one step a millisecond and keeps its matrix; a multistep
// method that starts again needs many. What a step leaves of Newton's iteration must not add up.
TEST(HeldCommands, CostAOneStepMethodOneStepAndAlmostNoError) {
  const auto run = [](IntegratorMethod method, double relative, double absolute) {
    PlantSettings settings = paper_arm(MassModel::distributed, 3);
    settings.method = method;
    settings.relative_tolerance = relative;
    settings.absolute_tolerance = absolute;
    ArmPlant plant(settings);
    for (int k = 0; k < 300; ++k) plant.advance(1e-3 * (k + 1), drive_bar(1e-3 * k));
    return std::pair{plant.u_rad(), plant.counters()};
  };
  const auto [tight, unused] = run(IntegratorMethod::cash4, 1e-9, 1e-11);
  const auto [held, cheap] = run(IntegratorMethod::sdirk2, 1e-3, 1e-4);
  const auto [restarted, dear] = run(IntegratorMethod::cvode_bdf, 1e-6, 1e-8);
  EXPECT_LT((held - tight).lpNorm<Eigen::Infinity>(), 1e-5);
  EXPECT_LT((restarted - tight).lpNorm<Eigen::Infinity>(), 1e-4);
  EXPECT_LE(cheap.steps, 310);
  EXPECT_LT(cheap.linearizations, 60);
  EXPECT_GT(dear.steps, 10 * cheap.steps);
  EXPECT_GE(dear.linearizations, 299);
}

TEST(OneStepMethod, TakesRatesOfAMillionInItsStride) {
  // Rates of 1e7 1/s beside a motion of seconds: the stiff one must neither ring nor force small
  // steps.
  Oscillators system(vec({1e-9, 1.0}), vec({1e-2, 0.5}), vec({1.0, 10.0}));
  const auto integrator = make_integrator(system, {});
  integrator->reset(0.0, vec({0.1, 0.1}), vec({0.0, 0.0}));
  integrator->advance(2.0);
  EXPECT_NEAR(integrator->x()[0], 0.1 * std::exp(-2.0 / 1e-2), 1e-7);
  EXPECT_NEAR(integrator->x()[1], released(1.0, 0.5, 10.0, 0.1, 2.0), 1e-5);
  EXPECT_LT(integrator->counters().steps, 2000);
}

TEST(OneStepMethod, AStepInTheForceNeedsNoRestart) {
  Oscillators system(vec({1.0}), vec({2.0}), vec({100.0}));
  const auto integrator = make_integrator(system, {.relative_tolerance = 1e-9,
                                                   .absolute_tolerance = 1e-11,
                                                   .absolute_tolerance_velocity = 1e-9});
  integrator->reset(0.0, vec({0.0}), vec({0.0}));
  // Superposition of steps, each of which is known.
  const auto step = [](double t) {
    return t > 0.0 ? (1.0 - released(1.0, 2.0, 100.0, 1.0, t)) / 100.0 : 0.0;
  };
  double expected = 0.0;
  for (int k = 0; k < 500; ++k) {
    system.force[0] = (k / 7) % 2 == 0 ? 1.0 : -2.0;
    integrator->advance(1e-3 * (k + 1));
  }
  for (int k = 0; k < 500; ++k) {
    const double now = (k / 7) % 2 == 0 ? 1.0 : -2.0;
    const double before = k == 0 ? 0.0 : ((k - 1) / 7) % 2 == 0 ? 1.0 : -2.0;
    expected += (now - before) * step(0.5 - 1e-3 * k);
  }
  EXPECT_NEAR(integrator->x()[0], expected, 1e-10);
  EXPECT_LT(integrator->counters().linearizations, 50);
}

TEST(OneStepMethod, AFailureThatPassesIsRetriedAndForgotten) {
  Oscillators healthy(vec({1.0}), vec({0.3}), vec({40.0}));
  Oscillators sick = healthy;
  const auto one = make_integrator(healthy, {});
  const auto two = make_integrator(sick, {});
  for (Integrator* integrator : {one.get(), two.get()}) {
    integrator->reset(0.0, vec({1.0}), vec({0.0}));
    integrator->advance(0.1);
  }
  sick.failures_left = 15;  // more than one call's own attempts
  one->advance(0.2);
  two->advance(0.2);
  EXPECT_EQ(two->counters().retries, 1);
  EXPECT_NEAR(one->x()[0], two->x()[0], 1e-5);
}

TEST(OneStepMethod, GoingNowhereChangesNothing) {
  Oscillators system(vec({1.0}), vec({0.3}), vec({40.0}));
  const auto integrator = make_integrator(system, {});
  integrator->reset(1.0, vec({1.0}), vec({0.0}));
  integrator->advance(1.0);
  integrator->advance(0.5);
  EXPECT_EQ(integrator->time_s(), 1.0);
  EXPECT_EQ(integrator->x()[0], 1.0);
}

}  // namespace
}  // namespace softarm
