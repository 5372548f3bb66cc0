// What MaterialSettings add to K u, against closed forms of one segment without weight.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <stdexcept>
#include <vector>

#include "dense_solvers.hpp"
#include "softarm/actuation/chamber_hysteresis.hpp"
#include "softarm/model/dynamics.hpp"
#include "softarm/model/memory.hpp"
#include "softarm/simulation/arm_plant.hpp"
#include "unit/simulation/paper_arm.hpp"

namespace softarm {
namespace {

/// One segment without weight, so little damped that it follows its moment.
PlantSettings weightless(const MaterialSettings& material) {
  PlantSettings settings = paper_arm(MassModel::distributed, 1);
  settings.arm.gravity_mps2.setZero();
  settings.material = material;
  return settings;
}

/// The bend in the direction of chamber 1, after that chamber was held for `held_s`.
double bend_after(ArmPlant& plant, double bar, double held_s) {
  const double end_s = plant.time_s() + held_s;
  plant.command(std::vector<double>{bar, 0.0, 0.0, 0.0});
  while (plant.time_s() < end_s - 1e-9) plant.advance(std::min(plant.time_s() + 0.01, end_s));
  return -plant.u_rad()[0];
}

double stiffness(const PlantSettings& settings) {
  return settings.arm.segments[0].stiffness_nm_per_rad;
}
double gain(const PlantSettings& settings) {
  return settings.actuation.segments[0][0].gain_nm_per_bar;
}

TEST(Material, CubicStiffnessBendsAsItsPolynomial) {
  const PlantSettings settings = weightless({.cubic_per_rad2 = 0.7});
  ArmPlant plant(settings);
  for (const double bar : {0.5, 1.5}) {
    const double u = bend_after(plant, bar, 8.0);
    EXPECT_NEAR(stiffness(settings) * u * (1.0 + 0.7 * u * u), gain(settings) * bar, 1e-5);
  }
}

TEST(Material, PressureStiffensTheSegmentItIsIn) {
  const PlantSettings settings = weightless({.stiffening_per_bar = 0.4});
  ArmPlant plant(settings);
  plant.command(std::vector<double>{1.2, 0.0, 0.5, 0.0});
  for (int k = 1; k <= 800; ++k) plant.advance(0.01 * k);
  EXPECT_NEAR(-plant.u_rad()[0] * stiffness(settings) * (1.0 + 0.4 * 1.7), gain(settings) * 0.7,
              1e-5);
}

/// Held until the Maxwell element has relaxed, u = tau / K; released, m / (1 + m) of that is left,
/// and goes with the time constant (1 + m) T, nearly.
TEST(Material, AnArmThatWasHeldBentComesBackBent) {
  const double m = 0.3, relaxation_s = 4.0;
  const PlantSettings settings = weightless({.remanence = m, .remanence_s = relaxation_s});
  ArmPlant plant(settings);
  const double at_once = bend_after(plant, 1.0, 0.0) + gain(settings) / stiffness(settings);
  const double held = bend_after(plant, 1.0, 60.0);
  EXPECT_NEAR(held, at_once, 1e-5);
  // The slow one of the two rates of d u' = -K u - m K (u - z), T z' = u - z.
  const double fast = stiffness(settings) / settings.arm.segments[0].damping_nms_per_rad;
  const double sum = fast * (1.0 + m) + 1.0 / relaxation_s;
  const double slow = 0.5 * (sum - std::sqrt(sum * sum - 4.0 * fast / relaxation_s));
  double left = bend_after(plant, 0.0, 1.0);
  EXPECT_NEAR(left, held * m / (1.0 + m) * std::exp(-1.0 / ((1.0 + m) * relaxation_s)),
              0.03 * held);
  for (int k = 0; k < 5; ++k) {
    const double later = bend_after(plant, 0.0, 2.0);
    EXPECT_NEAR(later / left, std::exp(-2.0 * slow), 2e-4);
    left = later;
  }
}

/// The step response with two Maxwell elements against exp(A t) of (u, u', z_1, z_2).
TEST(Material, TwoMaxwellElementsRelaxWithTwoTimes) {
  PlantSettings settings =
      weightless({.remanence = 0.3, .remanence_s = 4.0, .remanence_2 = 0.2, .remanence_2_s = 0.8});
  ArmPlant plant(settings);
  const double k = stiffness(settings), force = 0.5 * gain(settings);
  const SegmentParameters& segment = settings.arm.segments[0];
  DynamicsWorkspace workspace(settings.arm);
  Eigen::MatrixXd inertia(2, 2);
  inertia_matrix(settings.arm, workspace, Eigen::Vector2d::Zero(), inertia);
  const double b = inertia(0, 0), m_1 = 0.3, m_2 = 0.2;  // at small bends
  Eigen::Matrix4d rates;
  rates << 0.0, 1.0, 0.0, 0.0,  //
      -k * (1.0 + m_1 + m_2) / b, -segment.damping_nms_per_rad / b, k * m_1 / b, k * m_2 / b,
      1.0 / 4.0, 0.0, -1.0 / 4.0, 0.0,  //
      1.0 / 0.8, 0.0, 0.0, -1.0 / 0.8;
  const Eigen::Vector4d settled = force / k * Eigen::Vector4d(1.0, 0.0, 1.0, 1.0);
  double bend = 0.0;
  for (const double t : {0.4, 1.0, 2.0, 4.0, 8.0, 20.0}) {
    bend = bend_after(plant, 0.5, t - plant.time_s());
    const double expected = (settled - test::exponential(rates * t) * settled)[0];
    EXPECT_NEAR(bend, expected, 1e-3 * settled[0]) << t;
  }
  // Before anything relaxes the arm is stiffer by both, in the end by none.
  EXPECT_NEAR(bend, settled[0], 0.02 * settled[0]);
}

/// Pushed along its axis, an arm that stretches comes to e = F / K_a in the end, from 1 / (1 + m_1 +
/// m_2) of that; its bend, which has no such element, does at once.
TEST(Material, LengthRelaxesWhereTheArmStretches) {
  PlantSettings settings = stretching(weightless({.remanence_s = 3.0,
                                                  .remanence_2_s = 0.6,
                                                  .axial_remanence = 0.4,
                                                  .axial_remanence_2 = 0.3}));
  const auto lengthened = [](const PlantSettings& of, double seconds) {
    ArmPlant plant(of);
    plant.command(std::vector<double>{0.5, 0.5, 0.5, 0.5});
    for (int i = 1; i <= 200; ++i) plant.advance(seconds * i / 200);
    return plant.elongation_m()[0];
  };
  PlantSettings elastic = settings;
  elastic.material = {};
  const double in_the_end = lengthened(elastic, 40.0);
  ASSERT_GT(std::abs(in_the_end), 1e-4);
  EXPECT_NEAR(lengthened(settings, 40.0), in_the_end, 1e-3 * std::abs(in_the_end));
  EXPECT_NEAR(lengthened(settings, 0.3) / in_the_end, 1.0 / 1.7, 0.1);
}

/// Slow loading and unloading against the integrals of dz/du = 1 -+ ... for exponent 1: loading,
/// z = r (1 - exp(-u / r)) for any shape; unloading, a straight line for shape 1/2 and
/// (z_m + r) exp((u - u_m) / r) - r for shape 1.
TEST(Material, BoucWenFollowsItsClosedForm) {
  const double part = 0.6, r = 0.15;
  for (const double shape : {0.5, 1.0}) {
    PlantSettings settings =
        weightless({.bouc_wen = part, .bouc_wen_rad = r, .bouc_wen_shape = shape});
    settings.valves.lag_s = 0.3;  // no overshoot
    ArmPlant plant(settings);
    const double k = stiffness(settings);
    const double top = bend_after(plant, 0.5, 6.0);
    const double z_top = r * (1.0 - std::exp(-top / r));
    EXPECT_NEAR(k * (top + part * z_top), gain(settings) * 0.5, 1e-5) << shape;
    const double back = bend_after(plant, 0.44, 6.0);
    const double z_back =
        shape == 0.5 ? z_top + back - top : (z_top + r) * std::exp((back - top) / r) - r;
    ASSERT_GT(z_back, 0.0);
    EXPECT_NEAR(k * (back + part * z_back), gain(settings) * 0.44, 1e-5) << shape;
  }
}

/// As SlipSpring does where its knee is sharp; and a loop costs energy, however it is walked.
TEST(Material, BoucWenSaturatesInEveryDirectionAndDissipates) {
  const BoucWen sharp{.limit_rad = 0.1, .exponent = 20.0};
  const SlipSpring slips{.radius_rad = 0.1, .stiffness_nm_per_rad = 1.0};
  for (const double angle : {0.0, 0.7, 2.9}) {
    const Eigen::Vector2d u = 0.5 * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    EXPECT_LT((sharp.step({0.0, 0.0}, u) - slips.moment({0.0, 0.0}, u)).norm(), 1e-4);
  }
  std::mt19937 random(3);
  std::uniform_real_distribution<double> bend(-0.4, 0.4), shape(0.5, 1.0), exponent(1.0, 4.0);
  for (int loop = 0; loop < 20; ++loop) {
    const BoucWen element{.limit_rad = 0.1, .exponent = exponent(random), .shape = shape(random)};
    std::vector<Eigen::Vector2d> corner(5);
    for (Eigen::Vector2d& each : corner) each = {bend(random), bend(random)};
    Eigen::Vector2d z = Eigen::Vector2d::Zero(), u = corner.back();
    double work = 0.0;
    for (int turn = 0; turn < 3; ++turn) {
      work = 0.0;
      for (const Eigen::Vector2d& to : corner) {
        const Eigen::Vector2d part = (to - u) / 200.0;
        for (int i = 0; i < 200; ++i) {
          const Eigen::Vector2d next = element.step(z, part);
          work += 0.5 * (z + next).dot(part);
          z = next;
          EXPECT_LT(z.norm(), 0.1 * (1.0 + 1e-6));
        }
        u = to;
      }
    }
    EXPECT_GT(work, 0.0);
  }
}

/// Chambers of segment 2 push on segment 1 as configured, whether segments stretch or not.
TEST(Plant, ChambersPushOnOtherSegments) {
  for (const bool stretches : {false, true}) {
    PlantSettings settings = paper_arm(MassModel::distributed, 2);
    settings.arm.gravity_mps2.setZero();
    settings.arm.extensible = stretches;
    ArmPlant alone(settings);
    settings.cross_nm_per_bar.assign(4 * 8, 0.0);
    settings.cross_nm_per_bar[4 * 5 + 0] = 0.2;   // chamber 2 of segment 2, u_x of segment 1
    settings.cross_nm_per_bar[4 * 5 + 1] = -0.1;  // u_y
    ArmPlant coupled(settings);
    const std::vector<double> bar{0.3, 0.0, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0};
    for (ArmPlant* plant : {&alone, &coupled}) plant->advance(6.0, bar);
    Eigen::VectorXd expected = alone.u_rad();
    expected.head<2>() += 0.5 * Eigen::Vector2d(0.2, -0.1) / stiffness(settings);
    EXPECT_LT((coupled.u_rad() - expected).norm(), 1e-5);
    settings.cross_nm_per_bar.pop_back();
    EXPECT_THROW(ArmPlant{settings}, std::invalid_argument);
  }
}

TEST(Material, EnergyBalances) {
  PlantSettings settings = paper_arm();
  settings.material = {.hysteresis = 0.2,
                       .cubic_per_rad2 = 0.5,
                       .stiffening_per_bar = 0.1,
                       .remanence = 0.2,
                       .remanence_s = 2.0,
                       .remanence_2 = 0.1,
                       .remanence_2_s = 0.3,
                       .bouc_wen = 0.3};
  settings.valves.lag_s = 0.05;
  settings.valves.vent_lag_s = 0.2;
  settings.initial_u_rad = Eigen::VectorXd::Constant(6, 0.4);
  settings.account_energy = true;
  settings.relative_tolerance = 1e-7;
  settings.absolute_tolerance = 1e-9;
  ArmPlant plant(settings);
  const PlantEnergies start = plant.energies();
  for (int k = 0; k < 500; ++k) {
    plant.advance(2e-3 * (k + 1), drive_bar(2e-3 * k));
    const PlantEnergies now = plant.energies();
    EXPECT_NEAR(now.kinetic + now.potential - start.kinetic - start.potential,
                now.supplied - now.dissipated, 1e-5);
  }
  EXPECT_GT(plant.energies().dissipated, 0.05);
}

TEST(Material, OtherKindsRefuseWhatTheyDoNotSimulate) {
  for (const MakeKind kind : {kRefined, kLinks}) {
    PlantSettings settings = paper_arm();
    settings.kind = kind(4);
    settings.material.cubic_per_rad2 = 0.1;
    EXPECT_THROW(ArmPlant{settings}, std::invalid_argument);
    settings.material = {.hysteresis = 0.1};
    EXPECT_NO_THROW(ArmPlant{settings});
  }
}

double through(const ChamberHysteresis& hysteresis, double bar) {
  Eigen::VectorXd pressure = Eigen::VectorXd::Constant(1, bar);
  hysteresis.apply(pressure);
  return pressure[0];
}

/// From a to b and back, a play operator of half width r encloses 2 r (b - a - 2 r).
TEST(ChamberHysteresis, ALoopEnclosesTheAreaOfItsOperators) {
  const double part = 0.3, a = 0.2, b = 1.7;
  const std::vector<double> widths{0.05, 0.2};
  ChamberHysteresis hysteresis(part, widths, 1);
  const auto travel = [&](double from, double to) {
    double area = 0.0;
    constexpr int kSteps = 3000;
    for (int k = 1; k <= kSteps; ++k) {
      const double before = from + (to - from) * (k - 1) / kSteps;
      const double now = from + (to - from) * k / kSteps;
      const double acting = through(hysteresis, before);
      hysteresis.remember(Eigen::VectorXd::Constant(1, now));
      area += 0.5 * (acting + through(hysteresis, now)) * (now - before);
    }
    return area;
  };
  travel(0.0, b);
  const double enclosed = -travel(b, a) - travel(a, b);
  double expected = 0.0;
  for (const double r : widths) expected += part / 2.0 * 2.0 * r * (b - a - 2.0 * r);
  EXPECT_NEAR(enclosed, expected, 1e-4);
}

/// Neither the rate nor a small loop on the way leaves a trace, and looking ahead is free.
TEST(ChamberHysteresis, RemembersTurningPointsOnly) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> part(0.0, 1.0);
  const std::vector<double> widths{0.02, 0.05, 0.1};
  ChamberHysteresis at_once(0.4, widths, 1), in_pieces = at_once;
  double bar = 0.0;
  for (int leg = 0; leg < 50; ++leg) {
    const double to = 2.0 * part(random);
    at_once.remember(Eigen::VectorXd::Constant(1, to));
    for (int k = 1; k <= 20; ++k) {
      in_pieces.remember(Eigen::VectorXd::Constant(1, bar + (to - bar) * k / 20.0));
      through(in_pieces, 3.0 * part(random));
    }
    bar = to;
    EXPECT_NEAR(through(at_once, bar), through(in_pieces, bar), 1e-14);
    const double back = 0.5 * (bar + 1.0);
    ChamberHysteresis looped = at_once;
    looped.remember(Eigen::VectorXd::Constant(1, back));
    looped.remember(Eigen::VectorXd::Constant(1, bar));
    looped.remember(Eigen::VectorXd::Constant(1, back));
    ChamberHysteresis once = at_once;
    once.remember(Eigen::VectorXd::Constant(1, back));
    EXPECT_NEAR(through(looped, back), through(once, back), 1e-14);
  }
}

}  // namespace
}  // namespace softarm
