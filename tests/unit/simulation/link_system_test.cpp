// The links against mechanics by another route: points and directions in long double, differenced.
#include "simulation/link_system.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <functional>
#include <random>

#include "softarm/simulation/arm_plant.hpp"
#include "unit/simulation/paper_arm.hpp"

namespace softarm {
namespace {

using Real = long double;
using Vector3 = Eigen::Matrix<Real, 3, 1>;
using Matrix3 = Eigen::Matrix<Real, 3, 3>;
using VectorX = Eigen::Matrix<Real, Eigen::Dynamic, 1>;

PlantSettings links(int segments, int per_segment, MassModel mass = MassModel::distributed) {
  PlantSettings settings = paper_arm(mass, segments);
  settings.kind = kLinks(per_segment);
  settings.arm.base_rotation =
      Eigen::AngleAxisd(0.7, Eigen::Vector3d(1.0, 2.0, -0.5).normalized()).toRotationMatrix();
  set_torque_actuation(settings.actuation, segments, 1e3);
  settings.valves.supply_pressure_bar = 1e3;
  return settings;
}

LinkSystem link_system(const PlantSettings& settings) {
  return LinkSystem(settings, *settings.kind.get_if<LinkSettings>());
}

struct Chain {
  std::vector<Vector3> centre, direction;
  std::vector<Matrix3> rotation;
  Vector3 tip;
};

/// Where every link is, in the world, by the definition of the joints alone.
Chain chain(const PlantSettings& settings, const VectorX& x) {
  const int per_segment = settings.kind.get_if<LinkSettings>()->links_per_segment;
  Chain result;
  const Matrix3 base = settings.arm.base_rotation.cast<Real>();
  Matrix3 rotation = base;
  Vector3 start = Vector3::Zero();
  for (Eigen::Index j = 0; 2 * j < x.size(); ++j) {
    const auto i = static_cast<std::size_t>(j / per_segment);
    const Real length = Real(settings.arm.segments[i].length_m) / per_segment;
    rotation = rotation * Eigen::AngleAxis<Real>(x[2 * j], Vector3::UnitX()) *
               Eigen::AngleAxis<Real>(x[2 * j + 1], Vector3::UnitY());
    const Vector3 along = rotation.col(2);
    result.rotation.push_back(rotation);
    result.direction.push_back(along);
    result.centre.push_back(start + length / 2 * along);
    start += length * along;
  }
  result.tip = start;
  return result;
}

/// First and second derivative at 0 of a function of time, by differences of sixth order.
template <class Function>
auto derivative(const Function& f) {
  const Real h = 1e-3L;
  using Value = decltype(f(Real(0)));
  return Value((45 * (f(h) - f(-h)) - 9 * (f(2 * h) - f(-2 * h)) + (f(3 * h) - f(-3 * h))) /
               (60 * h));
}

template <class Function>
auto second_derivative(const Function& f) {
  const Real h = 1e-3L;
  using Value = decltype(f(Real(0)));
  return Value((-490 * f(Real(0)) + 270 * (f(h) + f(-h)) - 27 * (f(2 * h) + f(-2 * h)) +
                2 * (f(3 * h) + f(-3 * h))) /
               (180 * h * h));
}

/// Generalized inertia force minus weight: every grain of mass times its acceleration less g, on
/// every way it can go. A rod's grains are at centre + s direction.
VectorX inertia_less_weight(const PlantSettings& settings, const VectorX& x, const VectorX& v,
                            const VectorX& a) {
  const auto at = [&](Real t) { return chain(settings, x + t * v + t * t / 2 * a); };
  VectorX force = VectorX::Zero(x.size());
  const Vector3 gravity = settings.arm.gravity_mps2.cast<Real>();
  for (std::size_t j = 0; j < static_cast<std::size_t>(x.size() / 2); ++j) {
    const auto m =
        static_cast<std::size_t>(settings.kind.get_if<LinkSettings>()->links_per_segment);
    const SegmentParameters& segment = settings.arm.segments[j / m];
    const Real mass = Real(segment.mass_kg) / Real(m);
    const Real length = Real(segment.length_m) / Real(m);
    const Real spread =
        settings.arm.mass == MassModel::point ? Real(0) : mass * length * length / 12;
    const Vector3 centre = second_derivative([&](Real t) { return Vector3(at(t).centre[j]); });
    const Vector3 along = second_derivative([&](Real t) { return Vector3(at(t).direction[j]); });
    for (Eigen::Index k = 0; k < x.size(); ++k) {
      const auto moved = [&](Real t) {
        VectorX y = x;
        y[k] += t;
        return chain(settings, y);
      };
      const Vector3 by_centre = derivative([&](Real t) { return Vector3(moved(t).centre[j]); });
      const Vector3 by_along = derivative([&](Real t) { return Vector3(moved(t).direction[j]); });
      force[k] += mass * by_centre.dot(centre - gravity) + spread * by_along.dot(along);
    }
  }
  return force;
}

Eigen::VectorXd random_vector(Eigen::Index size, double scale, unsigned seed) {
  std::mt19937 engine(seed);
  std::uniform_real_distribution<double> uniform(-scale, scale);
  Eigen::VectorXd result(size);
  for (double& each : result) each = uniform(engine);
  return result;
}

class Mechanics : public ::testing::TestWithParam<MassModel> {};
INSTANTIATE_TEST_SUITE_P(Masses, Mechanics,
                         ::testing::Values(MassModel::point, MassModel::distributed));

TEST_P(Mechanics, ResidualIsNewtonsLawForEveryGrain) {
  const PlantSettings settings = links(2, 3, GetParam());
  LinkSystem system = link_system(settings);
  const Eigen::Index n = system.size();
  const auto x = random_vector(n, 0.8, 1), v = random_vector(n, 3.0, 2),
             a = random_vector(n, 20, 3);
  Eigen::VectorXd residual(n);
  system.residual(0.0, x, v, a, residual);
  const double k = 3 * 0.626, beta = 3 * 0.029;
  const VectorX expected =
      inertia_less_weight(settings, x.cast<Real>(), v.cast<Real>(), a.cast<Real>()) +
      (k * x + beta * v).cast<Real>();
  EXPECT_LT((residual - expected.cast<double>()).norm(), 1e-12 * residual.norm());
}

TEST_P(Mechanics, InertiaIsWhatTheResidualAsksForUnitAccelerations) {
  LinkSystem system = link_system(links(2, 4, GetParam()));
  const Eigen::Index n = system.size();
  const auto x = random_vector(n, 0.8, 4), v = random_vector(n, 3.0, 5);
  Eigen::MatrixXd B(n, n), by_v(n, n), by_x(n, n);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(n);
  system.linearize(0.0, x, v, zero, B, by_v, by_x);
  Eigen::VectorXd without(n), with(n);
  system.residual(0.0, x, v, zero, without);
  for (Eigen::Index j = 0; j < n; ++j) {
    system.residual(0.0, x, v, Eigen::VectorXd::Unit(n, j), with);
    EXPECT_LT((with - without - B.col(j)).norm(), 1e-13 * without.norm()) << j;
  }
  EXPECT_EQ(B, B.transpose());
}

TEST_P(Mechanics, AccelerationMakesTheResidualZero) {
  LinkSystem system = link_system(links(3, 4, GetParam()));
  const Eigen::Index n = system.size();
  const auto x = random_vector(n, 0.5, 6), v = random_vector(n, 3.0, 7);
  Eigen::VectorXd a(n), residual(n), forces(n);
  ASSERT_TRUE(system.acceleration(0.0, x, v, a));
  system.residual(0.0, x, v, a, residual);
  system.residual(0.0, x, v, Eigen::VectorXd::Zero(n), forces);
  EXPECT_LT(residual.norm(), 1e-11 * forces.norm());
}

TEST_P(Mechanics, LinearizationIsExactAtRest) {
  PlantSettings settings = links(2, 4, GetParam());
  LinkSystem system = link_system(settings);
  const Eigen::Index n = system.size();
  const auto x = random_vector(n, 0.8, 8);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(n);
  Eigen::MatrixXd B(n, n), by_v(n, n), by_x(n, n);
  system.linearize(0.0, x, zero, zero, B, by_v, by_x);
  Eigen::VectorXd above(n), below(n);
  const double h = 1e-5;
  for (Eigen::Index j = 0; j < n; ++j) {
    system.residual(0.0, x + h * Eigen::VectorXd::Unit(n, j), zero, zero, above);
    system.residual(0.0, x - h * Eigen::VectorXd::Unit(n, j), zero, zero, below);
    EXPECT_LT(((above - below) / (2 * h) - by_x.col(j)).norm(), 1e-9) << j;
    system.residual(0.0, x, h * Eigen::VectorXd::Unit(n, j), zero, above);
    system.residual(0.0, x, -h * Eigen::VectorXd::Unit(n, j), zero, below);
    EXPECT_LT(((above - below) / (2 * h) - by_v.col(j)).norm(), 1e-9) << j;
  }
}

TEST_P(Mechanics, PowersAndEnergiesBelongTogether) {
  PlantSettings settings = links(2, 3, GetParam());
  settings.tip_force_n = {0.3, -0.2, 0.5};
  LinkSystem system = link_system(settings);
  const Eigen::Index n = system.size();
  const Eigen::VectorXd force = random_vector(4, 1.0, 9);
  for (const ActuationModel model : {ActuationModel::chamber, ActuationModel::couple}) {
    settings.arm.actuation = model;
    LinkSystem driven = link_system(settings);
    driven.drive(0.0, force, force, 0.0);
    const auto x = random_vector(n, 0.6, 10), v = random_vector(n, 3.0, 11);
    Eigen::VectorXd a(n);
    ASSERT_TRUE(driven.acceleration(0.0, x, v, a));
    const double h = 1e-7;  // far below v / a
    const auto energy = [&](double t) {
      const Eigen::VectorXd at = x + t * v + 0.5 * t * t * a, rate = v + t * a;
      return driven.kinetic_energy_j(at, rate) + driven.potential_energy_j(at);
    };
    const auto powers = driven.powers(0.0, x, v);
    EXPECT_NEAR((energy(h) - energy(-h)) / (2 * h), powers.supplied_w - powers.dissipated_w,
                1e-4 * std::abs(powers.dissipated_w));
  }
}

TEST(LinkSystem, CoupleDoesTheWorkOfAMomentOnTheSegmentsEnd) {
  PlantSettings settings = links(2, 3);
  settings.arm.actuation = ActuationModel::couple;
  LinkSystem system = link_system(settings);
  const Eigen::Index n = system.size();
  const auto x = random_vector(n, 0.6, 12);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(n);
  Eigen::VectorXd without(n), with(n);
  system.residual(0.0, x, zero, zero, without);
  const Eigen::Vector4d force(0.3, -0.4, 0.5, 0.2);  // A_chamber tau_A
  system.drive(0.0, force, force, 0.0);
  system.residual(0.0, x, zero, zero, with);
  const auto place = chain(settings, x.cast<Real>());
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto turned = [&](Real t, std::size_t link) -> Vector3 {  // since t = 0
      VectorX y = x.cast<Real>();
      y[k] += t;
      const Matrix3 r = chain(settings, y).rotation[link] * place.rotation[link].transpose();
      return Vector3(r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1)) / 2;
    };
    Real work = 0;
    const Matrix3 base = settings.arm.base_rotation.cast<Real>();
    for (int i = 0; i < 2; ++i) {
      const Vector3 tau =
          (i == 0 ? base : place.rotation[2]) * Vector3(-force[2 * i + 1], force[2 * i], 0);
      const auto last = static_cast<std::size_t>(3 * i + 2);
      work += tau.dot(derivative([&](Real t) { return Vector3(turned(t, last)); }));
      if (i > 0) work -= tau.dot(derivative([&](Real t) { return Vector3(turned(t, 2)); }));
    }
    EXPECT_NEAR(without[k] - with[k], static_cast<double>(work), 1e-12) << k;
  }
}

