// The accuracy reached per term, printed as the table of docs/results/accuracy.md:
//   numerics_model_tests --gtest_filter='Accuracy.*'
#include <gtest/gtest.h>

#include <cstdio>
#include <numbers>
#include <string>

#include "against_reference.hpp"

namespace softarm {
namespace {

using testing_support::AgainstReference;
using testing_support::ArmKind;
using testing_support::Errors;
using testing_support::kTermNames;
using testing_support::kTerms;
using testing_support::RandomArm;
using testing_support::State;

struct Column {
  int segments;
  double theta_rad, ratio;
  ArmKind kind;
  int states;
  Errors errors{};
  double polar[3] = {0, 0, 0};  ///< B, C, G in polar coordinates, in the same unit
};

constexpr const char* kPolarNames[] = {"B, polar", "C, polar", "G, polar"};

/// B, C and G by the polar route, from q on, against the reference's chain rule.
void add_polar(const ArmParameters& arm, RandomArm& random, Column& column) {
  const int dof = arm.dof();
  Eigen::VectorXd q(dof), qd = random.vector(dof, 2.0), G(dof);
  for (int i = 0; i < dof; i += 2) {
    q.segment<2>(i) << random.uniform(-4.0, 4.0), random.uniform(0.0, column.theta_rad);
  }
  DynamicsWorkspace workspace(arm);
  Eigen::MatrixXd B(dof, dof), C(dof, dof);
  polar_dynamics_matrices(arm, workspace, q, qd, B, C, G);
  using reference::Vector;
  const Vector exact_q = q.cast<long double>(), exact_qd = qd.cast<long double>();
  const Vector exact_u = reference::polar_to_u(exact_q),
               exact_v = reference::polar_velocity_to_u(exact_q, exact_qd);
  const auto want =
      reference::to_polar(reference::dynamics(arm, exact_u, exact_v), exact_q, exact_qd);
  const long double speed = exact_v.cwiseAbs().maxCoeff();
  const auto add = [&column](int which, long double relative) {
    const double ulp = static_cast<double>(relative / std::numeric_limits<double>::epsilon());
    column.polar[which] = std::max(column.polar[which], ulp);
  };
  for (int i = 0; i < dof; ++i) {
    for (int j = 0; j < dof; ++j) {
      add(0, std::abs(B(i, j) - want.B(i, j)) / (want.s(i) * want.s(j)));
      add(1, std::abs(C(i, j) - want.C(i, j)) / (want.s(i) * (want.r(j) + speed * want.s(j))));
    }
    add(2, std::abs(G(i) - want.G(i)) / (want.s(i) * want.w));
  }
}

void print(const std::vector<Column>& table) {
  std::string head = "| unit 2.2e-16 |", rule = "|---|";
  for (const Column& c : table) {
    head += (c.kind.mass == MassModel::point ? " point, n " : " arc, n ") +
            std::to_string(c.segments) +
            (c.theta_rad > 4   ? ", theta < 7"
             : c.theta_rad > 2 ? ", theta < pi"
                               : ", theta < pi/2") +
            (c.ratio > 1e5 ? ", 1e6 |" : " |");
    rule += "---|";
  }
  std::printf("%s\n%s\n", head.c_str(), rule.c_str());
  for (std::size_t term = 0; term < kTerms; ++term) {
    std::printf("| %s |", kTermNames[term]);
    for (const Column& c : table) {
      // Point masses of long arms are not solved for.
      if (term == testing_support::residual && c.errors.ulp[term] == 0.0) {
        std::printf(" |");
      } else {
        std::printf(" %.2g |", c.errors.ulp[term]);
      }
    }
    std::printf("\n");
  }
  if (table.front().kind.extensible) return;  // no polar coordinates
  for (int k = 0; k < 3; ++k) {
    std::printf("| %s |", kPolarNames[k]);
    for (const Column& c : table) std::printf(" %.2g |", c.polar[k]);
    std::printf("\n");
  }
}

void measure(bool extensible) {
  const ArmKind kPoint{MassModel::point, extensible}, kArc{MassModel::distributed, extensible};
  constexpr double kPi = std::numbers::pi;
  std::vector<Column> table = {{3, kPi / 2, 3.0, kPoint, 1000}, {3, kPi / 2, 3.0, kArc, 1000},
                               {3, 7.0, 3.0, kPoint, 1000},     {3, 7.0, 3.0, kArc, 1000},
                               {6, 7.0, 1e6, kPoint, 400},      {6, 7.0, 1e6, kArc, 400},
                               {64, kPi, 3.0, kPoint, 4},       {64, kPi, 3.0, kArc, 4}};
  for (Column& column : table) {
    RandomArm random(11);
    const int n = column.segments;
    for (int k = 0; k < column.states; ++k) {
      const ArmParameters arm = random.arm(n, column.kind, column.ratio);
      const State state = random.state(arm, column.theta_rad);
      // Beside neighbours a million times as heavy an elongation has no digits left in B.
      const bool well_scaled =
          column.ratio < 1e3 || (column.kind.mass == MassModel::distributed && !extensible);
      const bool solved = well_scaled && testing_support::solvable(arm, state);
      const AgainstReference got(arm, state, solved);
      testing_support::expect_within(got, n, column.theta_rad);
      column.errors.merge(got.errors());
      if (!extensible) add_polar(arm, random, column);
    }
    const double bound =
        testing_support::kInertiaTolerance * testing_support::allowed(n, column.theta_rad);
    for (const double error : column.polar) EXPECT_LE(error, bound);
  }
  print(table);
}

TEST(Accuracy, OfEveryTerm) { measure(false); }
TEST(Accuracy, OfEveryTermWithSegmentsThatStretch) { measure(true); }

}  // namespace
}  // namespace softarm
