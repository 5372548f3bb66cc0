#include "softarm/actuation/pressure_allocator.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>

namespace softarm {
namespace {

using std::numbers::pi;

ActuationSettings paper_arm(int segments) {
  ActuationSettings settings;
  for (int i = 0; i < segments; ++i) {
    std::vector<Chamber> chambers;
    for (int j = 0; j < 4; ++j) chambers.push_back({0.5 * pi * j + 0.1 * i, 0.839 + 0.05 * j});
    settings.segments.push_back(chambers);
  }
  return settings;
}

std::string refusal(const ActuationSettings& settings) {
  try {
    PressureAllocator allocator(settings);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return {};
}

TEST(PressureAllocator, PressuresGiveTheTorqueBack) {
  const PressureAllocator allocator(paper_arm(64));
  EXPECT_EQ(allocator.segments(), 64);
  EXPECT_EQ(allocator.chambers(), 256);
  EXPECT_EQ(allocator.first_chamber(10), 40);
  EXPECT_EQ(allocator.chambers_of(63), 4);
  std::mt19937 engine(1);
  std::uniform_real_distribution<> torque(-0.8, 0.8);
  Eigen::VectorXd tau(128), back(128), force(128);
  for (double& t : tau) t = torque(engine);
  Allocation out;
  allocator.allocate(tau, out);
  EXPECT_FALSE(out.saturated);
  EXPECT_EQ(out.scale.minCoeff(), 1.0);
  allocator.torque(out.pressures_bar, back);
  EXPECT_LT((back - tau).lpNorm<Eigen::Infinity>(), 1e-14);
}

TEST(PressureAllocator, GeneralizedForceIsWhatTheChambersDo) {
  // f = sum -g p (cos chi, sin chi), straight from the chamber's definition.
  const ActuationSettings settings = paper_arm(3);
  const PressureAllocator allocator(settings);
  Eigen::VectorXd pressures(12), force(6);
  for (int j = 0; j < 12; ++j) pressures[j] = 0.1 * (j + 1);
  allocator.generalized_force(pressures, force);
  for (int i = 0; i < 3; ++i) {
    double x = 0.0, y = 0.0;
    for (int j = 0; j < 4; ++j) {
      const Chamber& c =
          settings.segments[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
      x -= c.gain_nm_per_bar * pressures[4 * i + j] * std::cos(c.angle_rad);
      y -= c.gain_nm_per_bar * pressures[4 * i + j] * std::sin(c.angle_rad);
    }
    EXPECT_NEAR(force[2 * i], x, 1e-15);
    EXPECT_NEAR(force[2 * i + 1], y, 1e-15);
  }
}

TEST(PressureAllocator, FlagsTheSegmentThatSaturates) {
  const PressureAllocator allocator(paper_arm(3));
  Eigen::VectorXd tau(6), back(6);
  tau << 0.1, 0.2, 30.0, -40.0, 0.0, 0.0;
  Allocation out;
  allocator.allocate(tau, out);
  EXPECT_TRUE(out.saturated);
  EXPECT_EQ(out.scale[0], 1.0);
  EXPECT_LT(out.scale[1], 0.1);
  EXPECT_EQ(out.scale[2], 1.0);
  allocator.torque(out.pressures_bar, back);
  // The direction is kept.
  EXPECT_NEAR(back[2] * -40.0 - back[3] * 30.0, 0.0, 1e-12);
  EXPECT_GT(back[2], 0.0);
}

TEST(PressureAllocator, PlanarArmWithTwoChambers) {
  ActuationSettings settings;
  settings.plane_rad = 0.7;
  settings.segments = {{{0.7, 0.5}, {0.7 + pi, 0.8}},
                       {{0.7, 0.5}, {0.7 + pi, 0.5}, {0.7 + 1.5, 1.0}}};
  const PressureAllocator allocator(settings);
  EXPECT_EQ(allocator.chambers(), 5);
  const Eigen::Vector2d in_plane(-std::sin(0.7), std::cos(0.7)), across(in_plane[1], -in_plane[0]);
  Eigen::VectorXd tau(4), back(4), force(4);
  tau << 0.3 * in_plane + 5.0 * across, -0.2 * in_plane;
  Allocation out;
  allocator.allocate(tau, out);
  EXPECT_FALSE(out.saturated);  // what is across the plane was dropped
  EXPECT_NEAR(out.pressures_bar[0], 0.0, 1e-15);
  EXPECT_NEAR(out.pressures_bar[1], 0.3 / 0.8, 1e-15);
  allocator.torque(out.pressures_bar, back);
  EXPECT_LT((back.head<2>() - 0.3 * in_plane).norm(), 1e-14);
  EXPECT_LT((back.tail<2>() + 0.2 * in_plane).norm(), 1e-14);
  // Bends in the plane at phi: the force in u is along (cos phi, sin phi).
  allocator.generalized_force(out.pressures_bar, force);
  EXPECT_NEAR(force[0] * std::sin(0.7) - force[1] * std::cos(0.7), 0.0, 1e-15);
  EXPECT_GT(force[0], 0.0);
}

TEST(PressureAllocator, MinimumPressureThatStillBalances) {
  ActuationSettings settings = paper_arm(1);
  settings.min_pressure_bar = 0.3;
  settings.bias_pressure_bar = 0.0;  // below the box: clamped into it
  const PressureAllocator allocator(settings);
  Allocation out;
  allocator.allocate(Eigen::Vector2d::Zero(), out);
  EXPECT_FALSE(out.saturated);
  EXPECT_GE(out.pressures_bar.minCoeff(), 0.3);
  Eigen::VectorXd back(2);
  allocator.torque(out.pressures_bar, back);
  EXPECT_LT(back.norm(), 1e-14);
}

TEST(PressureAllocator, RefusesWhatCannotSpan) {
  auto with = [](std::vector<Chamber> chambers) {
    ActuationSettings settings = paper_arm(1);
    settings.segments.push_back(std::move(chambers));
    return settings;
  };
  const auto says = [](const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
  };
  EXPECT_EQ(refusal(paper_arm(2)), "");
  EXPECT_TRUE(says(refusal(with({{0.0, 1.0}, {2.0, 1.0}})), "segment 2: expected 3 to 8 chambers"));
  EXPECT_TRUE(says(refusal(with(std::vector<Chamber>(9, {0.0, 1.0}))), "got 9"));
  EXPECT_TRUE(says(refusal(with({{0.0, 1.0}, {1.0, 1.0}, {2.0, 1.0}})), "one side"));
  EXPECT_TRUE(says(refusal(with({{0.0, 1.0}, {0.0, 1.0}, {pi, 1.0}, {pi, 1.0}})), "one side"));
  // Exactly half a plane, and a hair less than it needs.
  EXPECT_TRUE(says(refusal(with({{0.0, 1.0}, {1.0, 1.0}, {pi, 1.0}})), "one side"));
  EXPECT_EQ(refusal(with({{0.0, 1.0}, {pi - 0.01, 1.0}, {pi + 0.01, 1.0}})), "");
  EXPECT_TRUE(says(refusal(with({{0.0, 1.0}, {2.0, 0.0}, {4.0, 1.0}})), "positive gain"));
  EXPECT_TRUE(says(refusal(with({{0.0, 1.0}, {2.0, -1.0}, {4.0, 1.0}})), "positive gain"));
  EXPECT_TRUE(says(refusal(with({{0.0, 1.0}, {2.0, NAN}, {4.0, 1.0}})), "positive gain"));
  EXPECT_TRUE(says(refusal(with({{NAN, 1.0}, {2.0, 1.0}, {4.0, 1.0}})), "finite angle"));
}

TEST(PressureAllocator, RefusesLimitsWithoutZeroTorque) {
  ActuationSettings settings;
  settings.segments = {{{0.0, 2.0}, {2.1, 0.2}, {4.2, 0.2}}};
  EXPECT_EQ(refusal(settings), "");
  settings.min_pressure_bar = 0.5;  // 0.5 bar in the strong chamber outdoes 2 bar in the weak ones
  EXPECT_NE(refusal(settings).find("lower the minimum pressure"), std::string::npos);
  settings.min_pressure_bar = 3.0;
  EXPECT_NE(refusal(settings).find("min <= max"), std::string::npos);
  settings = paper_arm(1);
  settings.bias_pressure_bar = NAN;
  EXPECT_NE(refusal(settings), "");
  settings.segments.clear();
  EXPECT_NE(refusal(settings), "");
}

TEST(PressureAllocator, RefusesAPlaneItCannotBendIn) {
  ActuationSettings settings;
  settings.plane_rad = 0.0;
  settings.segments = {{{0.5 * pi, 1.0}, {1.5 * pi, 1.0}}};  // across the plane
  EXPECT_NE(refusal(settings).find("directions of the plane"), std::string::npos);
  settings.segments = {{{0.0, 1.0}, {0.1, 1.0}}};
  EXPECT_NE(refusal(settings), "");
}

}  // namespace
}  // namespace softarm
