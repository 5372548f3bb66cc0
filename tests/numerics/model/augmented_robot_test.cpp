// Two routes to the same arm: the augmented rigid robot against the recursion in u.
#include "softarm/model/augmented_robot.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <initializer_list>
#include <limits>
#include <map>
#include <string>

#include "softarm/model/dynamics.hpp"
#include "softarm/model/kinematics.hpp"
#include "softarm/model/polar.hpp"
#include "unit/model/random_arm.hpp"

namespace softarm {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
constexpr int kStates = 100'000;

struct Terms {
  explicit Terms(int dof) : B(dof, dof), C(dof, dof), J(3, dof), G(dof) {}
  Eigen::MatrixXd B, C;
  Eigen::Matrix3Xd J;
  Eigen::VectorXd G;
};

/// The direct route, taken to polar coordinates.
class Direct {
 public:
  explicit Direct(const ArmParameters& arm) : arm_(arm), workspace_(arm), terms_(arm.dof()) {}

  const Terms& operator()(const Eigen::VectorXd& q, const Eigen::VectorXd& velocity) {
    Eigen::VectorXd u(q.size()), u_velocity(q.size());
    polar_to_u(q, u);
    polar_velocity_to_u(q, velocity, u_velocity);
    dynamics_matrices(arm_, workspace_, u, u_velocity, terms_.B, terms_.C, terms_.G);
    dynamics_to_polar(q, velocity, terms_.B, terms_.C, terms_.G);
    tip_jacobian(arm_, u, terms_.J);
    Eigen::MatrixXd J = terms_.J;
    jacobian_to_polar(q, J);
    terms_.J = J;
    return terms_;
  }

 private:
  ArmParameters arm_;
  DynamicsWorkspace workspace_;
  Terms terms_;
};

class Augmented {
 public:
  explicit Augmented(const ArmParameters& arm) : robot_(arm), terms_(arm.dof()) {}

  const Terms& operator()(const Eigen::VectorXd& q, const Eigen::VectorXd& velocity) {
    Eigen::Matrix3Xd unused(3, q.size());
    robot_.update(q, velocity);
    terms_.B = robot_.B();
    terms_.C = robot_.C();
    terms_.G = robot_.G();
    robot_.tip_jacobians(terms_.J, unused);
    return terms_;
  }

 private:
  AugmentedRobot robot_;
  Terms terms_;
};

double largest(const Eigen::MatrixXd& m) { return m.cwiseAbs().maxCoeff(); }

double total_mass(const ArmParameters& arm) {
  double sum = 0.0;
  for (const SegmentParameters& segment : arm.segments) sum += segment.mass_kg;
  return sum;
}
double total_length(const ArmParameters& arm) {
  double sum = 0.0;
  for (const SegmentParameters& segment : arm.segments) sum += segment.length_m;
  return sum;
}

/// Differences over tolerance. The tolerance is 1e-12 of a term's largest entry. C and G may vanish
/// as a whole, by symmetry: as every theta goes to 0, C of one segment does, and G of an arm that
/// hangs; they are differences of numbers of the size they have in general, and 16 eps of that size
/// is what is left of any of them.
class Comparison {
 public:
  void add(const ArmParameters& arm, const Eigen::VectorXd& v, const Terms& a, const Terms& b) {
    const double inertia = largest(b.B), speed = largest(v);
    const double weight = total_mass(arm) * arm.gravity_mps2.norm() * total_length(arm);
    note("B", largest(a.B - b.B), largest(b.B), 0.0);
    note("C", largest(a.C - b.C), largest(b.C), inertia * speed);
    note("G", largest(a.G - b.G), largest(b.G), weight);
    note("J", largest(a.J - b.J), largest(b.J), 0.0);
    note("Cqd", largest(a.C * v - b.C * v), largest(b.C * v), inertia * speed * speed);
  }
  void expect(const char* title) const {
    for (const auto& [key, w] : worst_) {
      std::printf("  %-24s %-4s of the largest entry %8.1e, of the tolerance %.3f\n", title,
                  key.c_str(), w.of_largest, w.of_tolerance);
      EXPECT_LE(w.of_tolerance, 1.0) << title << " " << key;
    }
  }

