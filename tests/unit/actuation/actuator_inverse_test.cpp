// The inverse against the plant's forward model, stepped by itself: lag, play operators and torque.
#include "softarm/actuation/actuator_inverse.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>

namespace softarm {
namespace {

constexpr double kPeriod_s = 2e-3;
constexpr double kTarget_s = 0.05;

ArmParameters one_segment_arm() {
  ArmParameters arm;
  arm.segments = {{.length_m = 0.3, .mass_kg = 0.3, .stiffness_nm_per_rad = 1.0}};
  return arm;
}

ActuationSettings four_chambers() {
  ActuationSettings actuation;
  actuation.segments.resize(1);
  for (int j = 0; j < 4; ++j) actuation.segments[0].push_back({0.5 * std::numbers::pi * j, 0.3});
  actuation.min_pressure_bar = -1e3;  // no limit gets in the way
  actuation.max_pressure_bar = 1e3;
  return actuation;
}

ActuatorInverseSettings everything() {
  ActuatorInverseSettings it;
  it.fill_lag_s = {0.3, 0.2, 0.25, 0.3};
  it.vent_lag_s = {0.7, 0.9, 0.8, 0.6};
  it.hysteresis = 0.4;
  return it;
}

/// u_ref = 0.2 (sin, cos) of a growing angle.
struct Motion {
  SegmentVector u = SegmentVector::Zero(2), velocity = SegmentVector::Zero(2);
  void at(double t_s) {
    u << 0.2 * std::sin(2.0 * t_s), 0.2 * std::cos(2.0 * t_s);
    velocity << 0.4 * std::cos(2.0 * t_s), -0.4 * std::sin(2.0 * t_s);
  }
  operator ActuatorInverse::Motion() const { return {u, u, velocity}; }
};

TEST(ChamberHysteresis, PressureIsTheInverseOfWhatActs) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> bar(-0.5, 2.0);
  ChamberHysteresis hysteresis(0.6, {0.0, 0.02, 0.05, 0.1, 0.3}, 2);
  for (int turn = 0; turn < 200; ++turn) {
    hysteresis.remember(Eigen::Vector2d(bar(random), bar(random)));
    double before = -std::numeric_limits<double>::infinity();
    for (double acting = -1.0; acting < 3.0; acting += 0.01) {
      const double pressure = hysteresis.pressure(1, acting);
      ASSERT_NEAR(hysteresis.acting(1, pressure), acting, 1e-13);
      const double slope = (pressure - before) / 0.01;
      if (std::isfinite(slope)) {
        ASSERT_GE(slope, 1.0 - 1e-9);
        ASSERT_LE(slope, 1.0 / (1.0 - 0.6) + 1e-9);
      }
      before = pressure;
    }
  }
}

/// Chambers that are not linear, behind their inverse, act as the linear lag does.
TEST(ActuatorInverse, MakesChambersActAsOneLag) {
  const ActuationSettings actuation = four_chambers();
  const PressureAllocator allocator(actuation);
  ActuatorInverse inverse(one_segment_arm(), actuation, everything(), kTarget_s, kPeriod_s);
  Motion motion;
  Allocation allocation, linear;
  // The plant.
  PressureVector pressure = PressureVector::Zero(4), acting = pressure;
  ChamberHysteresis hysteresis(0.4, everything().play_bar, 4);
  PressureVector expected = pressure;
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0.0, 0.01);
  SegmentVector tau(2), effective(2);
  for (int k = 0; k < 5000; ++k) {
    const double t_s = k * kPeriod_s;
    motion.at(t_s);
    tau << 0.1 * std::sin(2.0 * t_s) + noise(random), 0.05 * std::cos(3.0 * t_s) + noise(random);
    inverse.allocate(allocator, tau, motion, allocation);
    inverse.sent(allocator, allocation.pressures_bar, motion, effective);
    ASSERT_LE((effective - tau).cwiseAbs().maxCoeff(), 1e-12);
    allocator.allocate(tau, linear);
    for (Eigen::Index j = 0; j < 4; ++j) {
      const auto i = static_cast<std::size_t>(j);
      const FillVentLag lag{everything().fill_lag_s[i], everything().vent_lag_s[i]};
      pressure[j] = lag.step(pressure[j], allocation.pressures_bar[j], kPeriod_s);
      expected[j] += -std::expm1(-kPeriod_s / kTarget_s) * (linear.pressures_bar[j] - expected[j]);
    }
    hysteresis.remember(pressure);
    acting = pressure;
    hysteresis.apply(acting);
    inverse.advance(kPeriod_s, allocation.pressures_bar);
    ASSERT_LE((acting - expected).cwiseAbs().maxCoeff(), 1e-12) << k;
  }
}

