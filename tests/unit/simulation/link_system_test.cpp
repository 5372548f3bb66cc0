// The links against mechanics by another route: points and directions in long double, differenced.
#include "simulation/link_system.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "softarm/model/modes.hpp"
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

/// Behind the interface that integrators use.
std::unique_ptr<PlantSystem> link_system(const PlantSettings& settings) {
  return settings.kind.make(settings);
}

struct Chain {
  std::vector<Vector3> centre, along;  // from the link's start to its end
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
  const int width = settings.arm.segment_dof();
  for (Eigen::Index j = 0; width * j < x.size(); ++j) {
    const auto i = static_cast<std::size_t>(j / per_segment);
    const Real length = Real(settings.arm.segments[i].length_m) / per_segment +
                        (width == 3 ? x[3 * j + 2] : Real(0));
    rotation = rotation * Eigen::AngleAxis<Real>(x[width * j], Vector3::UnitX()) *
               Eigen::AngleAxis<Real>(x[width * j + 1], Vector3::UnitY());
    const Vector3 along = length * rotation.col(2);
    result.rotation.push_back(rotation);
    result.along.push_back(along);
    result.centre.push_back(start + along / 2);
    start += along;
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
/// every way it can go. A rod's grains are at centre + s along, s in [-1/2, 1/2].
VectorX inertia_less_weight(const PlantSettings& settings, const VectorX& x, const VectorX& v,
                            const VectorX& a) {
  const auto at = [&](Real t) { return chain(settings, x + t * v + t * t / 2 * a); };
  VectorX force = VectorX::Zero(x.size());
  const Vector3 gravity = settings.arm.gravity_mps2.cast<Real>();
  for (std::size_t j = 0; j < at(0).along.size(); ++j) {
    const auto m =
        static_cast<std::size_t>(settings.kind.get_if<LinkSettings>()->links_per_segment);
    const SegmentParameters& segment = settings.arm.segments[j / m];
    const Real mass = Real(segment.mass_kg) / Real(m);
    const Real spread = settings.arm.mass == MassModel::point ? Real(0) : mass / 12;
    const Vector3 centre = second_derivative([&](Real t) { return Vector3(at(t).centre[j]); });
    const Vector3 along = second_derivative([&](Real t) { return Vector3(at(t).along[j]); });
    for (Eigen::Index k = 0; k < x.size(); ++k) {
      const auto moved = [&](Real t) {
        VectorX y = x;
        y[k] += t;
        return chain(settings, y);
      };
      const Vector3 by_centre = derivative([&](Real t) { return Vector3(moved(t).centre[j]); });
      const Vector3 by_along = derivative([&](Real t) { return Vector3(moved(t).along[j]); });
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

/// Coordinates of links (or their rates): angles to `scale`, and s to a fiftieth of that.
Eigen::VectorXd random_links(const PlantSettings& settings, Eigen::Index size, double scale,
                             unsigned seed) {
  Eigen::VectorXd x = random_vector(size, scale, seed);
  for (Eigen::Index s = 2; settings.arm.extensible && s < size; s += 3) x[s] *= 0.02;
  return x;
}

/// Both mass models; links of one length, and links that stretch.
class Mechanics : public ::testing::TestWithParam<std::tuple<MassModel, bool>> {
 protected:
  static PlantSettings chosen(int segments, int per_segment) {
    PlantSettings settings = links(segments, per_segment, std::get<0>(GetParam()));
    settings.arm.extensible = std::get<1>(GetParam());
    return settings;
  }
};
INSTANTIATE_TEST_SUITE_P(Masses, Mechanics,
                         ::testing::Combine(::testing::Values(MassModel::point,
                                                              MassModel::distributed),
                                            ::testing::Bool()));

TEST_P(Mechanics, ResidualIsNewtonsLawForEveryGrain) {
  const PlantSettings settings = chosen(2, 3);
  const auto made = link_system(settings);
  PlantSystem& system = *made;
  const Eigen::Index n = system.size();
  const auto x = random_links(settings, n, 0.8, 1), v = random_links(settings, n, 3.0, 2),
             a = random_links(settings, n, 20, 3);
  Eigen::VectorXd residual(n);
  system.residual(0.0, x, v, a, residual);
  Eigen::VectorXd k = Eigen::VectorXd::Constant(n, 3 * 0.626), beta = k / 0.626 * 0.029;
  for (Eigen::Index s = 2; settings.arm.extensible && s < n; s += 3) {
    k[s] = 3 * 4000.0;
    beta[s] = 3 * 185.0;
  }
  const VectorX expected =
      inertia_less_weight(settings, x.cast<Real>(), v.cast<Real>(), a.cast<Real>()) +
      (k.cwiseProduct(x) + beta.cwiseProduct(v)).cast<Real>();
  EXPECT_LT((residual - expected.cast<double>()).norm(), 1e-12 * residual.norm());
}

TEST_P(Mechanics, InertiaIsWhatTheResidualAsksForUnitAccelerations) {
  PlantSettings settings = chosen(2, 4);
  settings.payload_kg = {0.03, 0.02};
  const auto made = link_system(settings);
  PlantSystem& system = *made;
  const Eigen::Index n = system.size();
  const auto x = random_links(settings, n, 0.8, 4), v = random_links(settings, n, 3.0, 5);
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
  const PlantSettings settings = chosen(3, 4);
  const auto made = link_system(settings);
  PlantSystem& system = *made;
  const Eigen::Index n = system.size();
  const auto x = random_links(settings, n, 0.5, 6), v = random_links(settings, n, 3.0, 7);
  Eigen::VectorXd a(n), residual(n), forces(n);
  ASSERT_TRUE(system.acceleration(0.0, x, v, a));
  system.residual(0.0, x, v, a, residual);
  system.residual(0.0, x, v, Eigen::VectorXd::Zero(n), forces);
  EXPECT_LT(residual.norm(), 1e-11 * forces.norm());
}

TEST_P(Mechanics, LinearizationIsExactAtRest) {
  PlantSettings settings = chosen(2, 4);
  settings.payload_kg = {0.03, 0.02};
  const auto made = link_system(settings);
  PlantSystem& system = *made;
  const Eigen::Index n = system.size();
  const auto x = random_links(settings, n, 0.8, 8);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(n);
  Eigen::MatrixXd B(n, n), by_v(n, n), by_x(n, n);
  system.linearize(0.0, x, zero, zero, B, by_v, by_x);
  Eigen::VectorXd above(n), below(n);
  const double h = 1e-5;
  for (Eigen::Index j = 0; j < n; ++j) {
    system.residual(0.0, x + h * Eigen::VectorXd::Unit(n, j), zero, zero, above);
    system.residual(0.0, x - h * Eigen::VectorXd::Unit(n, j), zero, zero, below);
    const double round_off = 1e-9 * std::max(1.0, above.norm() / 20.0);
    EXPECT_LT(((above - below) / (2 * h) - by_x.col(j)).norm(), round_off) << j;
    system.residual(0.0, x, h * Eigen::VectorXd::Unit(n, j), zero, above);
    system.residual(0.0, x, -h * Eigen::VectorXd::Unit(n, j), zero, below);
    EXPECT_LT(((above - below) / (2 * h) - by_v.col(j)).norm(), round_off) << j;
  }
}

TEST_P(Mechanics, PowersAndEnergiesBelongTogether) {
  PlantSettings settings = chosen(2, 3);
  settings.tip_force_n = {0.3, -0.2, 0.5};
  settings.payload_kg = {0.03, 0.02};
  const Eigen::VectorXd force = random_vector(settings.arm.dof(), 1.0, 9);
  for (const ActuationModel model : {ActuationModel::chamber, ActuationModel::couple}) {
    if (settings.arm.extensible && model == ActuationModel::couple) continue;
    settings.arm.actuation = model;
    const auto made = link_system(settings);
    PlantSystem& driven = *made;
    const Eigen::Index n = driven.size();
    driven.drive(0.0, force, force, 0.0);
    const auto x = random_links(settings, n, 0.6, 10), v = random_links(settings, n, 3.0, 11);
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
  const auto made = link_system(settings);
  PlantSystem& system = *made;
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

TEST_P(Mechanics, LinksOfHeldLengthMoveAsThoseThatCannotStretch) {
  PlantSettings settings = chosen(2, 3);
  settings.payload_kg = {0.03, 0.02};
  settings.tip_force_n = {0.3, -0.2, 0.5};
  settings.arm.extensible = true;
  for (SegmentParameters& segment : settings.arm.segments) segment.constant_length = true;
  const auto held = link_system(settings);
  settings.arm.extensible = false;
  const auto rigid = link_system(settings);
  for (PlantSystem* system : {held.get(), rigid.get()}) system->external_loads().enter(0.0);
  const auto x = random_vector(12, 0.8, 20), v = random_vector(12, 3.0, 21);
  Eigen::VectorXd held_x = Eigen::VectorXd::Zero(18), held_v = held_x, held_a = held_x, a(12);
  for (Eigen::Index j = 0; j < 6; ++j) {
    held_x.segment<2>(3 * j) = x.segment<2>(2 * j);
    held_v.segment<2>(3 * j) = v.segment<2>(2 * j);
  }
  ASSERT_TRUE(rigid->acceleration(0.0, x, v, a));
  ASSERT_TRUE(held->acceleration(0.0, held_x, held_v, held_a));
  for (Eigen::Index j = 0; j < 6; ++j) {
    EXPECT_LT((held_a.segment<2>(3 * j) - a.segment<2>(2 * j)).norm(), 1e-10 * a.norm()) << j;
    EXPECT_EQ(held_a[3 * j + 2], 0.0);
  }
  EXPECT_NEAR(held->kinetic_energy_j(held_x, held_v), rigid->kinetic_energy_j(x, v), 1e-14);
  EXPECT_NEAR(held->potential_energy_j(held_x), rigid->potential_energy_j(x), 1e-14);
}

TEST(LinkSystem, UniformMomentHoldsAUniformBend) {
  PlantSettings settings = links(1, 6);
  settings.arm.gravity_mps2.setZero();
  const auto made = link_system(settings);
  PlantSystem& system = *made;
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
    const auto made = link_system(links(2, 6));
    PlantSystem& system = *made;
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

/// Lowest angular frequency (rad/s) of small motions about the straight arm without gravity; of
/// those along the arm alone where `axial`.
double lowest_frequency(SecondOrderSystem& system, bool axial = false) {
  const Eigen::Index n = system.size();
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(n);
  Eigen::MatrixXd B(n, n), by_v(n, n), K(n, n);
  system.linearize(0.0, zero, zero, zero, B, by_v, K);
  if (axial) {
    const auto along = Eigen::seqN(2, n / 3, 3);
    B = Eigen::MatrixXd(B(along, along));
    K = Eigen::MatrixXd(K(along, along));
  }
  return std::sqrt(symmetric_modes(0.5 * (K + K.transpose()), B).values[0]);
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

TEST(PlantSystem, ManyPartsVibrateAlongThemselvesAsARodDoes) {
  PlantSettings settings = stretching(links(1, 8));
  settings.arm.gravity_mps2.setZero();
  const SegmentParameters& segment = settings.arm.segments[0];
  // A quarter of a wave on a rod with E A = k_a L.
  const double expected =
      std::numbers::pi / 2.0 * std::sqrt(segment.axial_stiffness_n_per_m / segment.mass_kg);
  for (const MakeKind kind : {kRefined, kLinks}) {
    const auto error = [&](int parts) {
      return std::abs(lowest_frequency(*kind(parts).make(settings), true) / expected - 1.0);
    };
    EXPECT_LT(error(48), 1e-4);
    EXPECT_NEAR(error(8) / error(16), 4.0, 0.1);
  }
}

}  // namespace
}  // namespace softarm
