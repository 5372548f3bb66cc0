// Errors of every term of the direct route against the reference model in long double, as
// multiples of the rounding unit of a double, relative to the size that conditioning allows.
//
// The size of a term is the sum of the magnitudes that the masses contribute (Cauchy's inequality
// over the masses): s_i s_j for B, s_i (r_j + s_j |u'|) for C, s_i sqrt(mass) |g| for G, and their
// sums for the recursion; s_i = sqrt(sum mu |J_i|^2), r_j = sqrt(sum mu |J_j-dot|^2). What is small
// against it is the difference of larger contributions, and an error relative to itself is more
// than the rounding of u itself leaves. Positions and Jacobians count against the arm's length.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "dev/reference_model/reference_model.hpp"
#include "softarm/model/dynamics.hpp"
#include "softarm/model/kinematics.hpp"
#include "unit/model/random_arm.hpp"

namespace softarm::testing_support {

enum Term : std::size_t {
  rotation,
  tip,
  centres,
  jacobian,
  jacobian_rate,
  angular_jacobian,
  inertia,
  coriolis,
  gravity,
  coriolis_force,
  inverse,
  kinetic,
  potential,
  residual,
  kTerms
};

inline constexpr std::array<const char*, kTerms> kTermNames = {"R",
                                                               "tip t",
                                                               "centres",
                                                               "J",
                                                               "J-dot",
                                                               "angular J",
                                                               "B",
                                                               "C",
                                                               "G",
                                                               "C(u, a) b",
                                                               "B x + C(u, a) b + G",
                                                               "kinetic energy",
                                                               "gravity potential",
                                                               "forward dynamics, residual"};

/// Largest error of each term; a NaN counts as infinite.
struct Errors {
  std::array<double, kTerms> ulp{};

  void add(Term term, long double relative) {
    const double value = static_cast<double>(relative / std::numeric_limits<double>::epsilon());
    ulp[term] = std::isnan(value) ? INFINITY : std::max(ulp[term], value);
  }
  void merge(const Errors& other) {
    for (std::size_t k = 0; k < kTerms; ++k) ulp[k] = std::max(ulp[k], other.ulp[k]);
  }
};

/// Is there a B to divide by in double? Not with point masses of long arms, every segment of which
/// costs a digit; nor of segments that stretch and are bent by nearly a full turn, whose own columns
/// vanish there.
inline bool solvable(const ArmParameters& arm, const State& state) {
  if (arm.mass == MassModel::distributed) return true;
  double theta = 0.0;
  for (int i = 0; arm.extensible && i < arm.size(); ++i) {
    theta = std::max(theta, state.u.segment<2>(3 * i).norm());
  }
  return arm.size() <= 7 && theta < 5.5;
}

class AgainstReference {
 public:
  /// @param state u, u' and u'' for the recursion; its second velocity is made of the two.
  AgainstReference(const ArmParameters& arm, const State& state)
      : AgainstReference(arm, state, solvable(arm, state)) {}
  AgainstReference(const ArmParameters& arm, const State& state, bool with_forward)
      : arm_(arm),
        state_(state),
        dof_(arm.dof()),
        workspace_(arm),
        u_(state.u.cast<long double>()),
        v_(state.v.cast<long double>()),
        want_(reference::dynamics(arm, u_, v_)) {
    speed_ = largest_rate(arm, u_, v_);
    kinematics();
    matrices();
    recursion();
    if (with_forward) forward();
  }

  const Errors& errors() const { return errors_; }
  const reference::Dynamics& want() const { return want_; }

 private:
  using Vector = reference::Vector;
  using Matrix = reference::Matrix;

  void kinematics() {
    const auto want = reference::kinematics(arm_, u_, v_);
    long double length = 0;
    for (int i = 0; i < arm_.size(); ++i) {
      length += arm_.segments[static_cast<std::size_t>(i)].length_m;
      if (arm_.extensible) length += u_(3 * i + 2);
    }
    const auto largest = [](const Matrix& m) { return m.cwiseAbs().maxCoeff(); };
    const Eigen::Isometry3d pose = tip_pose(arm_, state_.u);
    errors_.add(rotation, largest(pose.linear().cast<long double>() - want.rotations.back()));
    const long double offset = arm_.base_position_m.cast<long double>().norm();
    errors_.add(tip, largest(pose.translation().cast<long double>() - want.positions.back()) /
                         (length + offset));
    Eigen::Matrix3Xd got(3, arm_.size()), J(3, dof_), J_rate(3, dof_);
    mass_centres(arm_, state_.u, got);
    errors_.add(centres, largest(got.cast<long double>() - want.centres) / (length + offset));
    tip_jacobians(arm_, state_.u, state_.v, J, J_rate);
    // Columns along e, m/m, count as the others, m/rad: for a strain of the whole arm.
    const auto in_metres = [&](Matrix columns) {
      for (int j = 2; arm_.extensible && j < dof_; j += 3) columns.col(j) *= length;
      return columns;
    };
    errors_.add(jacobian, largest(in_metres(J.cast<long double>() - want.jacobian)) / length);
    errors_.add(jacobian_rate,
                largest(in_metres(J_rate.cast<long double>() - want.jacobian_rate)) /
                    (largest(in_metres(want.jacobian_rate)) + length * speed_ + smallest_));
    tip_angular_jacobian(arm_, state_.u, J);
    errors_.add(angular_jacobian, largest(J.cast<long double>() - want.angular_jacobian));
  }