/// Limits keep a chamber from following: the inverse knows, and goes on from where the chamber is.
TEST(ActuatorInverse, KnowsWhatLimitsTookAndDoesNotWindUp) {
  const ActuationSettings actuation = four_chambers();
  const PressureAllocator allocator(actuation);
  ActuatorInverse inverse(one_segment_arm(), actuation, everything(), kTarget_s, kPeriod_s);
  ActuatorInverse fresh = inverse;
  Motion motion;
  Allocation allocation, again;
  SegmentVector tau = SegmentVector::Constant(2, 5.0), effective(2);
  for (int k = 0; k < 500; ++k) {
    inverse.allocate(allocator, tau, motion, allocation);
    const PressureVector limited = allocation.pressures_bar.cwiseMax(0.0).cwiseMin(0.1);
    inverse.sent(allocator, limited, motion, effective);
    ASSERT_LT(effective.norm(), tau.norm());
    inverse.advance(kPeriod_s, limited);
    fresh.advance(kPeriod_s, limited);
  }
  tau.setConstant(-0.01);
  inverse.allocate(allocator, tau, motion, allocation);
  fresh.allocate(allocator, tau, motion, again);
  EXPECT_EQ(allocation.pressures_bar, again.pressures_bar) << "what was asked leaves no trace";
}

/// Set points grow with what is asked, without a step, for any state that the chambers come to.
TEST(ActuatorInverse, IsMonotoneAndContinuous) {
  ActuationSettings actuation = four_chambers();
  const PressureAllocator allocator(actuation);
  ActuatorInverse inverse(one_segment_arm(), actuation, everything(), kTarget_s, kPeriod_s);
  std::mt19937 random(11);
  std::uniform_real_distribution<double> bar(0.0, 1.0);
  Motion motion;
  Allocation allocation;
  const double steepest = 0.9 / kTarget_s / (1.0 - 0.4) * 1.05;  // 5 %: of finite periods
  for (int state = 0; state < 50; ++state) {
    inverse.advance(0.3, PressureVector::NullaryExpr(4, [&](auto) { return bar(random); }));
    double before = 0.0, asked_before = 0.0;
    for (int k = 0; k < 400; ++k) {
      const SegmentVector tau = SegmentVector::Unit(2, 0) * (1e-3 * k - 0.2);
      Allocation asked;
      allocator.allocate(tau, asked);
      inverse.allocate(allocator, tau, motion, allocation);
      for (Eigen::Index j = 1; j < 2; ++j) {
        if (k > 0) {
          const double slope =
              (allocation.pressures_bar[j] - before) / (asked.pressures_bar[j] - asked_before);
          ASSERT_GT(slope, 0.0);
          ASSERT_LT(slope, steepest);
        }
        before = allocation.pressures_bar[j];
        asked_before = asked.pressures_bar[j];
      }
    }
  }
}

/// At rest the chambers hold u against a spring that their pressures stiffen, and one that slipped.
TEST(ActuatorInverse, HoldsAgainstStiffeningAndSlip) {
  const ActuationSettings actuation = [] {
    ActuationSettings it = four_chambers();
    it.min_pressure_bar = 0.0;
    it.max_pressure_bar = 5.0;
    return it;
  }();
  const PressureAllocator allocator(actuation);
  ActuatorInverseSettings settings;
  settings.stiffening_per_bar = 0.3;
  settings.slip_radius_rad = {0.05, 0.5};
  settings.slip_stiffness_nm_per_rad = {0.4, 0.2};
  ActuatorInverse inverse(one_segment_arm(), actuation, settings, 0.0, kPeriod_s);
  Motion motion;
  motion.u << 0.15, -0.1;
  Allocation allocation;
  SegmentVector tau(2), force(2), effective(2);
  tau << 0.1, 0.15;  // K u: A_chamber tau = (tau_y, -tau_x)
  inverse.allocate(allocator, tau, motion, allocation);
  allocator.generalized_force(allocation.pressures_bar, force);
  const double size = motion.u.norm();
  const double slip = 0.4 * 0.05 / size + 0.2;  // the first has slipped, the second has not
  const Eigen::Vector2d held = (1.0 + 0.3 * allocation.pressures_bar.sum() + slip) * motion.u;
  // Stiffening times bend over gain is 1/4: three corrections leave 1/64 of what is to be added.
  const double rest = (held - motion.u).norm() / 64.0;
  EXPECT_LE((force - held).norm(), rest);
  inverse.sent(allocator, allocation.pressures_bar, motion, effective);
  EXPECT_LE((effective - tau).norm(), rest);
}

