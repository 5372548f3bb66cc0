// ChamberMap against brute force: every vertex of the linear programme for the scale, every active
// set for the pressures.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "actuation/box_projection.hpp"
#include "dense_solvers.hpp"
#include "softarm/actuation/pressure_allocator.hpp"

namespace softarm {
namespace {

using std::numbers::pi;

struct Case {
  Eigen::Matrix2Xd W;
  double lo, hi, bias;
  Eigen::Vector2d torque;

  ChamberMap<2> map() const {
    std::vector<std::array<double, 2>> columns;
    for (int j = 0; j < W.cols(); ++j) columns.push_back({W(0, j), W(1, j)});
    return ChamberMap<2>(columns, lo, hi, bias);
  }
};

Eigen::Matrix2Xd columns_of(const std::vector<double>& angles, const std::vector<double>& gains) {
  Eigen::Matrix2Xd W(2, angles.size());
  for (std::size_t j = 0; j < angles.size(); ++j) {
    W.col(static_cast<int>(j)) =
        gains[j] * Eigen::Vector2d(std::sin(angles[j]), -std::cos(angles[j]));
  }
  return W;
}

// max s: one pressure is basic beside s, all others sit at a limit.
double brute_scale(const Case& c) {
  const int m = static_cast<int>(c.W.cols());
  const double length = c.torque.norm();
  if (length == 0.0) return 1.0;
  double best = 0.0;
  for (int k = 0; k < m; ++k) {
    Eigen::Matrix2d basis;
    basis << c.W.col(k), -c.torque / length;
    if (std::abs(basis.determinant()) < 1e-15 * basis.col(0).norm()) continue;
    const Eigen::Matrix2d inverse = basis.inverse();
    for (int bits = 0; bits < (1 << m); ++bits) {
      if ((bits >> k & 1) != 0) continue;
      Eigen::Vector2d rest = Eigen::Vector2d::Zero();
      for (int j = 0; j < m; ++j) {
        if (j != k) rest -= ((bits >> j & 1) != 0 ? c.hi : c.lo) * c.W.col(j);
      }
      const Eigen::Vector2d x = inverse * rest;
      if (x[0] > c.lo - 1e-11 && x[0] < c.hi + 1e-11) best = std::max(best, x[1]);
    }
  }
  return std::min(best / length, 1.0);
}

// min |p - b| over all ways to put unknowns at their limits.
double brute_distance(const Case& c, const Eigen::Vector2d& target) {
  const int m = static_cast<int>(c.W.cols());
  const double bias = std::clamp(c.bias, c.lo, c.hi);
  double best = std::numeric_limits<double>::infinity();
  int sets = 1;
  for (int j = 0; j < m; ++j) sets *= 3;
  for (int set = 0; set < sets; ++set) {
    Eigen::VectorXd p = Eigen::VectorXd::Constant(m, bias);
    std::vector<int> free;
    for (int j = 0, digits = set; j < m; ++j, digits /= 3) {
      if (digits % 3 == 0) free.push_back(j);
      if (digits % 3 == 1) p[j] = c.lo;
      if (digits % 3 == 2) p[j] = c.hi;
    }
    const Eigen::Vector2d rest = target - c.W * p;
    if (free.empty()) {
      if (rest.norm() > 1e-10) continue;
    } else {
      Eigen::MatrixXd W(2, free.size());
      for (std::size_t i = 0; i < free.size(); ++i) W.col(static_cast<int>(i)) = c.W.col(free[i]);
      const Eigen::VectorXd step = test::pseudo_inverse(W) * rest;
      if ((W * step - rest).norm() > 1e-10) continue;
      for (std::size_t i = 0; i < free.size(); ++i) p[free[i]] += step[static_cast<int>(i)];
    }
    if (p.minCoeff() < c.lo - 1e-10 || p.maxCoeff() > c.hi + 1e-10) continue;
    best = std::min(best, (p.array() - bias).matrix().norm());
  }
  return best;
}

void check(const Case& c, bool brute = true) {
  const ChamberMap<2> map = c.map();
  ChamberMap<2>::Pressures pressures{};
  const double scale = map.allocate({c.torque[0], c.torque[1]}, pressures);
  const int m = map.size();
  const Eigen::VectorXd p = Eigen::Map<const Eigen::VectorXd>(pressures.data(), m);
  const double reach = c.W.colwise().norm().sum() * std::max(std::abs(c.lo), std::abs(c.hi));

  EXPECT_GE(p.minCoeff(), c.lo);
  EXPECT_LE(p.maxCoeff(), c.hi);
  const Eigen::Vector2d target = scale * c.torque;
  EXPECT_LT((c.W * p - target).norm(), 1e-12 * (reach + 1.0)) << p.transpose();
  if (!brute) return;
  EXPECT_NEAR(scale, brute_scale(c), 1e-9);
  const double bias = std::clamp(c.bias, c.lo, c.hi);
  EXPECT_NEAR((p.array() - bias).matrix().norm(), brute_distance(c, target), 1e-8 * (1.0 + c.hi))
      << "m " << m << " scale " << scale << " p " << p.transpose();
}

// The optimality conditions themselves: p = clamp(bias + W' lambda) for one lambda.
void check_kkt(const Case& c) {
  const ChamberMap<2> map = c.map();
  ChamberMap<2>::Pressures pressures{};
  map.allocate({c.torque[0], c.torque[1]}, pressures);
  const double bias = std::clamp(c.bias, c.lo, c.hi);
  std::vector<int> free;
  for (int j = 0; j < map.size(); ++j) {
    if (pressures[j] > c.lo + 1e-9 && pressures[j] < c.hi - 1e-9) free.push_back(j);
  }
  Eigen::MatrixX2d rows(free.size(), 2);
  Eigen::VectorXd values(free.size());
  for (std::size_t i = 0; i < free.size(); ++i) {
    rows.row(static_cast<int>(i)) = c.W.col(free[i]).transpose();
    values[static_cast<int>(i)] = pressures[free[i]] - bias;
  }
  // Otherwise lambda is not unique; brute force covers it.
  if (free.size() < 2 || test::singular_values(rows)[1] < 1e-12 * rows.norm()) return;
  const Eigen::Vector2d lambda = test::pseudo_inverse(rows) * values;
  for (int j = 0; j < map.size(); ++j) {
    const double wanted = std::clamp(bias + c.W.col(j).dot(lambda), c.lo, c.hi);
    EXPECT_NEAR(pressures[j], wanted, 1e-9 * (1.0 + lambda.norm() * c.W.col(j).norm()));
  }
}

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double uniform(double a, double b) { return std::uniform_real_distribution<>(a, b)(engine_); }
  int integer(int a, int b) { return std::uniform_int_distribution<>(a, b)(engine_); }

