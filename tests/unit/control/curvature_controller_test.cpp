// The controller (17): its closed loop (18), the golden numbers, its terms one by one, its bounds.
#include "softarm/control/curvature_controller.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>

#include "softarm/model/polar.hpp"
#include "unit/control/arms.hpp"
#include "unit/model/golden.hpp"

namespace softarm {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using std::numbers::pi;

struct Matrices {
  MatrixXd B, C;
  VectorXd G, k, beta;
};

Matrices matrices(const ArmParameters& arm, const VectorXd& u, const VectorXd& velocity) {
  const int dof = arm.dof();
  Matrices m{MatrixXd(dof, dof), MatrixXd(dof, dof), VectorXd(dof), VectorXd(dof), VectorXd(dof)};
  DynamicsWorkspace workspace(arm);
  dynamics_matrices(arm, workspace, u, velocity, m.B, m.C, m.G);
  const int width = arm.segment_dof();
  for (int i = 0; i < dof; ++i) {
    const SegmentParameters& segment = arm.segments[static_cast<std::size_t>(i / width)];
    const bool axial = i % width == 2;
    m.k[i] = axial ? segment.axial_stiffness_n_per_m : segment.stiffness_nm_per_rad;
    m.beta[i] = axial ? segment.axial_damping_ns_per_m : segment.damping_nms_per_rad;
  }
  return m;
}

VectorXd map(const std::vector<double>& v) {
  return Eigen::Map<const VectorXd>(v.data(), static_cast<Eigen::Index>(v.size()));
}

TEST(CurvatureController, LeavesTheClosedLoop18) {
  test::Random random(1);
  for (int trial = 0; trial < 200; ++trial) {
    const int n = 1 + trial % 5;
    ArmParameters arm = test::random_arm(n, random);
    arm.mass = n <= 2 && trial % 2 == 0 ? MassModel::point : MassModel::distributed;
    arm.actuation = trial % 3 == 0 ? ActuationModel::couple : ActuationModel::chamber;
    ControllerSettings settings = test::gains(n, 0.0, 0.0);
    for (double& g : settings.kp) g = random.uniform(0.0, 2.0);
    for (double& g : settings.kd) g = random.uniform(0.0, 0.1);
    CurvatureController controller(arm, settings);
    const VectorXd u = random.vector(2 * n, 1.2), ud = random.vector(2 * n, 3.0);
    const VectorXd ur = random.vector(2 * n, 1.2), urd = random.vector(2 * n, 3.0),
                   urdd = random.vector(2 * n, 10.0);
    ControlOutput out;
    controller.compute(u, ud, test::at(ur, urd, urdd), out);

    VectorXd force(2 * n), udd(2 * n);
    apply_actuation(arm, u, out.tau_actuation_nm, force);
    DynamicsWorkspace workspace(arm);
    ASSERT_TRUE(forward_dynamics(arm, workspace, u, ud, force, udd));
    const Matrices m = matrices(arm, u, ud);
    const VectorXd e = ur - u, ed = urd - ud, edd = urdd - udd;
    const VectorXd left = m.B * edd + m.C * ed,
                   right = -(m.k + map(settings.kp)).cwiseProduct(e) -
                           (m.beta + map(settings.kd)).cwiseProduct(ed);
    EXPECT_LT((left - right).norm(), 1e-11 * (1.0 + right.norm())) << "n " << n;
    EXPECT_FALSE(out.bounded);
  }
}

// The same in (u, e): B x'' + C x' = -(K + K_P) x - (D + K_D) x' with x = q_ref - q, three rows.
TEST(CurvatureController, LeavesTheClosedLoopOfSegmentsThatStretch) {
  test::Random random(3);
  for (int trial = 0; trial < 100; ++trial) {
    const int n = 1 + trial % 4;
    ArmParameters arm = test::random_arm(n, random);
    arm.extensible = true;
    arm.mass = n <= 2 && trial % 2 == 0 ? MassModel::point : MassModel::distributed;
    for (SegmentParameters& segment : arm.segments) {
      segment.axial_stiffness_n_per_m = random.uniform(1e3, 1e4);
      segment.axial_damping_ns_per_m = random.uniform(20.0, 200.0);
    }
    ControllerSettings settings = test::gains(n, 0.0, 0.0);
    for (double& g : settings.kp) g = random.uniform(0.0, 2.0);
    for (double& g : settings.kd) g = random.uniform(0.0, 0.1);
    VectorXd kp(3 * n), kd(3 * n);
    for (int i = 0; i < n; ++i) {
      settings.kp_axial.push_back(random.uniform(0.0, 5e3));
      settings.kd_axial.push_back(random.uniform(0.0, 50.0));
      const auto k = static_cast<std::size_t>(i);
      kp.segment<3>(3 * i) << settings.kp[2 * k], settings.kp[2 * k + 1], settings.kp_axial[k];
      kd.segment<3>(3 * i) << settings.kd[2 * k], settings.kd[2 * k + 1], settings.kd_axial[k];
    }
    const auto state = [&](double bend, double stretch) {
      VectorXd v(3 * n);
      for (int i = 0; i < n; ++i)
        v.segment<3>(3 * i) << random.vector(2, bend), random.uniform(-stretch, stretch);
      return v;
    };
    const VectorXd q = state(1.5, 0.02), qd = state(3.0, 0.1), qr = state(1.5, 0.02),
                   qrd = state(3.0, 0.1), qrdd = state(10.0, 1.0);
    CurvatureController controller(arm, settings);
    ControlOutput out;
    controller.compute(q, qd, test::at(qr, qrd, qrdd), out);
    VectorXd force(3 * n), qdd(3 * n);
    apply_actuation(arm, q, out.tau_actuation_nm, force);
    EXPECT_EQ(force, VectorXd(out.tau_u_nm));
    DynamicsWorkspace workspace(arm);
    ASSERT_TRUE(forward_dynamics(arm, workspace, q, qd, force, qdd));
    const Matrices m = matrices(arm, q, qd);
    const VectorXd right = -(m.k + kp).cwiseProduct(qr - q) - (m.beta + kd).cwiseProduct(qrd - qd);
    const VectorXd left = m.B * (qrdd - qdd) + m.C * (qrd - qd);
    for (int i = 0; i < 3 * n; ++i)
      EXPECT_NEAR(left[i], right[i], 1e-10 * (std::abs(right[i]) + (i % 3 == 2 ? 100.0 : 1.0)));
  }
}

TEST(CurvatureController, LeavesTheClosedLoop18InPolarCoordinates) {
  test::Random random(2);
  for (int trial = 0; trial < 200; ++trial) {
    const int n = 1 + trial % 4;
    const ArmParameters arm = test::random_arm(n, random);
    ControllerSettings settings = test::gains(n, 0.0, 0.0);
    settings.coordinates = ControlCoordinates::polar;
    for (double& g : settings.kp) g = random.uniform(0.0, 2.0);
    for (double& g : settings.kd) g = random.uniform(0.0, 0.1);
    CurvatureController controller(arm, settings);
    VectorXd q(2 * n), qr(2 * n);
    for (int i = 0; i < n; ++i) {
      q.segment<2>(2 * i) << random.uniform(-3.0, 3.0), random.uniform(0.1, 1.5);
      qr.segment<2>(2 * i) << q[2 * i] + random.uniform(-3.0, 3.0), random.uniform(0.0, 1.5);
    }
    const VectorXd qd = random.vector(2 * n, 3.0), qrd = random.vector(2 * n, 3.0),
                   qrdd = random.vector(2 * n, 10.0);
    ReferenceWindow window;
    window.now.u.resize(2 * n);
    window.now.velocity.resize(2 * n);
    window.now.acceleration.resize(2 * n);
    window.now.has_polar = true;
    window.now.polar = qr;
    window.now.polar_velocity = qrd;
    window.now.polar_acceleration = qrdd;
    VectorXd u(2 * n), ud(2 * n), udd(2 * n), qdd(2 * n);
    polar_to_u(q, u);
    polar_velocity_to_u(q, qd, ud);
    ControlOutput out;
    controller.compute(u, ud, window, out);
    DynamicsWorkspace workspace(arm);
    ASSERT_TRUE(forward_dynamics(arm, workspace, u, ud, out.tau_u_nm, udd));
    u_acceleration_to_polar(q, qd, udd, qdd);

    Matrices m = matrices(arm, u, ud);
    dynamics_to_polar(q, qd, m.B, m.C, m.G);
    const VectorXd e = qr - q, ed = qrd - qd, edd = qrdd - qdd;
    VectorXd right(2 * n);
    for (int i = 0; i < n; ++i) {
      const double theta = q[2 * i + 1];
      const double damping_phi = m.beta[2 * i] * theta * theta + settings.kd[2 * i];
      right[2 * i] = -settings.kp[2 * i] * e[2 * i] - damping_phi * ed[2 * i];
      right[2 * i + 1] = -(m.k[2 * i] + settings.kp[2 * i + 1]) * e[2 * i + 1] -
                         (m.beta[2 * i] + settings.kd[2 * i + 1]) * ed[2 * i + 1];
    }
    EXPECT_LT((m.B * edd + m.C * ed - right).norm(), 1e-10 * (1.0 + right.norm()));
  }
}

TEST(CurvatureController, GoldenTorques) {
  int compared = 0;
  for (const golden::Case& c : golden::cases()) {
    if (c.control.empty() || !c.control.contains("tau")) continue;
    const int dof = c.arm.dof();
    const VectorXd qr = c.control.at("qbar"), qrd = c.control.at("qbar_dot"),
                   qrdd = c.control.at("qbar_ddot");
    const VectorXd kp = c.control.at("KP"), kd = c.control.at("KD");
    ControllerSettings settings;
    settings.kp.assign(kp.begin(), kp.end());
    settings.kd.assign(kd.begin(), kd.end());
    settings.polar_theta_min_rad = 1e-3;
    VectorXd u = c.q, ud = c.qd;
    ReferenceWindow window = test::at(qr, qrd, qrdd);
    if (c.polar) {
      // The golden file neither wraps phi nor keeps theta positive; we measure phi in (-pi, pi].
      bool comparable = true;
      for (int i = 0; i < dof; i += 2) {
        comparable &= c.q[i + 1] > 1e-3 && std::abs(qr[i] - c.q[i]) < pi;
      }
      if (!comparable) continue;
      settings.coordinates = ControlCoordinates::polar;
      polar_to_u(c.q, u);
      polar_velocity_to_u(c.q, c.qd, ud);
      window.now.has_polar = true;
      window.now.polar = qr;
      window.now.polar_velocity = qrd;
      window.now.polar_acceleration = qrdd;
    }
    CurvatureController controller(c.arm, settings);
    ControlOutput out;
    controller.compute(u, ud, window, out);
    VectorXd tau = out.tau_u_nm;
    if (c.polar) force_to_polar(c.q, tau, tau);
    const VectorXd want = c.control.at("tau");
    // Relative to the sum of magnitudes; in polar a phi row is theta times a force in u.
    const double scale = want.cwiseAbs().maxCoeff() + out.tau_u_nm.cwiseAbs().maxCoeff() +
                         kp.cwiseProduct(qr - c.q).cwiseAbs().maxCoeff();
    EXPECT_LT((tau - want).cwiseAbs().maxCoeff(), 1e-12 * scale) << c.id;
    if (c.control.contains("tau_A_chamber")) {
      const VectorXd actuation = c.control.at("tau_A_chamber");
      EXPECT_LT((out.tau_actuation_nm - actuation).cwiseAbs().maxCoeff(), 1e-10 * scale) << c.id;
    }
    ++compared;
  }
  EXPECT_GT(compared, 20);
}

TEST(CurvatureController, EveryTermCanBeLeftOut) {
  test::Random random(3);
  const int n = 3;
  const ArmParameters arm = test::random_arm(n, random);
  const VectorXd u = random.vector(6, 1.0), ud = random.vector(6, 2.0), ur = random.vector(6, 1.0),
                 urd = random.vector(6, 2.0), urdd = random.vector(6, 5.0);
  const Matrices m = matrices(arm, u, ud);
  const ControllerSettings all = test::gains(n, 1.0, 0.01);
  const VectorXd expected[] = {m.B * urdd, m.C * urd, m.G, m.k.cwiseProduct(ur),
                               m.beta.cwiseProduct(urd)};
  ControlOutput full, out;
  CurvatureController(arm, all).compute(u, ud, test::at(ur, urd, urdd), full);
  for (int term = 0; term < 5; ++term) {
    ControllerSettings settings = all;
    bool* flags[] = {&settings.terms.inertia, &settings.terms.coriolis, &settings.terms.gravity,
                     &settings.terms.stiffness, &settings.terms.damping};
    *flags[term] = false;
    CurvatureController(arm, settings).compute(u, ud, test::at(ur, urd, urdd), out);
    EXPECT_LT((full.tau_u_nm - out.tau_u_nm - expected[term]).norm(), 1e-14) << "term " << term;
  }
}

TEST(CurvatureController, PolarAndUAgreeOnTheReference) {
  // Without an error both forms ask for the same torque.
  test::Random random(4);
  const int n = 3;
  const ArmParameters arm = test::random_arm(n, random);
  ControllerSettings settings = test::gains(n, 1.0, 0.01);
  for (int trial = 0; trial < 50; ++trial) {
    VectorXd u = random.vector(6, 1.0);
    for (int i = 0; i < 6; i += 2) u[i] += u[i] > 0.0 ? 0.1 : -0.1;
    const ReferenceWindow window = test::at(u, random.vector(6, 2.0), random.vector(6, 5.0));
    ControlOutput in_u, in_polar;
    settings.coordinates = ControlCoordinates::u;
    CurvatureController(arm, settings).compute(u, window.now.velocity, window, in_u);
    settings.coordinates = ControlCoordinates::polar;
    CurvatureController(arm, settings).compute(u, window.now.velocity, window, in_polar);
    EXPECT_LT((in_u.tau_u_nm - in_polar.tau_u_nm).norm(), 1e-13);
  }
}

TEST(CurvatureController, PolarTakesTheShortWayRound) {
  const ArmParameters arm = test::paper_arm(1);
  ControllerSettings settings = test::gains(1, 0.0, 0.0);
  settings.kp[0] = 1.0;
  settings.coordinates = ControlCoordinates::polar;
  settings.terms = {false, false, false, false, false};
  CurvatureController controller(arm, settings);
  const double theta = 0.4;
  ControlOutput out;
  for (double measured : {pi - 0.1, -pi + 0.1}) {
    for (double turns : {-2.0 * pi, 0.0, 2.0 * pi}) {
      const double wanted = (measured > 0.0 ? -pi + 0.2 : pi - 0.2) + turns;
      VectorXd u(2), zero = VectorXd::Zero(2);
      u << theta * std::cos(measured), theta * std::sin(measured);
      ReferenceWindow window = test::at(u, zero, zero);
      window.now.has_polar = true;
      window.now.polar = Eigen::Vector2d(wanted, theta);
      window.now.polar_velocity = window.now.polar_acceleration = zero;
      controller.compute(u, zero, window, out);
      const double error = measured > 0.0 ? 0.3 : -0.3;  // across +-pi
      const Eigen::Vector2d tangent(-std::sin(measured), std::cos(measured));
      EXPECT_LT((out.tau_u_nm - error / theta * tangent).norm(), 1e-13);
    }
  }
}

TEST(CurvatureController, BoundedWherePolarAndCoupleAreSingular) {
  ArmParameters arm = test::paper_arm(1);
  ControllerSettings settings = test::gains(1, 1.2, 0.002);
  settings.coordinates = ControlCoordinates::polar;
  CurvatureController polar(arm, settings);
  test::Random random(5);
  ControlOutput out;
  for (double theta : {0.0, 1e-300, 1e-12, 1e-4, 0.049}) {
    const VectorXd u = theta * Eigen::Vector2d(0.6, 0.8);
    for (double reference : {0.0, 1e-300, 1e-6, 0.4}) {
      const VectorXd ur = reference * Eigen::Vector2d(-0.8, 0.6);
      polar.compute(u, random.vector(2, 1.0),
                    test::at(ur, random.vector(2, 1.0), random.vector(2, 3.0)), out);
      EXPECT_TRUE(out.tau_actuation_nm.allFinite());
      EXPECT_TRUE(out.bounded);
      // The force of phi's gain at theta_min with an error of pi, plus a margin for the rest.
      EXPECT_LT(out.tau_actuation_nm.norm(), 1.2 * pi / 0.05 + 10.0);
    }
  }
  arm.actuation = ActuationModel::couple;
  settings.coordinates = ControlCoordinates::u;
  CurvatureController couple(arm, settings);
  for (double theta = 3.0; theta < 3.3; theta += 0.001) {
    const VectorXd u = theta * Eigen::Vector2d(0.6, 0.8), zero = VectorXd::Zero(2);
    couple.compute(u, zero, test::at(0.9 * u, zero, zero), out);
    EXPECT_TRUE(out.tau_actuation_nm.allFinite());
    EXPECT_LT(out.tau_actuation_nm.norm(), 200.0);
    if (std::abs(theta - pi) < 0.1) {
      EXPECT_TRUE(out.bounded) << theta;
    }
    if (std::abs(theta - pi) > 0.2) {
      EXPECT_FALSE(out.bounded) << theta;
    }
  }
}

TEST(CurvatureController, RefusesGainsThatDoNotFit) {
  const ArmParameters arm = test::paper_arm(2);
  EXPECT_THROW(CurvatureController(arm, test::gains(1, 1.0, 0.0)), std::invalid_argument);
  ControllerSettings settings = test::gains(2, 1.0, 0.0);
  settings.kp[1] = -1.0;
  EXPECT_THROW(CurvatureController(arm, settings), std::invalid_argument);
  settings.kp[1] = NAN;
  EXPECT_THROW(CurvatureController(arm, settings), std::invalid_argument);
  settings = test::gains(2, 1.0, 0.0);
  settings.valve_lag_s = -0.01;
  EXPECT_THROW(CurvatureController(arm, settings), std::invalid_argument);
}

}  // namespace
}  // namespace softarm
