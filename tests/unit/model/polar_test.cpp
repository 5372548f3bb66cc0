// The chain rule between polar and u, and the input matrices.
#include "softarm/model/polar.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "random_arm.hpp"
#include "softarm/model/actuation_matrix.hpp"
#include "softarm/model/dynamics.hpp"
#include "softarm/model/segment.hpp"

namespace softarm {
namespace {

using testing_support::RandomArm;

TEST(Polar, VelocityAndAccelerationRoundTrip) {
  RandomArm random(1);
  const Eigen::VectorXd q = random.vector(6, 3.0), v = random.vector(6, 2.0),
                        a = random.vector(6, 4.0);
  Eigen::VectorXd u(6), uv(6), ua(6), back(6);
  polar_to_u(q, u);
  polar_velocity_to_u(q, v, uv);
  polar_acceleration_to_u(q, v, a, ua);
  u_velocity_to_polar(q, uv, back);
  EXPECT_TRUE(back.isApprox(v, 1e-13));
  u_acceleration_to_polar(q, v, ua, back);
  EXPECT_TRUE(back.isApprox(a, 1e-12));
  constexpr double kStep = 1e-5;
  Eigen::VectorXd above(6), below(6);
  polar_to_u(q + kStep * v + 0.5 * kStep * kStep * a, above);
  polar_to_u(q - kStep * v + 0.5 * kStep * kStep * a, below);
  EXPECT_LT((uv - (above - below) / (2 * kStep)).norm(), 1e-8);
  EXPECT_LT((ua - (above - 2 * u + below) / (kStep * kStep)).norm(), 1e-4);
}

TEST(Polar, AnglesOfU) {
  Eigen::VectorXd u(8), q(8);
  u << 0.3, 0.4, 0.0, 0.0, -1.0, -0.0, -1e-200, 1e-200;
  u_to_polar(u, q);
  EXPECT_DOUBLE_EQ(q(1), 0.5);
  EXPECT_EQ(q(2), 0.0);
  EXPECT_EQ(q(3), 0.0);
  EXPECT_DOUBLE_EQ(std::abs(q(4)), std::numbers::pi);
  EXPECT_DOUBLE_EQ(q(6), 0.75 * std::numbers::pi);
  EXPECT_NEAR(q(7), std::sqrt(2.0) * 1e-200, 1e-215);
}

TEST(Polar, DynamicsAreChristoffelInPolarToo) {
  RandomArm random(2);
  for (const auto mass : {MassModel::point, MassModel::distributed}) {
    const ArmParameters arm = random.arm(2, mass);
    DynamicsWorkspace workspace(arm);
    Eigen::VectorXd q(4);
    q << 0.7, 1.1, -2.0, -0.6;  // theta of either sign
    const Eigen::VectorXd v = random.vector(4, 2.0);
    const auto at = [&](const Eigen::VectorXd& where, Eigen::MatrixXd& C) {
      Eigen::VectorXd u(4), uv(4), G(4);
      Eigen::MatrixXd B(4, 4);
      C.resize(4, 4);
      polar_to_u(where, u);
      polar_velocity_to_u(where, v, uv);
      dynamics_matrices(arm, workspace, u, uv, B, C, G);
      dynamics_to_polar(where, v, B, C, G);
      return B;
    };
    Eigen::MatrixXd C, ignored;
    const Eigen::MatrixXd B = at(q, C);
    std::vector<Eigen::MatrixXd> slope;
    constexpr double kStep = 1e-5;
    for (int k = 0; k < 4; ++k) {
      const Eigen::VectorXd e = kStep * Eigen::VectorXd::Unit(4, k);
      slope.push_back((at(q + e, ignored) - at(q - e, ignored)) / (2 * kStep));
    }
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j < 4; ++j) {
        double christoffel = 0.0;
        for (std::size_t k = 0; k < 4; ++k) {
          const auto at_ij = [&](std::size_t d, std::size_t r, std::size_t c) {
            return slope[d](static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c));
          };
          christoffel += 0.5 * (at_ij(k, i, j) + at_ij(j, i, k) - at_ij(i, j, k)) *
                         v(static_cast<Eigen::Index>(k));
        }
        EXPECT_NEAR(C(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)), christoffel,
                    1e-8 * B.norm() * v.norm());
      }
    }
  }
}

