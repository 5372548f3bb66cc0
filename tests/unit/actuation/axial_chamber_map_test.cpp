#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "softarm/actuation/pressure_allocator.hpp"

namespace softarm {
namespace {

using std::numbers::pi;

constexpr double kGain = 0.839, kOffset = 0.0125, kArea = kGain / kOffset;

/// Chambers at even angles; with `spread` > 0 angles, gains and areas differ.
struct Segment {
  std::vector<std::array<double, 2>> columns;
  std::vector<double> areas;
  AxialChamberMap map;

  Segment(int chambers, double bias_bar, double spread = 0.0) {
    std::mt19937 engine(static_cast<unsigned>(chambers));
    std::uniform_real_distribution<> random(-spread, spread);
    for (int j = 0; j < chambers; ++j) {
      const double chi = 2.0 * pi * j / chambers + random(engine);
      const double gain = kGain * (1.0 + random(engine));
      columns.push_back({gain * std::sin(chi), -gain * std::cos(chi)});
      areas.push_back(kArea * (1.0 + random(engine)));
    }
    map = AxialChamberMap(columns, areas, 0.0, 2.0, bias_bar);
  }
  int size() const { return static_cast<int>(areas.size()); }
  Eigen::Matrix3Xd matrix() const {
    Eigen::Matrix3Xd W(3, size());
    for (int j = 0; j < size(); ++j) {
      const auto k = static_cast<std::size_t>(j);
      W.col(j) << columns[k][0], columns[k][1], areas[k];
    }
    return W;
  }
  Eigen::VectorXd allocate(const Eigen::Vector3d& tau, double* scale = nullptr) const {
    AxialChamberMap::Pressures p{};
    const double s = map.allocate({tau.x(), tau.y()}, tau.z(), p);
    if (scale != nullptr) *scale = s;
    return Eigen::Map<const Eigen::VectorXd>(p.data(), size());
  }
};

TEST(AxialChamberMap, PressuresWithinLimitsGiveTorqueAndAxialForceBack) {
  std::mt19937 engine(1);
  std::uniform_real_distribution<> bar(0.02, 1.98);
  for (const int chambers : {3, 4, 5, 8}) {
    const Segment segment(chambers, 0.3, 0.2);
    for (int k = 0; k < 500; ++k) {
      Eigen::VectorXd p(chambers);
      for (double& each : p) each = bar(engine);
      const Eigen::Vector3d tau = segment.matrix() * p;
      double scale = 0.0;
      const Eigen::VectorXd found = segment.allocate(tau, &scale);
      EXPECT_EQ(scale, 1.0);
      EXPECT_GE(found.minCoeff(), 0.0);
      EXPECT_LE(found.maxCoeff(), 2.0);
      EXPECT_LT((segment.matrix() * found - tau)
                    .cwiseAbs()
                    .cwiseQuotient(Eigen::Vector3d(kGain, kGain, kArea))
                    .maxCoeff(),
                1e-12);
      // Nearest to the bias: no pressures with the same forces are nearer.
      EXPECT_LE((found.array() - 0.3).matrix().norm(), (p.array() - 0.3).matrix().norm() + 1e-12);
    }
  }
}

// Section of the reachable set at a torque, from the forces of three and of four even chambers.
TEST(AxialChamberMap, AxialRangeOfEvenChambersIsTheClosedForm) {
  std::mt19937 engine(2);
  std::uniform_real_distribution<> part(-1.0, 1.0);
  const Segment four(4, 0.0), three(3, 0.0);
  constexpr double kMost = 2.0;
  for (int k = 0; k < 1000; ++k) {
    const double X = kMost * part(engine), Y = kMost * part(engine);  // over g, along the chambers
    const auto range = four.map.axial_range({kGain * Y, -kGain * X});
    const double sum = std::abs(X) + std::abs(Y);
    EXPECT_NEAR(range.low_n, kArea * sum, 1e-10 * kArea);
    EXPECT_NEAR(range.high_n, kArea * (4.0 * kMost - sum), 1e-10 * kArea);

    // Three: p_j = N / 3a + 2/3 (X, Y) . (cos, sin) chi_j, each within [0, P].
    double low = 0.0, high = 3.0 * kMost;
    for (int j = 0; j < 3; ++j) {
      const double chi = 2.0 * pi * j / 3.0;
      const double bend = 2.0 * (X * std::cos(chi) + Y * std::sin(chi));
      low = std::max(low, -bend);
      high = std::min(high, 3.0 * kMost - bend);
    }
    const auto of_three = three.map.axial_range({kGain * Y, -kGain * X});
    EXPECT_NEAR(of_three.low_n, kArea * low, 1e-10 * kArea);
    EXPECT_NEAR(of_three.high_n, kArea * high, 1e-10 * kArea);
  }
}

TEST(AxialChamberMap, BendingComesFirst) {
  const Segment segment(4, 0.2);
  // Less axial force than the torque needs, and more than it leaves: the torque is met exactly.
  for (const double axial : {-1e3, 0.0, 20.0, 1e5}) {
    double scale = 0.0;
    const Eigen::Vector3d tau(0.6 * kGain, -0.3 * kGain, axial);
    const Eigen::Vector3d got = segment.matrix() * segment.allocate(tau, &scale);
    EXPECT_EQ(scale, 1.0);
    EXPECT_NEAR(got.x(), tau.x(), 1e-12);
    EXPECT_NEAR(got.y(), tau.y(), 1e-12);
    EXPECT_NEAR(got.z(), std::clamp(axial, 0.9 * kArea, 7.1 * kArea), 1e-6);
  }
  // More torque than there is: along its direction, as without an axial force.
  double scale = 0.0;
  const Eigen::Vector3d much(3.0 * kGain, -1.0 * kGain, 0.0);
  const Eigen::Vector3d got = segment.matrix() * segment.allocate(much, &scale);
  EXPECT_NEAR(scale, 2.0 / 3.0, 1e-12);
  EXPECT_NEAR(got.x(), 2.0 * kGain, 1e-8);
  EXPECT_NEAR(got.y(), -2.0 / 3.0 * kGain, 1e-8);
  EXPECT_GE(got.z(), 0.0);
}

TEST(AxialChamberMap, PressuresAreContinuous) {
  for (const int chambers : {3, 4, 6}) {
    const Segment segment(chambers, 0.2, chambers == 6 ? 0.2 : 0.0);
    std::mt19937 engine(3);
    std::normal_distribution<> random;
    double steepest = 0.0;
    for (int path = 0; path < 20; ++path) {
      const Eigen::Vector3d far(2.5 * kGain, 2.5 * kGain, 6.0 * kArea);
      Eigen::Vector3d from, to;
      for (int i = 0; i < 3; ++i) {
        from[i] = far[i] * random(engine);
        to[i] = from[i] + 0.2 * far[i] * random(engine);
      }
      constexpr int kSteps = 2000;
      Eigen::VectorXd before = segment.allocate(from);
      for (int k = 1; k <= kSteps; ++k) {
        const Eigen::Vector3d step = (to - from) / kSteps;
        const Eigen::VectorXd now = segment.allocate(from + k * step);
        const double size = step.cwiseQuotient(Eigen::Vector3d(kGain, kGain, kArea)).norm();
        steepest = std::max(steepest, (now - before).norm() / size);
        before = now;
      }
    }
    // bar a bar; three neighbours of six chambers span some direction badly. A jump of 0.1 bar within
    // one of these steps would be a hundred or more.
    EXPECT_LT(steepest, 40.0) << chambers;
  }
}

TEST(AxialChamberMap, WithinReachIsSmoothAndInside) {
  const Segment segment(4, 0.2);
  const double w = segment.map.smoothing_n();
  double largest_bend = 0.0;
  constexpr double kStep = 1e-3;  // of the torque, relative to g
  const auto at = [&](double x, double wanted) {
    return segment.map.within_reach({0.1 * kGain, x * kGain}, wanted);
  };
  for (double x = -1.0; x < 1.0; x += kStep) {
    for (const double wanted : {0.0, 30.0, 200.0}) {
      const auto range = segment.map.axial_range({0.1 * kGain, x * kGain});
      const double n = at(x, wanted);
      EXPECT_GE(n, std::max(range.low_n, wanted) - 1e-9);
      EXPECT_LE(n, std::max(range.low_n, wanted) + w * std::log(6.0));
      largest_bend =
          std::max(largest_bend, std::abs(at(x + kStep, wanted) - 2.0 * n + at(x - kStep, wanted)) /
                                     (kStep * kStep));
    }
  }
  // d^2 N / dx^2 of a kink of 2 a spread over w is a^2 / w at most; at the kink itself it would be
  // 2 a / kStep, a hundred times that.
  EXPECT_LT(largest_bend, 1.01 * kArea * kArea / w);
  // What is well within reach is taken as it is.
  EXPECT_NEAR(at(0.2, 200.0), 200.0, 1e-9);
}

TEST(AxialChamberMap, WhatIsNotFiniteIsOutOfReach) {
  const Segment segment(4, 0.2);
  AxialChamberMap::Pressures p{};
  EXPECT_EQ(segment.map.allocate({NAN, 0.0}, 10.0, p), 0.0);
  EXPECT_EQ(segment.map.allocate({0.1, 0.0}, NAN, p), 1.0);
  for (int j = 0; j < 4; ++j) EXPECT_TRUE(std::isfinite(p[static_cast<std::size_t>(j)]));
}

TEST(PressureAllocator, ThreeRowsAndBack) {
  ActuationSettings settings;
  for (int i = 0; i < 3; ++i) {
    std::vector<Chamber> chambers;
    for (int j = 0; j < 4; ++j) chambers.push_back({0.5 * pi * j, kGain, kOffset});
    settings.segments.push_back(chambers);
  }
  settings.bias_pressure_bar = 0.3;
  const PressureAllocator allocator(settings, true);
  EXPECT_EQ(allocator.dimension(), 9);
  Eigen::VectorXd tau(9), back(9), force(9);
  tau << 0.1, -0.2, 60.0, 0.0, 0.3, 90.0, -0.2, 0.1, 120.0;
  Allocation out;
  allocator.allocate(tau, out);
  EXPECT_FALSE(out.saturated);
  allocator.torque(out.pressures_bar, back);
  EXPECT_LT((back - tau).lpNorm<Eigen::Infinity>(), 1e-9);
  allocator.generalized_force(out.pressures_bar, force);
  EXPECT_NEAR(force[3], 0.3, 1e-12);  // A_chamber tau_A
  EXPECT_NEAR(force[4], 0.0, 1e-12);
  EXPECT_NEAR(force[5], 90.0, 1e-9);
}

}  // namespace
}  // namespace softarm