/// Weights follow the disturbance that their error makes, and stay where they are without it.
TEST(ActuatorInverse, LearnsTheWeightsThatTheDisturbanceShows) {
  ActuationSettings actuation = four_chambers();
  actuation.min_pressure_bar = -2.0;
  actuation.max_pressure_bar = 2.0;
  const PressureAllocator allocator(actuation);
  ActuatorInverseSettings settings;
  settings.play_bar = {0.02, 0.1};
  settings.learn_hysteresis = true;
  ActuatorInverse inverse(one_segment_arm(), actuation, settings, kTarget_s, kPeriod_s);
  ChamberHysteresis plant(0.2, settings.play_bar, 4);
  PressureVector pressure = PressureVector::Zero(4);
  Motion motion;
  Allocation allocation;
  SegmentVector tau(2), effective(2), disturbance(2);
  double before_nm = 0.0, after_nm = 0.0;  // largest unexplained force
  for (int k = 0; k < 30000; ++k) {
    const double t_s = k * kPeriod_s;
    tau << 0.2 * std::sin(2.0 * t_s), 0.1 * std::cos(3.0 * t_s);
    inverse.allocate(allocator, tau, motion, allocation);
    inverse.sent(allocator, allocation.pressures_bar, motion, effective);
    inverse.advance(kPeriod_s, allocation.pressures_bar);
    pressure = inverse.modelled_pressure_bar();
    plant.remember(pressure);
    PressureVector acts = pressure, known = pressure;
    plant.apply(acts);
    ChamberHysteresis model = plant;
    model.set_weights(inverse.weights());
    model.apply(known);
    allocator.generalized_force(acts - known, disturbance);
    if (t_s < 9.0) before_nm = std::max(before_nm, disturbance.norm());
    if (t_s > 50.0) after_nm = std::max(after_nm, disturbance.norm());
    disturbance.array() += 0.3;  // what lasts is no hysteresis
    inverse.learn(allocator, motion.u, disturbance, true);
  }
  EXPECT_LT(after_nm, 0.5 * before_nm);
  const Eigen::VectorXd found = inverse.weights();
  inverse.learn(allocator, motion.u, SegmentVector::Constant(2, 1e6), false);
  EXPECT_EQ(inverse.weights(), found);
  for (int k = 0; k < 100; ++k) {
    disturbance.setConstant(k % 2 == 0 ? 1e6 : std::numeric_limits<double>::quiet_NaN());
    inverse.learn(allocator, motion.u, disturbance, true);
    ASSERT_GE(inverse.weights().minCoeff(), 0.0);
    ASSERT_LE(inverse.weights().sum(), 0.6 + 1e-12);
  }
}

TEST(ActuatorInverse, RefusesWhatHasNoInverse) {
  const auto make = [](const ActuatorInverseSettings& settings, double lag_s) {
    ActuatorInverse(one_segment_arm(), four_chambers(), settings, lag_s, kPeriod_s);
  };
  EXPECT_NO_THROW(make(everything(), kTarget_s));
  EXPECT_THROW(make(everything(), 0.0), std::invalid_argument) << "a lag cannot be taken away";
  ActuatorInverseSettings settings;
  settings.hysteresis = 1.0;
  EXPECT_THROW(make(settings, kTarget_s), std::invalid_argument);
  settings = {};
  settings.fill_lag_s = {0.1};
  EXPECT_THROW(make(settings, kTarget_s), std::invalid_argument) << "one for four chambers";
  settings = {};
  settings.slip_radius_rad = {0.1, 0.2};
  EXPECT_THROW(make(settings, kTarget_s), std::invalid_argument);
}

}  // namespace
}  // namespace softarm
