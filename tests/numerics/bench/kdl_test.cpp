// KDL's chain is our arm: without that its time would have no meaning. Its m(q) is independent,
// so this also holds Table I against the direct route by code that is not ours.
//
// Tolerance 1e-12 of the size that entries can have (reference::Dynamics): KDL sums the motion of
// ten joints a segment, whose lever arms reach back to the base, so its rounding grows with n;
// measured at n = 10 it is below 1e-13.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "dev/bench/accuracy.hpp"
#include "dev/bench/kdl_chain.hpp"
#include "softarm/model/dynamics.hpp"
#include "softarm/model/polar.hpp"

namespace softarm {
namespace {

constexpr double kTolerance = 1e-12;

class Kdl : public testing::TestWithParam<int> {
 protected:
  void SetUp() override {
    if (!KdlChain::available()) GTEST_SKIP() << "built without Orocos KDL (liborocos-kdl-dev)";
    std::mt19937 engine(7);
    const auto uniform = [&engine](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(engine);
    };
    for (int i = 0; i < GetParam(); ++i) {
      arm_.segments.push_back({.length_m = uniform(0.05, 0.2), .mass_kg = uniform(0.05, 0.3)});
    }
    arm_.mass = MassModel::point;
    arm_.base_rotation =
        Eigen::Quaterniond(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), uniform(-1, 1))
            .normalized()
            .toRotationMatrix();
    arm_.gravity_mps2 = {1.0, -2.0, -9.0};
    const int dof = arm_.dof();
    q_ = v_ = a_ = Eigen::VectorXd(dof);
    for (int i = 0; i < dof; i += 2) q_.segment<2>(i) << uniform(-3.1, 3.1), uniform(0.05, 3.0);
    for (int i = 0; i < dof; ++i) {
      v_(i) = uniform(-2, 2);
      a_(i) = uniform(-5, 5);
    }
    B_ = C_ = Eigen::MatrixXd(dof, dof);
    G_ = u_ = u_velocity_ = Eigen::VectorXd(dof);
    polar_to_u(q_, u_);
    polar_velocity_to_u(q_, v_, u_velocity_);
    DynamicsWorkspace workspace(arm_);
    dynamics_matrices(arm_, workspace, u_, u_velocity_, B_, C_, G_);
    dynamics_to_polar(q_, v_, B_, C_, G_);
    const reference::Dynamics sizes = reference::to_polar(
        reference::dynamics(arm_, u_.cast<long double>(), u_velocity_.cast<long double>()),
        q_.cast<long double>(), v_.cast<long double>());
    s_ = static_cast<double>(sizes.s.maxCoeff());
    r_ = static_cast<double>(sizes.r.maxCoeff());
    w_ = static_cast<double>(sizes.w);
  }

  static double largest(const Eigen::MatrixXd& m) { return m.cwiseAbs().maxCoeff(); }

  ArmParameters arm_;
  Eigen::VectorXd q_, v_, a_, u_, u_velocity_, G_;
  Eigen::MatrixXd B_, C_;
  double s_ = 0.0, r_ = 0.0, w_ = 0.0;  ///< sizes of reference::Dynamics
};

TEST_P(Kdl, MatricesAfterProjectionAreOurs) {
  const int dof = arm_.dof();
  Eigen::MatrixXd B(dof, dof);
  Eigen::VectorXd C_velocity(dof), G(dof);
  KdlChain(arm_).matrices(q_, v_, B, C_velocity, G);
  EXPECT_LE(largest(B - B_), kTolerance * s_ * s_);
  EXPECT_LE(largest(C_velocity - C_ * v_), kTolerance * s_ * r_ * v_.cwiseAbs().sum());
  EXPECT_LE(largest(G - G_), kTolerance * s_ * w_);
}

TEST_P(Kdl, NewtonEulerIsTheSumOfOurTerms) {
  Eigen::VectorXd got(arm_.dof());
  KdlChain(arm_).inverse_dynamics(q_, v_, a_, got);
  const double size = s_ * (s_ * a_.cwiseAbs().sum() + r_ * v_.cwiseAbs().sum() + w_);
  EXPECT_LE(largest(got - (B_ * a_ + C_ * v_ + G_)), kTolerance * size);
}

INSTANTIATE_TEST_SUITE_P(Segments, Kdl, testing::Values(1, 2, 3, 10));

}  // namespace
}  // namespace softarm
