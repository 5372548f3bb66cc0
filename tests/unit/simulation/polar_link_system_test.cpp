// Two charts of one arm: what is true of one must be true of the other.
#include "simulation/polar_link_system.hpp"

#include <gtest/gtest.h>

#include "softarm/simulation/arm_plant.hpp"
#include "unit/simulation/paper_arm.hpp"

namespace softarm {
namespace {

PlantSettings links(LinkJoints joints) {
  PlantSettings settings = paper_arm(MassModel::distributed, 2);
  settings.kind = PlantKind::links;
  settings.links.links_per_segment = 3;
  settings.links.joints = joints;
  settings.initial_u_rad = Eigen::Vector4d(0.6, 0.2, -0.3, 0.5);
  return settings;
}

TEST(PolarLinkSystem, MovesAsTheCrossedJointsDo) {
  PlantSettings settings = links(LinkJoints::crossed);
  settings.relative_tolerance = 1e-8;
  settings.absolute_tolerance = 1e-10;
  ArmPlant crossed(settings);
  settings.links.joints = LinkJoints::polar;
  ArmPlant polar(settings);
  const std::vector<double> pressures = {0.4, 0.0, 0.0, 0.2, 0.0, 0.3, 0.1, 0.0};
  crossed.advance(0.3, pressures);
  polar.advance(0.3, pressures);
  // The rotor alone makes them differ.
  EXPECT_LT((crossed.u_rad() - polar.u_rad()).cwiseAbs().maxCoeff(), 1e-5);
  EXPECT_LT((crossed.tip_m() - polar.tip_m()).norm(), 1e-6);
}

TEST(PolarLinkSystem, AccelerationMakesTheResidualZeroAndTheFitAgrees) {
  PolarLinkSystem polar(links(LinkJoints::polar));
  LinkSystem crossed(links(LinkJoints::crossed));
  const Eigen::Index n = polar.size();
  const Eigen::Vector4d u(0.6, 0.2, -0.3, 0.5), rate(1.0, -2.0, 0.5, 0.3);
  Eigen::VectorXd q(n), v(n), a(n), r(n), x(n), w(n);
  polar.spread(u, q);
  polar.spread_rate(u, rate, v);
  crossed.spread(u, x);
  crossed.spread_rate(u, rate, w);
  EXPECT_NEAR(polar.kinetic_energy_j(q, v), crossed.kinetic_energy_j(x, w), 1e-9);
  EXPECT_NEAR(polar.potential_energy_j(q), crossed.potential_energy_j(x), 1e-14);
  Eigen::VectorXd one(4), other(4), one_rate(4), other_rate(4);
  polar.curvature(q, v, one, one_rate);
  crossed.curvature(x, w, other, other_rate);
  EXPECT_LT((one - other).norm() + (one_rate - other_rate).norm(), 1e-13);
  ASSERT_TRUE(polar.acceleration(0.0, q, v, a));
  polar.residual(0.0, q, v, a, r);
  EXPECT_LT(r.norm(), 1e-9);
}

TEST(PolarLinkSystem, AStraightJointKnowsOnlyItsOwnDirection) {
  PolarLinkSystem system(links(LinkJoints::polar));
  const Eigen::Index n = system.size();
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(n);
  // A moment across phi = 0 finds nothing to act on: the chart's fault, and the reason for the
  // other.
  const Eigen::Vector4d across(0.0, 0.3, 0.0, 0.3);
  system.drive(0.0, across, across, 0.0);
  Eigen::VectorXd a(n);
  ASSERT_TRUE(system.acceleration(0.0, zero, zero, a));
  EXPECT_LT(a.norm(), 1e-9);
}

}  // namespace
}  // namespace softarm
