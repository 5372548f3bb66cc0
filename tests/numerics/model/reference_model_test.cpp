// The reference model must earn its name: golden numbers to the last place of a double, quadrature
// that more nodes do not change, derivatives against differences in long double.
#include "dev/reference_model/reference_model.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "unit/model/extensible_golden.hpp"
#include "unit/model/random_arm.hpp"

namespace softarm {
namespace {

using reference::Dynamics;
using reference::Matrix;
using reference::Real;
using reference::Vector;
using testing_support::RandomArm;
using testing_support::State;

constexpr Real kDoubleRounding = 1.2e-16L;  ///< of the golden numbers themselves

Real largest_of(const Matrix& m) { return m.cwiseAbs().maxCoeff(); }

/// The golden file's u or polar, both mass models.
void expect_golden(const golden::Case& c, const golden::Terms& want, MassModel mass) {
  ArmParameters arm = c.arm;
  arm.mass = mass;
  const Vector q = c.q.cast<Real>(), qd = c.qd.cast<Real>();
  const Vector u = c.polar ? reference::polar_to_u(q) : q;
  const Vector v = c.polar ? reference::polar_velocity_to_u(q, qd) : qd;
  Dynamics got = reference::dynamics(arm, u, v);
  if (c.polar) got = reference::to_polar(got, q, qd);
  // The golden numbers take the base's rotation literally, orthogonal or not; those of segments that
  // stretch the nearest rotation to it.
  const bool nearest = arm.extensible;
  const reference::Matrix3 R0 = arm.base_rotation.cast<Real>();
  const Real loss =
      1e-17L + (R0.transpose() * R0 - reference::Matrix3::Identity()).cwiseAbs().sum();
  const Matrix B = want.at("B").cast<Real>(), C = want.at("C").cast<Real>();
  for (Eigen::Index i = 0; i < u.size(); ++i) {
    for (Eigen::Index j = 0; j < u.size(); ++j) {
      // A double's rounding of the number itself, and 1e-17 of what cancels in it.
      EXPECT_LE(std::abs(got.B(i, j) - B(i, j)),
                kDoubleRounding * std::abs(B(i, j)) + loss * got.s(i) * got.s(j))
          << c.id;
      EXPECT_LE(std::abs(got.C(i, j) - C(i, j)),
                kDoubleRounding * std::abs(C(i, j)) + loss * got.s(i) * got.r(j))
          << c.id << " C(" << i << ", " << j << ")";
    }
  }
  if (want.contains("kinetic_energy")) {
    const Real energy = want.at("kinetic_energy")(0);
    EXPECT_LE(std::abs(got.kinetic_energy - energy), (kDoubleRounding + loss) * energy + 1e-300L)
        << c.id;
  }
  if (want.contains("G")) {
    const Vector G = want.at("G").cast<Real>();
    for (Eigen::Index i = 0; i < u.size(); ++i) {
      EXPECT_LE(std::abs(got.G(i) - G(i)),
                kDoubleRounding * std::abs(G(i)) + (nearest ? loss : 1e-17L) * got.s(i) * got.w)
          << c.id;
    }
    if (!want.contains("gravity_potential")) return;
    EXPECT_LE(std::abs(got.gravity_potential - Real(want.at("gravity_potential")(0))),
              2 * kDoubleRounding * got.potential_scale)
        << c.id;
  }
}

ArmParameters thick(ArmParameters arm, const std::vector<double>& radius_m) {
  for (std::size_t m = 0; m < radius_m.size(); ++m) arm.segments[m].radius_m = radius_m[m];
  return arm;
}

TEST(ReferenceModel, GivesTheGoldenNumbersToTheLastPlace) {
  int distributed = 0;
  for (const golden::Case& c : golden::cases()) {
    expect_golden(c, c.expected, MassModel::point);
    if (c.distributed.contains("B")) {
      expect_golden(c, c.distributed, MassModel::distributed);
      ++distributed;
    }
  }
  EXPECT_GT(distributed, 10);
  for (const golden::Case& c : golden::extensible_cases()) {
    expect_golden(c, c.expected, MassModel::point);
    expect_golden(c, c.distributed, MassModel::distributed);
  }
}

void expect_golden_kinematics(const std::vector<golden::Case>& cases, Real rotation_error) {
  for (const golden::Case& c : cases) {
    const Vector q = c.q.cast<Real>(), qd = c.qd.cast<Real>();
    const Vector u = c.polar ? reference::polar_to_u(q) : q;
    const Vector v = c.polar ? reference::polar_velocity_to_u(q, qd) : qd;
    const auto got = reference::kinematics(c.arm, u, v);
    const Matrix centres = c.expected.at("com_world").cast<Real>().transpose();
    EXPECT_LE(largest_of(got.centres - centres),
              rotation_error * std::max(Real(1), largest_of(centres)))
        << c.id;
    const Matrix T = c.expected.at("T_world").cast<Real>().rightCols<4>();
    EXPECT_LE(largest_of(got.rotations.back() - T.topLeftCorner<3, 3>()), rotation_error) << c.id;
    EXPECT_LE(largest_of(got.positions.back() - T.topRightCorner<3, 1>()),
              rotation_error * std::max(Real(1), largest_of(T)))
        << c.id;
    if (c.polar) continue;
    for (const auto& [key, J] :
         {std::pair{"J_tip", got.jacobian}, std::pair{"Jdot_tip", got.jacobian_rate},
          std::pair{"Jw_tip", got.angular_jacobian}}) {
      const Matrix want = c.expected.at(key).cast<Real>();
      EXPECT_LE(largest_of(J - want), rotation_error * std::max(Real(0.1), largest_of(want)))
          << c.id << key;
    }
  }
}

TEST(ReferenceModel, KinematicsAreGoldenToTheLastPlace) {
  expect_golden_kinematics(golden::cases(), 2e-16L);
  // The nearest rotation to the base's nine doubles differs from them by up to 3e-16.
  expect_golden_kinematics(golden::extensible_cases(), 5e-16L);
}

class ReferenceModelOfArms : public ::testing::TestWithParam<bool> {};

TEST_P(ReferenceModelOfArms, MoreNodesChangeNothing) {
  RandomArm random(1);
  for (const double theta : {0.0, 0.5, 1.0, 2.0, 3.5, 5.0, 7.0, 7.9}) {
    const ArmParameters arm = random.arm(2, {MassModel::distributed, GetParam()});
    State s = random.state(arm, 1.0);
    s.u.head<2>() << theta * 0.6, theta * 0.8;
    s.u.segment<2>(arm.segment_dof()) << -theta, 0.0;
    const Vector u = s.u.cast<Real>(), v = s.v.cast<Real>();
    const std::vector<double> radius{0.02, 0.05};
    const Dynamics a = reference::dynamics(thick(arm, radius), u, v),
                   b = reference::dynamics(thick(arm, radius), u, v, 9);
    const Matrix inertia = a.s * a.s.transpose(), coriolis = a.s * a.r.transpose();
    EXPECT_LE(largest_of((a.B - b.B).cwiseQuotient(inertia)), 1e-17L) << theta;
    EXPECT_LE(largest_of((a.C - b.C).cwiseQuotient(coriolis)), 1e-17L) << theta;
  }
}

/// Fourth-order central difference of B along e.
Matrix slope(const ArmParameters& arm, const Vector& u, const Vector& e,
             const std::vector<double>& radius) {
  const Real h = 1e-4L;
  const auto B = [&](Real step) {
    return reference::dynamics(thick(arm, radius), u + step * e, e).B;
  };
  return (8 * (B(h) - B(-h)) - (B(2 * h) - B(-2 * h))) / (12 * h);
}

TEST_P(ReferenceModelOfArms, CoriolisMatrixIsChristoffelOfTheInertia) {
  RandomArm random(2);
  for (const MassModel mass : {MassModel::point, MassModel::distributed}) {
    const ArmParameters arm = random.arm(2, {mass, GetParam()});
    const int dof = arm.dof();
    const State s = random.state(arm, 5.0);
    const Vector u = s.u.cast<Real>(), v = s.v.cast<Real>();
    for (const std::vector<double>& radius :
         {std::vector<double>{}, std::vector<double>{0.03, 0.06}}) {
      std::vector<Matrix> dB;
      for (int k = 0; k < dof; ++k) dB.push_back(slope(arm, u, Vector::Unit(dof, k), radius));
      const Dynamics got = reference::dynamics(thick(arm, radius), u, v);
      for (int i = 0; i < dof; ++i) {
        for (int j = 0; j < dof; ++j) {
          Real want = 0;
          for (int k = 0; k < dof; ++k) {
            want += (dB[static_cast<std::size_t>(k)](i, j) + dB[static_cast<std::size_t>(j)](i, k) -
                     dB[static_cast<std::size_t>(i)](j, k)) *
                    v(k) / 2;
          }
          EXPECT_LE(std::abs(got.C(i, j) - want), 2e-14L * got.s.norm() * got.r.norm());
        }
      }
    }
  }
}

TEST(ReferenceModel, RingsOfPointsAreThinDiscs) {
  // Spin inertia mu r^2 / 4 (I + e e') a unit of arc about every point, e the tangent, integrated
  // from the angular velocity of the cross-section at arc fraction x.
  RandomArm random(3);
  const ArmParameters arm = random.arm(2, MassModel::distributed);
  const State s = random.state(2, 4.0);
  const Vector u = s.u.cast<Real>(), v = s.v.cast<Real>();
  const std::vector<double> radius{0.03, 0.06};
  Matrix want = reference::dynamics(arm, u, v).B;
  const auto& rule = reference::gauss_legendre(40);
  for (std::size_t m = 0; m < 2; ++m) {
    for (std::size_t k = 0; k < rule.node.size(); ++k) {
      const int dof = static_cast<int>(2 * m + 2);
      ArmParameters cut = arm;
      cut.base_rotation.setIdentity();
      cut.segments.resize(m + 1);
      Vector cut_u = u.head(dof);
      cut_u.tail<2>() *= rule.node[k];
      const auto motion = reference::kinematics(cut, cut_u, Vector::Zero(dof));
      reference::Matrix3X J = motion.angular_jacobian;
      J.rightCols<2>() *= rule.node[k];
      const reference::Vector3 e = motion.rotations.back().col(2);
      const reference::Matrix3 disc = reference::Matrix3::Identity() + e * e.transpose();
      const Real mass = rule.weight[k] * Real(arm.segments[m].mass_kg);
      want.topLeftCorner(dof, dof) +=
          mass * Real(radius[m]) * Real(radius[m]) / 4 * J.transpose() * disc * J;
    }
  }
  const Matrix got = reference::dynamics(thick(arm, radius), u, v).B;
  EXPECT_LE(largest_of(got - want), 1e-17L * largest_of(want));
}

TEST_P(ReferenceModelOfArms, JacobianIsTheSlopeOfTheTip) {
  RandomArm random(4);
  const ArmParameters arm = random.arm(4, {MassModel::point, GetParam()}, GetParam() ? 3.0 : 1e3);
  const State s = random.state(arm, 6.0);
  const Vector u = s.u.cast<Real>(), v = s.v.cast<Real>();
  const auto got = reference::kinematics(arm, u, v);
  const Real h = 1e-4L;
  const auto at = [&](const Vector& where) { return reference::kinematics(arm, where, v); };
  for (int k = 0; k < arm.dof(); ++k) {
    const Vector e = h * Vector::Unit(arm.dof(), k);
    const reference::Vector3 difference =
        (8 * (at(u + e).positions.back() - at(u - e).positions.back()) -
         (at(u + 2 * e).positions.back() - at(u - 2 * e).positions.back())) /
        (12 * h);
    EXPECT_LE((got.jacobian.col(k) - difference).norm(), 1e-14L * got.jacobian.norm());
  }
  const Vector e = h * v;
  const Matrix rate = (8 * (at(u + e).jacobian - at(u - e).jacobian) -
                       (at(u + 2 * e).jacobian - at(u - 2 * e).jacobian)) /
                      (12 * h);
  EXPECT_LE(largest_of(got.jacobian_rate - rate), 1e-12L * largest_of(rate));
}

INSTANTIATE_TEST_SUITE_P(Length, ReferenceModelOfArms, ::testing::Values(false, true),
                         [](const auto& extensible) {
                           return extensible.param ? "extensible" : "constant";
                         });

}  // namespace
}  // namespace softarm