TEST(LinkSystem, UniformMomentHoldsAUniformBend) {
  PlantSettings settings = links(1, 6);
  settings.arm.gravity_mps2.setZero();
  LinkSystem system = link_system(settings);
  const Eigen::Vector2d u(0.9, -1.4);
  const Eigen::Vector2d moment = 0.626 * u;
  system.drive(0.0, moment, moment, 0.0);
  Eigen::VectorXd x(12), residual(12);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(12);
  system.spread(u, x);
  system.residual(0.0, x, zero, zero, residual);
  EXPECT_LT(residual.norm(), 1e-14);
  for (Eigen::Index j = 2; j < 12; j += 2) EXPECT_EQ(x.segment<2>(j), x.head<2>());

  // In a plane through a joint's axis the end turns by the sum of the joints' angles.
  system.spread(Eigen::Vector2d(1.7, 0.0), x);
  Eigen::Vector2d bend, rate;
  system.curvature(x, zero, bend, rate);
  EXPECT_NEAR(bend.x(), 1.7, 1e-14);
  EXPECT_EQ(bend.y(), 0.0);
}

TEST(LinkSystem, FittedCurvatureIsThatOfTheEndAndItsRateItsDerivative) {
  for (const double bend : {0.0, 0.4, 2.5, 4.0}) {
    LinkSystem system = link_system(links(2, 6));
    Eigen::VectorXd x(24), v = random_vector(24, 1.0, 14);
    system.spread(Eigen::Vector4d(bend, 0.3 * bend, -bend, 0.2), x);
    x += random_vector(24, bend == 0.0 ? 0.0 : 0.02, 15);
    const auto fit = [&](double t) {
      Eigen::VectorXd u(4), rate(4);
      system.curvature(x + t * v, v, u, rate);
      return u;
    };
    Eigen::VectorXd u(4), rate(4);
    system.curvature(x, v, u, rate);
    EXPECT_LT(((fit(1e-5) - fit(-1e-5)) / 2e-5 - rate).norm(), 1e-8) << bend;
    std::vector<Eigen::Isometry3d> ends(2);
    system.segment_ends(x, ends);
    const Eigen::Matrix3d turn = ends[0].linear().transpose() * ends[1].linear();
    const Eigen::Vector2d second = u.tail<2>();
    const Eigen::Quaterniond q(turn);
    EXPECT_NEAR(std::abs(q.vec().head<2>().dot(second)), 0.0, 1e-13 * bend + 1e-15);
    // Crossed joints twist a little, but the sheet of theta is the right one beyond pi too.
    EXPECT_NEAR(u.head<2>().norm(), std::hypot(1.0, 0.3) * bend, 0.15 * bend + 1e-12);
  }
}

