// Distributed mass against its definition: many point masses along the arc, weighted by a
// quadrature that is exact to round-off, each with the Jacobian of an arm cut off at that point.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "softarm/model/dynamics.hpp"
#include "softarm/model/kinematics.hpp"
#include "unit/model/random_arm.hpp"

namespace softarm {
namespace {

using testing_support::RandomArm;

struct Quadrature {
  std::vector<double> node, weight;  ///< on [0, 1]
};

/// Gauss-Legendre by Newton's method on the Legendre polynomial, in long double.
Quadrature gauss_legendre(int order) {
  Quadrature rule;
  for (int i = 0; i < order; ++i) {
    long double x = std::cos(3.14159265358979323846L * (i + 0.75L) / (order + 0.5L)), slope = 1;
    for (int iteration = 0; iteration < 50; ++iteration) {
      long double previous = 1, value = x;
      for (int k = 2; k <= order; ++k) {
        const long double next = ((2 * k - 1) * x * value - (k - 1) * previous) / k;
        previous = value;
        value = next;
      }
      slope = order * (x * value - previous) / (x * x - 1);
      x -= value / slope;
    }
    rule.node.push_back(static_cast<double>((1 + x) / 2));
    rule.weight.push_back(static_cast<double>(1 / ((1 - x * x) * slope * slope)));
  }
  return rule;
}

struct Sum {
  Eigen::MatrixXd B, C;
};

Sum sum_of_points(const ArmParameters& arm, const Eigen::VectorXd& u, const Eigen::VectorXd& v,
                  const Quadrature& rule) {
  const int dof = arm.dof();
  Sum sum{Eigen::MatrixXd::Zero(dof, dof), Eigen::MatrixXd::Zero(dof, dof)};
  for (int m = 0; m < arm.size(); ++m) {
    for (std::size_t k = 0; k < rule.node.size(); ++k) {
      // The arm up to the point at arc fraction x of segment m: the last piece is x L long and
      // bends by x u.
      const double x = rule.node[k];
      ArmParameters cut = arm;
      cut.segments.resize(static_cast<std::size_t>(m + 1));
      cut.segments.back().length_m *= x;
      Eigen::VectorXd scale = Eigen::VectorXd::Ones(2 * m + 2);
      scale.tail<2>().setConstant(x);
      const Eigen::VectorXd cut_u = u.head(2 * m + 2).cwiseProduct(scale);
      const Eigen::VectorXd cut_v = v.head(2 * m + 2).cwiseProduct(scale);
      Eigen::Matrix3Xd J(3, 2 * m + 2), rate(3, 2 * m + 2);
      tip_jacobians(cut, cut_u, cut_v, J, rate);
      J = J * scale.asDiagonal();
      rate = rate * scale.asDiagonal();
      const double mass = rule.weight[k] * arm.segments[static_cast<std::size_t>(m)].mass_kg;
      sum.B.topLeftCorner(2 * m + 2, 2 * m + 2) += mass * J.transpose() * J;
      sum.C.topLeftCorner(2 * m + 2, 2 * m + 2) += mass * J.transpose() * rate;
    }
  }
  return sum;
}

void expect_equal(const ArmParameters& arm, const Eigen::VectorXd& u, const Eigen::VectorXd& v,
                  const Quadrature& rule, double tolerance) {
  const int dof = arm.dof();
  DynamicsWorkspace workspace(arm);
  Eigen::MatrixXd B(dof, dof), C(dof, dof);
  Eigen::VectorXd G(dof);
  dynamics_matrices(arm, workspace, u, v, B, C, G);
  const Sum sum = sum_of_points(arm, u, v, rule);
  const Eigen::VectorXd s = sum.B.diagonal().cwiseSqrt();
  const Eigen::MatrixXd scale = s * s.transpose();
  EXPECT_LE((B - sum.B).cwiseAbs().cwiseQuotient(scale).maxCoeff(), tolerance);
  EXPECT_LE((C - sum.C).cwiseAbs().maxCoeff(),
            tolerance * scale.maxCoeff() * v.cwiseAbs().maxCoeff());
}

TEST(DistributedMass, IsTheIntegralOverTheArc) {
  RandomArm random(1);
  const Quadrature rule = gauss_legendre(40);
  for (int i = 0; i < 300; ++i) {
    const int n = 1 + i % 5;
    const ArmParameters arm = random.arm(n, MassModel::distributed, i % 2 == 0 ? 3.0 : 100.0);
    const auto state = random.state(n, 7.5);
    expect_equal(arm, state.u, state.v, rule, 3e-14);
  }
}

TEST(DistributedMass, HoldsAtSpecialAngles) {
  RandomArm random(2);
  const Quadrature rule = gauss_legendre(40);
  using std::numbers::pi;
  const ArmParameters arm = random.arm(3, MassModel::distributed);
  for (const double theta : {0.0,       5e-324,
                             1e-300,    1e-160,
                             1e-12,     1e-8,
                             1e-4,      1e-2,
                             0.5 * pi,  std::nextafter(2.0, 0.0),
                             2.0,       std::nextafter(2.0, 3.0),
                             pi - 1e-9, pi,
                             pi + 1e-9, std::sqrt(12.0),
                             1.5 * pi,  std::sqrt(33.0),
                             2.0 * pi,  7.0,
                             9.0}) {
    Eigen::VectorXd u(6);
    for (int i = 0; i < 3; ++i) {
      const double phi = random.uniform(-4.0, 4.0);
      u.segment<2>(2 * i) << theta * std::cos(phi), theta * std::sin(phi);
    }
    expect_equal(arm, u, random.vector(6, 2.0), rule, 3e-14);
  }
}

TEST(DistributedMass, PointMassesAlongTheArcConvergeToIt) {
  RandomArm random(3);
  const ArmParameters arm = random.arm(2, MassModel::distributed);
  const auto state = random.state(2, 3.0);
  DynamicsWorkspace workspace(arm);
  Eigen::MatrixXd B(4, 4), C(4, 4);
  Eigen::VectorXd G(4);
  dynamics_matrices(arm, workspace, state.u, state.v, B, C, G);
  double previous = 0.0;
  for (const int pieces : {10, 20, 40}) {
    Quadrature midpoints;
    for (int k = 0; k < pieces; ++k) {
      midpoints.node.push_back((k + 0.5) / pieces);
      midpoints.weight.push_back(1.0 / pieces);
    }
    const double error = (sum_of_points(arm, state.u, state.v, midpoints).B - B).norm() / B.norm();
    if (previous > 0.0) {
      EXPECT_NEAR(previous / error, 4.0, 0.2);  // second order
    }
    previous = error;
  }
}

}  // namespace
}  // namespace softarm
