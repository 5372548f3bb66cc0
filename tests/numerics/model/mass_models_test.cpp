// What the choice of mass model does to B and to the stiffness of the equations, in numbers: the
// tables of docs/results/mass_models.md are what these tests print.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <cmath>

#include "softarm/model/dynamics.hpp"
#include "softarm/model/modes.hpp"

namespace softarm {
namespace {

ArmParameters paper_arm(int segments, MassModel mass, double radius_m = 0.0) {
  ArmParameters arm;
  arm.segments.assign(static_cast<std::size_t>(segments), {.radius_m = radius_m});
  arm.mass = mass;
  return arm;
}

Eigen::MatrixXd inertia(const ArmParameters& arm, double theta) {
  Eigen::VectorXd u = Eigen::VectorXd::Zero(arm.dof());
  for (Eigen::Index i = 0; i < u.size(); i += 2) u(i) = theta;
  Eigen::MatrixXd B(arm.dof(), arm.dof());
  DynamicsWorkspace workspace(arm);
  inertia_matrix(arm, workspace, u, B);
  return B;
}

/// Fastest damped rate of the straight arm, largest eigenvalue of B^-1 D, in 1/s.
double fastest_rate(const ArmParameters& arm) {
  const Eigen::MatrixXd B = inertia(arm, 0.0);
  const Eigen::MatrixXd D =
      arm.segments.front().damping_nms_per_rad * Eigen::MatrixXd::Identity(arm.dof(), arm.dof());
  return symmetric_modes(D, B).values[arm.dof() - 1];
}

TEST(MassModels, PointMassesMakeTheEquationsStiff) {
  fmt::print("  n   point (1/s)   distributed (1/s)   45 mm thick (1/s)\n");
  double before = 0.0;
  const double known[] = {575.0, 2.2e4, 3.7e5, 5.4e6, 0.0, 1.05e9};  // by 50 digits elsewhere
  for (int n = 1; n <= 6; ++n) {
    const double point = fastest_rate(paper_arm(n, MassModel::point));
    const double distributed = fastest_rate(paper_arm(n, MassModel::distributed));
    const double thick = fastest_rate(paper_arm(n, MassModel::distributed, 0.0225));
    fmt::print("  {}   {:11.3g}   {:17.3g}   {:17.3g}\n", n, point, distributed, thick);
    const double expected = known[n - 1];
    if (expected > 0.0) {
      EXPECT_NEAR(point, expected, 0.03 * expected);
    }
    // The smallest eigenvalue of B falls as (2 + sqrt 3)^(2 n) for long arms.
    if (n > 3) {
      EXPECT_NEAR(point / before, std::pow(2.0 + std::sqrt(3.0), 2), 1.0);
    }
    EXPECT_LT(distributed, 3e3);
    EXPECT_LT(thick, distributed);
    before = point;
  }
}

TEST(MassModels, LastSegmentsInertia) {
  fmt::print("  theta (rad)   distributed/point, along   across   45 mm thick/thin\n");
  for (const double theta : {0.0, 0.4, M_PI / 2, M_PI}) {
    const Eigen::MatrixXd point = inertia(paper_arm(1, MassModel::point), theta);
    const Eigen::MatrixXd thin = inertia(paper_arm(1, MassModel::distributed), theta);
    const Eigen::MatrixXd thick = inertia(paper_arm(1, MassModel::distributed, 0.0225), theta);
    fmt::print("  {:11.3f}   {:24.3f}   {:6.3f}   {:16.3f}\n", theta, thin(0, 0) / point(0, 0),
               thin(1, 1) / point(1, 1), thick(0, 0) / thin(0, 0));
    if (theta == 0.0) {
      EXPECT_NEAR(thin(0, 0) / point(0, 0), (1.0 / 20.0) / (1.0 / 36.0), 1e-12);
      // mu r^2/4 over x^2: r^2/12 against L^2/20.
      EXPECT_NEAR(thick(0, 0) / thin(0, 0), 1.0 + (0.0225 * 0.0225 / 12.0) / (0.11 * 0.11 / 20.0),
                  1e-12);
    }
  }
}

}  // namespace
}  // namespace softarm
