// Pressure allocation and ramps at work without a single allocation of memory.
#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "counted_malloc.hpp"
#include "softarm/actuation/pressure_ramps.hpp"

namespace softarm {
namespace {

TEST(Actuation, AllocatesNothingAfterConstruction) {
  constexpr int kSegments = 64;
  ActuationSettings settings;
  for (int i = 0; i < kSegments; ++i) {
    std::vector<Chamber> chambers;
    const int m = 3 + i % 6;
    for (int j = 0; j < m; ++j) chambers.push_back({2.0 * std::numbers::pi * j / m, 0.839});
    settings.segments.push_back(chambers);
  }
  const PressureAllocator allocator(settings);
  const PressureRamps ramps(settings);
  Eigen::VectorXd tau(2 * kSegments), back(2 * kSegments);
  Allocation out;
  PressureVector pressures = PressureVector::Zero(allocator.chambers());
  std::mt19937 engine(1);
  std::uniform_real_distribution<> torque(-3.0, 3.0);
  int saturated = 0;

  const long before = test::allocations;
  for (int k = 0; k < 10000; ++k) {
    for (double& t : tau) t = torque(engine);
    allocator.allocate(tau, out);
    ramps.limit(pressures, out.pressures_bar, 0.002, pressures);
    if (k % 10 == 0) ramps.vent(pressures, 0.002, pressures);
    allocator.generalized_force(pressures, back);
    saturated += out.saturated;
  }
  EXPECT_EQ(test::allocations - before, 0);
  EXPECT_GT(saturated, 0);
}

TEST(Actuation, TheCountSeesAnAllocation) {
  if (SOFTARM_COUNTS_MALLOC == 0) GTEST_SKIP() << "a sanitizer owns malloc";
  const long before = test::allocations;
  // Called by name: a new-expression could be optimised away.
  ::operator delete(::operator new(1000));
  EXPECT_EQ(test::allocations - before, 1);
  const Eigen::MatrixXd matrix = Eigen::MatrixXd::Random(40, 40);
  EXPECT_EQ(test::allocations - before, 2) << matrix(0, 0);
}

}  // namespace
}  // namespace softarm