TEST(ActuationMatrix, CoupleIsThePowerOfMomentsAboutLocalAxes) {
  RandomArm random(3);
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector2d u = random.vector(2, 3.0), tau = random.vector(2, 1.0),
                          rate = random.vector(2, 1.0);
    const Eigen::Vector3d spin = segment_angular_jacobian(u) * rate;
    const Eigen::Matrix2d A = actuation_matrix(ActuationModel::couple, u);
    EXPECT_NEAR(rate.dot(A * tau), spin.head<2>().dot(tau), 1e-14);
    const double theta = u.norm();
    EXPECT_NEAR(A.determinant(), std::sin(theta) / theta, 1e-14);
  }
}

TEST(ActuationMatrix, ChamberIsThePowerOfFibres) {
  // A chamber at radius r and angle chi has length L - r theta cos(chi - phi) = L - r (u . (cos
  // chi, sin chi)). Its push p a shortens nothing but does work p a dl; the same push is a moment r
  // p a about the local axes.
  RandomArm random(4);
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector2d u = random.vector(2, 4.0), rate = random.vector(2, 1.0);
    const double chi = random.uniform(-4.0, 4.0), push = 2.0, radius = 0.02;
    const Eigen::Vector2d place(std::cos(chi), std::sin(chi));
    const double power = -push * radius * place.dot(rate);
    const Eigen::Vector3d moment = Eigen::Vector3d(radius * place.x(), radius * place.y(), 0)
                                       .cross(Eigen::Vector3d(0, 0, push));
    const Eigen::Matrix2d A = actuation_matrix(ActuationModel::chamber, u);
    EXPECT_NEAR(rate.dot(A * moment.head<2>()), power, 1e-15);
  }
}

TEST(ActuationMatrix, PolarIsTheChainRule) {
  RandomArm random(5);
  for (const auto model : {ActuationModel::couple, ActuationModel::chamber}) {
    for (const double theta : {-2.0, -1e-9, 1e-12, 0.4, 3.0, 7.0}) {
      const Eigen::Vector2d q(random.uniform(-7.0, 7.0), theta);
      Eigen::VectorXd u(2);
      polar_to_u(q, u);
      const Eigen::Matrix2d want =
          polar_jacobian(q).transpose() * actuation_matrix(model, Eigen::Vector2d(u));
      EXPECT_LT((polar_actuation_matrix(model, q) - want).cwiseAbs().maxCoeff(), 1e-14);
    }
  }
}

TEST(ActuationMatrix, SolvesAndStaysBounded) {
  RandomArm random(6);
  ArmParameters arm = random.arm(3, MassModel::point);
  for (const auto model : {ActuationModel::couple, ActuationModel::chamber}) {
    arm.actuation = model;
    const Eigen::VectorXd u = random.bending(3, 2.5), tau = random.vector(6, 1.0);
    Eigen::VectorXd force(6), back(6);
    apply_actuation(arm, u, tau, force);
    solve_actuation(arm, u, force, back);
    EXPECT_TRUE(back.isApprox(tau, 1e-12));
  }
  // Relative accuracy close to the dead angle: u = theta (3, 4) / 5 with theta = pi - 1e-6 in long
  // double.
  const Eigen::Vector2d near(0.6 * 3.1415916535897931, 0.8 * 3.1415916535897931);
  const long double theta = std::hypot(static_cast<long double>(near.x()), near.y());
  const Eigen::Matrix2d A = actuation_matrix(ActuationModel::couple, near);
  const Eigen::Vector2d torque =
      solve_actuation(ActuationModel::couple, near, Eigen::Vector2d(1.0, 0.0), 0.0);
  const double want = static_cast<double>(std::hypot(A(1, 1), A(1, 0)) * theta / std::sin(theta));
  EXPECT_NEAR(torque.norm() / want, 1.0, 1e-12);  // plain double: 1e-10
  const Eigen::Vector2d dead(std::numbers::pi, 0.0), force(1.0, -1.0);
  const Eigen::Vector2d bounded = solve_actuation(ActuationModel::couple, dead, force);
  EXPECT_LT(bounded.norm(), 2.0 / kMinActuationDeterminant);
  EXPECT_GT(solve_actuation(ActuationModel::couple, dead, force, 0.0).norm(), 1e10);
}

}  // namespace
}  // namespace softarm