  void matrices() {
    B_.resize(dof_, dof_);
    C_ = B_;
    Eigen::VectorXd G(dof_);
    dynamics_matrices(arm_, workspace_, state_.u, state_.v, B_, C_, G);
    for (int i = 0; i < dof_; ++i) {
      for (int j = 0; j < dof_; ++j) {
        errors_.add(inertia, std::abs(B_(i, j) - want_.B(i, j)) / (want_.s(i) * want_.s(j)));
        errors_.add(coriolis, std::abs(C_(i, j) - want_.C(i, j)) / (want_.s(i) * rate_size(j)));
      }
      errors_.add(gravity, std::abs(G(i) - want_.G(i)) / (want_.s(i) * want_.w));
    }
    errors_.add(kinetic, std::abs(kinetic_energy(arm_, workspace_, state_.u, state_.v) -
                                  want_.kinetic_energy) /
                             (std::pow(want_.s.dot(v_.cwiseAbs()), 2) + smallest_));
    long double mass = 0;
    for (const auto& s : arm_.segments) mass += s.mass_kg;
    errors_.add(potential, std::abs(gravity_potential(arm_, state_.u) - want_.gravity_potential) /
                               want_.potential_scale);
  }

  void recursion() {
    const Eigen::VectorXd other = arm_.extensible ? Eigen::VectorXd(-state_.v) : state_.v.reverse();
    const Eigen::VectorXd b = 0.7 * other + 0.3 * state_.a;
    const Vector b_exact = b.cast<long double>(), x = state_.a.cast<long double>();
    Eigen::VectorXd force(dof_), all(dof_);
    inverse_dynamics(arm_, workspace_, state_.u, state_.v, b, state_.a,
                     {.inertia = false, .coriolis = true, .gravity = false}, force);
    inverse_dynamics(arm_, workspace_, state_.u, state_.v, b, state_.a, {}, all);
    const Vector want_force = want_.C * b_exact;
    const Vector want_all = reference::inverse_dynamics(want_, b_exact, x);
    // The product is bilinear: the rates of J along a times b, of the same size as along b times a.
    long double force_size = 0, inertia_size = want_.s.dot(x.cwiseAbs());
    for (int j = 0; j < dof_; ++j) force_size += rate_size(j) * std::abs(b_exact(j));
    for (int i = 0; i < dof_; ++i) {
      errors_.add(coriolis_force,
                  std::abs(force(i) - want_force(i)) / (want_.s(i) * force_size + smallest_));
      errors_.add(inverse, std::abs(all(i) - want_all(i)) /
                               (want_.s(i) * (force_size + inertia_size + want_.w)));
    }
  }

  /// B u'' + C u' + D u' + G + K u - tau, which Cholesky keeps small whatever the condition of B.
  void forward() {
    const Eigen::VectorXd tau = 0.1 * state_.a;
    Eigen::VectorXd got(dof_);
    if (!softarm::forward_dynamics(arm_, workspace_, state_.u, state_.v, tau, got)) {
      errors_.add(residual, INFINITY);
      return;
    }
    const Vector x = got.cast<long double>();
    const Vector impedance = reference::impedance(arm_, u_, v_);
    const Vector left = reference::inverse_dynamics(want_, v_, x) + impedance;
    long double size = want_.s.dot(x.cwiseAbs()) + want_.w;
    for (int j = 0; j < dof_; ++j) size += rate_size(j) * std::abs(v_(j));
    const Vector elastic = reference::impedance(arm_, u_.cwiseAbs(), v_.cwiseAbs());
    for (int i = 0; i < dof_; ++i) {
      errors_.add(residual,
                  std::abs(left(i) - tau(i)) / (want_.s(i) * size + elastic(i) + std::abs(tau(i))));
    }
  }

  long double rate_size(int j) const { return want_.r(j) + want_.s(j) * speed_ + smallest_; }

  static constexpr long double smallest_ = 1e-4000L;  ///< keeps 0 / 0 at 0

  const ArmParameters& arm_;
  const State& state_;
  int dof_;
  DynamicsWorkspace workspace_;
  Vector u_, v_;
  reference::Dynamics want_;
  long double speed_ = 0;
  Eigen::MatrixXd B_, C_;
  Errors errors_;
};

/// What the sizes leave to an honest evaluation in double: the rounding of the entire functions
/// grows as theta^2 against the functions themselves (c_k is of size theta^-2 and less where its
/// error is that of 1/k!), and a chain of n segments adds up n of them.
inline double allowed(int segments, double theta) {
  return (1.0 + theta * theta) * (1.0 + 0.1 * segments);
}

/// Times `allowed`. B alone has more: a column of a point mass at its centre nearly vanishes at
/// some large bendings, and s_j with it.
inline constexpr double kTolerance = 4.0, kInertiaTolerance = 32.0;

inline void expect_within(const AgainstReference& got, int segments, double theta) {
  for (std::size_t k = 0; k < kTerms; ++k) {
    EXPECT_LE(got.errors().ulp[k],
              (k == inertia ? kInertiaTolerance : kTolerance) * allowed(segments, theta))
        << kTermNames[k];
  }
}

}  // namespace softarm::testing_support
