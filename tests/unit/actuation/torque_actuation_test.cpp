// Actuation by torque: the same calls as with chambers, N m in place of bar.
#include <gtest/gtest.h>

#include <limits>

#include "softarm/actuation/pressure_allocator.hpp"
#include "softarm/actuation/pressure_ramps.hpp"

namespace softarm {
namespace {

ActuationSettings by_torque(int segments, double max_torque_nm) {
  ActuationSettings settings;
  set_torque_actuation(settings, segments, max_torque_nm);
  return settings;
}

TEST(TorqueActuation, PassesTorquesThroughWithBothSigns) {
  const PressureAllocator allocator(by_torque(2, 5.0));
  EXPECT_EQ(allocator.chambers(), 4);
  EXPECT_EQ(allocator.first_chamber(1), 2);
  EXPECT_EQ(allocator.chambers_of(1), 2);
  const Eigen::Vector4d tau(1.0, -2.0, 5.0, -5.0);
  Allocation allocation;
  allocator.allocate(tau, allocation);
  EXPECT_EQ(allocation.pressures_bar, tau);
  EXPECT_FALSE(allocation.saturated);
  Eigen::VectorXd back(4), force(4);
  allocator.torque(allocation.pressures_bar, back);
  EXPECT_EQ(back, tau);
  allocator.generalized_force(allocation.pressures_bar, force);  // A_chamber tau_A
  EXPECT_EQ(force, Eigen::Vector4d(-2.0, -1.0, -5.0, -5.0));
}

TEST(TorqueActuation, ShortensWhatIsOutOfReachAndDropsWhatIsNoNumber) {
  const PressureAllocator allocator(by_torque(2, 5.0));
  Allocation allocation;
  allocator.allocate(Eigen::Vector4d(-10.0, 4.0, std::numeric_limits<double>::quiet_NaN(), 1.0),
                     allocation);
  EXPECT_TRUE(allocation.saturated);
  EXPECT_EQ(allocation.scale[0], 0.5);
  EXPECT_EQ(allocation.scale[1], 0.0);
  EXPECT_EQ(allocation.pressures_bar, Eigen::Vector4d(-5.0, 2.0, 0.0, 0.0));
}

TEST(TorqueActuation, VentsToZeroFromBothSides) {
  ActuationSettings settings = by_torque(1, 5.0);
  settings.vent_bar_per_s = 10.0;
  const PressureRamps ramps(settings);
  PressureVector torque = Eigen::Vector2d(-1.5, 0.4);
  ramps.vent(torque, 0.1, torque);
  EXPECT_EQ(torque, Eigen::Vector2d(-0.5, 0.0));
  ramps.vent(torque, 0.1, torque);
  EXPECT_EQ(torque, Eigen::Vector2d(0.0, 0.0));
}

TEST(TorqueActuation, RefusesOneSidedLimits) {
  ActuationSettings settings = by_torque(1, 5.0);
  settings.min_pressure_bar = 0.0;
  EXPECT_THROW(PressureAllocator{settings}, std::invalid_argument);
}

}  // namespace
}  // namespace softarm