  /// Angles with no gap of pi between neighbours, in any order.
  Case chambers(int m) {
    Case c;
    std::vector<double> angles(static_cast<std::size_t>(m)), gains(angles.size());
    do {
      for (double& a : angles) a = uniform(-pi, pi);
      for (double& g : gains) g = std::exp(uniform(-1.5, 1.0));
      c.W = columns_of(angles, gains);
      c.lo = integer(0, 2) == 0 ? uniform(-0.5, 0.0) : 0.0;
      c.hi = c.lo + uniform(0.5, 3.0);
      c.bias = uniform(-0.5, 3.5);
      const double toward = uniform(-pi, pi);
      c.torque =
          std::pow(10.0, uniform(-3.0, 1.0)) * Eigen::Vector2d(std::cos(toward), std::sin(toward));
    } while (c.map().weakest_torque_nm() < 1e-3);
    return c;
  }

 private:
  std::mt19937 engine_;
};

TEST(ChamberMap, RandomChambersAgainstEveryActiveSet) {
  Random random(1);
  for (int m = 3; m <= 6; ++m) {
    for (int trial = 0; trial < 150; ++trial) check(random.chambers(m));
  }
  for (int trial = 0; trial < 6; ++trial) check(random.chambers(7));
  for (int trial = 0; trial < 3; ++trial) check(random.chambers(8));
}

TEST(ChamberMap, RandomChambersMeetTheOptimalityConditions) {
  Random random(2);
  for (int m = 3; m <= 8; ++m) {
    for (int trial = 0; trial < 3000; ++trial) {
      const Case c = random.chambers(m);
      check(c, false);
      check_kkt(c);
    }
  }
}

TEST(ChamberMap, ScaleIsTheLargest) {
  // A little more than s tau cannot be reached: some direction separates it from the box's image.
  Random random(3);
  for (int trial = 0; trial < 3000; ++trial) {
    Case c = random.chambers(random.integer(3, 8));
    c.torque *= 100.0;
    const double scale = c.map().largest_scale({c.torque[0], c.torque[1]});
    if (scale == 1.0) continue;
    const Eigen::Vector2d beyond = scale * (1.0 + 1e-9) * c.torque;
    double gap = -1.0;
    for (int j = 0; j < c.W.cols(); ++j) {
      for (double side : {-1.0, 1.0}) {
        const Eigen::Vector2d n = side * Eigen::Vector2d(c.W(1, j), -c.W(0, j)).normalized();
        double support = 0.0;
        for (int i = 0; i < c.W.cols(); ++i) {
          support += std::max(n.dot(c.W.col(i)) * c.lo, n.dot(c.W.col(i)) * c.hi);
        }
        gap = std::max(gap, n.dot(beyond) - support);
      }
    }
    EXPECT_GT(gap, 0.0);
  }
}

TEST(ChamberMap, FourChambersAtRightAngles) {
  // The paper's segment, by hand: opposite chambers share nothing at zero bias, everything around a
  // bias.
  const std::vector<double> angles{0.0, 0.5 * pi, pi, 1.5 * pi}, gains(4, 0.839);
  Case c{columns_of(angles, gains), 0.0, 2.0, 0.0, {0.2, -0.3}};
  ChamberMap<2>::Pressures p{};
  EXPECT_EQ(c.map().allocate({0.2, -0.3}, p), 1.0);
  EXPECT_NEAR(p[0], 0.3 / 0.839, 1e-14);  // tau_y = -g p_0
  EXPECT_NEAR(p[1], 0.2 / 0.839, 1e-14);  // tau_x = +g p_1
  EXPECT_NEAR(p[2], 0.0, 1e-14);
  EXPECT_NEAR(p[3], 0.0, 1e-14);
  c.bias = 1.0;
  EXPECT_EQ(c.map().allocate({0.2, -0.3}, p), 1.0);
  EXPECT_NEAR(p[0], 1.0 + 0.15 / 0.839, 1e-14);
  EXPECT_NEAR(p[2], 1.0 - 0.15 / 0.839, 1e-14);
  EXPECT_NEAR(c.map().allocate({0.0, -3.356}, p), 0.5, 1e-14);
  EXPECT_NEAR(p[0], 2.0, 1e-14);
  EXPECT_NEAR(p[2], 0.0, 1e-14);
}

TEST(ChamberMap, DegenerateAngles) {
  const std::vector<std::vector<double>> sets{
      {0.0, 0.5 * pi, pi, 1.5 * pi},               // opposite pairs
      {0.0, 0.0, 2.0 * pi / 3.0, 4.0 * pi / 3.0},  // two in the same place
      {0.0, 0.0, 0.0, 0.5 * pi, 0.5 * pi, pi, -0.5 * pi},
      {0.1, 0.1 + 1e-7, 2.0, 4.0},  // nearly parallel
      {0.1, 0.1 + 1e-13, 2.0, 4.0},
      {0.0, pi / 3.0, 2.0 * pi / 3.0, pi, 4.0 * pi / 3.0, 5.0 * pi / 3.0}};
  for (const auto& angles : sets) {
    for (double bias : {0.0, 0.4, 1.0, 2.0}) {
      const Eigen::Matrix2Xd W = columns_of(angles, std::vector<double>(angles.size(), 0.839));
      // Along every column, every facet, every facet's corner, from nothing to far outside.
      std::vector<Eigen::Vector2d> directions;
      for (int j = 0; j < W.cols(); ++j) {
        const Eigen::Vector2d w = W.col(j);
        for (const Eigen::Vector2d& d : {w, Eigen::Vector2d(w[1], -w[0])}) {
          directions.push_back(d);
          directions.push_back(-d);
        }
      }
      for (int j = 0; j < W.cols(); ++j) {
        Eigen::Vector2d corner = Eigen::Vector2d::Zero();
        const Eigen::Vector2d n(W(1, j), -W(0, j));
        for (int i = 0; i < W.cols(); ++i) {
          if (n.dot(W.col(i)) >= 0.0) corner += 2.0 * W.col(i);
        }
        directions.push_back(corner);
      }
      for (const Eigen::Vector2d& d : directions) {
        const bool small = W.cols() <= 6;
        for (double length : {0.0, 1e-300, 1e-12, 0.3, 1.0, 1.0 - 1e-15, 1.0 + 1e-15, 2.0, 1e6}) {
          check(Case{W, 0.0, 2.0, bias, length * d}, small && length <= 2.0);
        }
      }
    }
  }
}

TEST(ChamberMap, OnTheEdgeOfWhatIsReachable) {
  // Just inside and outside of the boundary, where the set of free unknowns is about to lose its
  // rank.
  Random random(4);
  for (int trial = 0; trial < 2000; ++trial) {
    Case c = random.chambers(random.integer(3, 5));
    const double scale = c.map().largest_scale({1e3 * c.torque[0], 1e3 * c.torque[1]});
    for (double inside : {-1e-6, -1e-10, -1e-13, -1e-16, 0.0, 1e-16, 1e-13}) {
      Case edge = c;
      edge.torque = 1e3 * scale * (1.0 + inside) * c.torque;
      check(edge, trial < 100);
    }
  }
}

TEST(ChamberMap, ABoxWithoutSizeGivesWhatItHas) {
  const Eigen::Matrix2Xd W = columns_of({0.0, 2.0, 4.0}, {1.0, 1.0, 1.0});
  Case c{W, 0.0, 0.0, 0.0, {0.1, 0.2}};
  ChamberMap<2>::Pressures p{};
  EXPECT_EQ(c.map().allocate({0.1, 0.2}, p), 0.0);
  EXPECT_EQ(p[0], 0.0);
  EXPECT_EQ(c.map().allocate({0.0, 0.0}, p), 1.0);
  EXPECT_EQ(p[2], 0.0);
}

TEST(ChamberMap, TorquesThatAreNotNumbersAskForNothing) {
  const Eigen::Matrix2Xd W = columns_of({0.0, 2.0, 4.0}, {1.0, 1.0, 1.0});
  const Case c{W, 0.0, 2.0, 0.0, {0.0, 0.0}};
  ChamberMap<2>::Pressures p{};
  for (double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    p.fill(7.0);
    EXPECT_EQ(c.map().allocate({0.1, bad}, p), 0.0);
    EXPECT_NEAR(p[0] + p[1] + p[2], 0.0, 1e-12);
  }
  p.fill(7.0);
  EXPECT_LT(c.map().allocate({1e308, 1e308}, p), 1e-300);
  EXPECT_LE(p[0] + p[1] + p[2], 6.0);
}

TEST(ChamberMap, OneDimension) {
  Random random(5);
  for (int trial = 0; trial < 3000; ++trial) {
    const int m = random.integer(2, 8);
    std::vector<std::array<double, 1>> levers(static_cast<std::size_t>(m));
    for (auto& lever : levers) lever[0] = random.uniform(-1.0, 1.0);
    levers[0][0] = -0.3;
    levers[1][0] = 0.5;
    const double hi = random.uniform(0.5, 2.0), bias = random.uniform(0.0, hi);
    const ChamberMap<1> map(levers, 0.0, hi, bias);
    double low = 0.0, high = 0.0;
    for (const auto& lever : levers) (lever[0] > 0.0 ? high : low) += lever[0] * hi;
    const double torque = random.uniform(-3.0, 3.0);
    ChamberMap<1>::Pressures p{};
    const double scale = map.allocate({torque}, p);
    EXPECT_NEAR(scale, std::min(1.0, (torque > 0.0 ? high : low) / torque), 1e-12);
    EXPECT_NEAR(map.torque(p.data())[0], scale * torque, 1e-12);
    // Optimality: bisection on the multiplier, sum a clamp(b + a lambda) rises with it.
    double below = -1e6, above = 1e6;
    for (int i = 0; i < 200; ++i) {
      const double lambda = 0.5 * (below + above);
      double sum = 0.0;
      for (const auto& a : levers) sum += a[0] * std::clamp(bias + a[0] * lambda, 0.0, hi);
      (sum < scale * torque ? below : above) = lambda;
    }
    if (scale == 1.0) {
      for (int j = 0; j < m; ++j) {
        const double a = levers[static_cast<std::size_t>(j)][0];
        EXPECT_NEAR(p[j], std::clamp(bias + 0.5 * (below + above) * a, 0.0, hi), 1e-6);
      }
    }
  }
}

TEST(BoxProjection, FewStepsAlways) {
  Random random(6);
  int most = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    Case c = random.chambers(8);
    const double scale = c.map().largest_scale({c.torque[0], c.torque[1]});
    std::array<std::array<double, 2>, 8> columns;
    for (int j = 0; j < 8; ++j) columns[j] = {c.W(0, j), c.W(1, j)};
    BoxProjection<2, 8> projection(8, columns.data(), c.lo, c.hi, std::clamp(c.bias, c.lo, c.hi));
    BoxProjection<2, 8>::Unknowns p{};
    const double inside = scale * random.uniform(0.0, 1.0 - 1e-6);
    ASSERT_TRUE(projection.solve({inside * c.torque[0], inside * c.torque[1]}, p));
    most = std::max(most, projection.steps());
  }
  RecordProperty("most_steps", most);
  EXPECT_LE(most, 32);  // the cap is 256
}

}  // namespace
}  // namespace softarm