/// Lowest angular frequency (rad/s) of small motions about the straight arm without gravity.
double lowest_frequency(SecondOrderSystem& system) {
  const Eigen::Index n = system.size();
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(n);
  Eigen::MatrixXd B(n, n), by_v(n, n), K(n, n);
  system.linearize(0.0, zero, zero, zero, B, by_v, K);
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> modes(
      0.5 * (K + K.transpose()), B, Eigen::EigenvaluesOnly | Eigen::Ax_lBx);
  return std::sqrt(modes.eigenvalues()[0]);
}

TEST(PlantSystem, ManyPartsVibrateAsACantileverDoes) {
  PlantSettings settings = links(1, 8);
  settings.arm.gravity_mps2.setZero();
  const SegmentParameters& segment = settings.arm.segments[0];
  // A rod of length L with E I = k L; first root of cos x cosh x = -1.
  const double root = 1.87510406871196;
  const double expected = root * root *
                          std::sqrt(segment.stiffness_nm_per_rad /
                                    (segment.mass_kg * segment.length_m * segment.length_m));
  const auto error = [&](MakeKind kind, int parts) {
    return std::abs(lowest_frequency(*kind(parts).make(settings)) / expected - 1.0);
  };
  EXPECT_LT(error(kRefined, 48), 1e-4);
  EXPECT_NEAR(error(kRefined, 8) / error(kRefined, 16), 4.0, 0.3);
  // Joints at the links' starts are half a link off their place: first order.
  EXPECT_NEAR(error(kLinks, 16) / error(kLinks, 32), 2.0, 0.1);
}

}  // namespace
}  // namespace softarm