 private:
  struct Worst {
    double of_largest = 0.0, of_tolerance = 0.0;
  };
  void note(const char* key, double error, double entry, double size) {
    Worst& w = worst_[key];
    const double ratio = error / std::max(1e-12 * entry, 16 * kEpsilon * size);
    w.of_largest = std::max(w.of_largest, error / entry);
    w.of_tolerance = std::isfinite(ratio) ? std::max(w.of_tolerance, ratio) : INFINITY;
  }
  std::map<std::string, Worst> worst_;
};

/// Angles: theta of either sign, log-uniform over the decades or uniform; phi beyond +-pi.
Eigen::VectorXd state(testing_support::RandomArm& random, int n, double least, double most) {
  const bool decades = random.uniform(0.0, 1.0) < 0.5;
  Eigen::VectorXd q(2 * n);
  for (int i = 0; i < n; ++i) {
    const double theta = decades ? std::exp(random.uniform(std::log(least), std::log(most)))
                                 : random.uniform(least, most);
    q(2 * i) = random.uniform(-7.0, 7.0);
    q(2 * i + 1) = random.uniform(-1.0, 1.0) < 0.0 ? -theta : theta;
  }
  return q;
}

void compare_random_states(int n, int states) {
  testing_support::RandomArm random(static_cast<unsigned>(100 + n));
  Comparison comparison;
  for (int k = 0; k < states; k += 50) {
    const ArmParameters arm = random.arm(n, MassModel::point, k % 100 == 0 ? 3.0 : 100.0);
    Augmented augmented(arm);
    Direct direct(arm);
    for (int l = 0; l < 50; ++l) {
      const Eigen::VectorXd q = state(random, n, 1e-4, 7.0);
      const Eigen::VectorXd v = random.vector(2 * n, l % 5 == 0 ? 1e3 : 3.0);
      comparison.add(arm, v, augmented(q, v), direct(q, v));
    }
  }
  comparison.expect(("n = " + std::to_string(n)).c_str());
}

TEST(AugmentedRobot, AgreesWithTheDirectRoute) {
  for (int n = 1; n <= 6; ++n) compare_random_states(n, kStates / 6 + 50);
}

TEST(AugmentedRobot, AgreesWhereTheArgumentSteps) {
  // eta steps by 2 pi at theta = 2 y with tan y = y and j0(y) < 0; the terms do not notice.
  constexpr double kStep = 8.98681891581812;
  testing_support::RandomArm random(31);
  Comparison comparison;
  const ArmParameters arm = random.arm(2, MassModel::point);
  Augmented augmented(arm);
  Direct direct(arm);
  Eigen::VectorXd q = random.vector(4, 3.0);
  const Eigen::VectorXd v = random.vector(4, 3.0);
  for (const double offset : {-1e-3, -1e-9, -1e-14, 0.0, 1e-14, 1e-9, 1e-3}) {
    for (const double sign : {-1.0, 1.0}) {
      q(1) = sign * (kStep + offset);
      comparison.add(arm, v, augmented(q, v), direct(q, v));
    }
  }
  comparison.expect("step of eta");
  Comparison large;
  for (double theta = 7.0; theta < 20.0; theta += 0.01) {
    q << q(0), theta, q(2), -theta;
    large.add(arm, v, augmented(q, v), direct(q, v));
  }
  large.expect("|theta| to 20");
}

/// Below 1e-4: the same tolerance still holds for every term as a whole. A phi row that does not
/// belong to the last segment is a difference of columns with an error of a few eps l each, so what
/// is promised there is eps / theta, not more.
TEST(AugmentedRobot, SmallAngles) {
  testing_support::RandomArm random(32);
  double worst_row = 0.0, worst_cross = 0.0;
  for (const double theta : {1e-5, 1e-6, 1e-8, 1e-10, 1e-12, 1e-160, 1e-300, 5e-324, 0.0}) {
    Comparison comparison;
    for (int k = 0; k < 300; ++k) {
      const int n = 2 + k % 4;
      const ArmParameters arm = random.arm(n, MassModel::point);
      Augmented augmented(arm);
      Direct direct(arm);
      const Eigen::VectorXd v = random.vector(2 * n, 3.0);
      Eigen::VectorXd q = state(random, n, 0.1, 3.0);
      for (int i = 0; i < n; ++i) {
        // One segment, every other one, or all of them.
        if (k % 3 == 0 ? i == k % n : (k % 3 == 1 ? i % 2 == 0 : true)) {
          q(2 * i + 1) = i % 2 == 0 ? theta : -theta;
        }
      }
      const Terms &a = augmented(q, v), &b = direct(q, v);
      comparison.add(arm, v, a, b);
      const double column = kEpsilon * std::sqrt(total_mass(arm)) * total_length(arm);
      const Eigen::VectorXd s = b.B.diagonal().cwiseSqrt();
      for (int i = 0; i < 2 * n; ++i) {
        for (int j = 0; j < 2 * n; ++j) {
          const double error = std::abs(a.B(i, j) - b.B(i, j));
          const double allowed = column * (s(i) + s(j) + column) + kEpsilon * s(i) * s(j);
          worst_row = std::max(worst_row, error / allowed);
        }
        if (i % 2 == 1 || i + 2 == 2 * n || q(i + 1) == 0.0) continue;
        worst_cross = std::max(
            worst_cross, std::abs(a.B(i, 2 * n - 1) - b.B(i, 2 * n - 1)) / (column * s(2 * n - 1)));
      }
    }
    char title[24];
    std::snprintf(title, sizeof title, "theta = %g", theta);
    comparison.expect(title);
  }
  std::printf("  rows of B, in eps l sqrt(mu) (s_i + s_j): %.2f\n", worst_row);
  EXPECT_LE(worst_row, 4.0);
  EXPECT_GT(worst_cross, 1e-3) << "the loss described above is real";
}

/// B' - 2C is skew. B' by central differences of eighth order along q': h^8 / 630 of the ninth
/// derivative, and 2 eps / h of B.
template <class Route>
double skewness(Route& route, const Eigen::VectorXd& q, const Eigen::VectorXd& v) {
  constexpr double h = 3e-3;
  constexpr std::array weights = {4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0};
  Eigen::MatrixXd B_rate = Eigen::MatrixXd::Zero(q.size(), q.size());
  for (int k = 1; k <= 4; ++k) {
    const double weight = weights[static_cast<std::size_t>(k - 1)] / h;
    B_rate += weight * route(q + k * h * v, v).B;
    B_rate -= weight * route(q - k * h * v, v).B;
  }
  const Terms& terms = route(q, v);
  const Eigen::MatrixXd N = B_rate - 2.0 * terms.C;
  return largest(N + N.transpose()) / largest(terms.B);
}

TEST(AugmentedRobot, BothRoutesAreSkew) {
  testing_support::RandomArm random(33);
  double worst_augmented = 0.0, worst_direct = 0.0, unskew = 0.0;
  for (int k = 0; k < 600; ++k) {
    const int n = 1 + k % 6;
    const ArmParameters arm = random.arm(n, MassModel::point);
    Augmented augmented(arm);
    Direct direct(arm);
    const Eigen::VectorXd q = state(random, n, 1e-4, 3.0), v = random.vector(2 * n, 1.0);
    worst_augmented = std::max(worst_augmented, skewness(augmented, q, v));
    worst_direct = std::max(worst_direct, skewness(direct, q, v));
    const Terms& terms = augmented(q, v);
    unskew = std::max(unskew, largest(terms.C + terms.C.transpose()) / largest(terms.B));
  }
  std::printf("  largest entry of the symmetric part over that of B: augmented %.1e, direct %.1e\n",
              worst_augmented, worst_direct);
  EXPECT_LE(worst_augmented, 5e-12);
  EXPECT_LE(worst_direct, 5e-12);
  EXPECT_GT(unskew, 0.1) << "B' itself is not small";
}

}  // namespace
}  // namespace softarm
