// 1e5 random states of arms of 1 to 64 segments, both mass models, against the reference model in
// long double, and neighbours of very unequal size.
//
// The tolerance is the one that conditioning allows (against_reference.hpp): relative to the sizes
// of the masses' contributions, growing as 1 + theta^2 with the largest bending and by a tenth with
// each segment, times a constant a term. An error in relation to a term itself would have no bound:
// entries of B, C and G vanish where contributions cancel.
#include <gtest/gtest.h>

#include <cmath>

#include "against_reference.hpp"

namespace softarm {
namespace {

using testing_support::AgainstReference;
using testing_support::expect_within;
using testing_support::RandomArm;
using testing_support::State;

struct Batch {
  int segments, states;
};

/// 50 300 states of each kind of arm; both mass models make 1e5 and some, stretching arms as many.
constexpr Batch kBatches[] = {{1, 14000}, {2, 12000}, {3, 12000}, {4, 6000}, {5, 3000},
                              {6, 2000},  {8, 800},   {10, 300},  {16, 120}, {24, 40},
                              {32, 20},   {48, 12},   {64, 8}};

class RandomStates : public ::testing::TestWithParam<testing_support::ArmKind> {};

TEST_P(RandomStates, AgreeWithLongDouble) {
  int states = 0;
  for (const Batch& batch : kBatches) {
    RandomArm random(100 + static_cast<unsigned>(batch.segments));
    for (int k = 0; k < batch.states; ++k, ++states) {
      const int n = batch.segments;
      const double theta = n > 10 ? 3.2 : k % 2 == 0 ? 7.0 : 1.6;
      const ArmParameters arm = random.arm(n, GetParam(), k % 4 == 0 ? 100.0 : 3.0);
      expect_within(AgainstReference(arm, random.state(arm, theta, k % 8 == 0 ? 1e3 : 2.0)), n,
                    theta);
      if (HasFailure()) FAIL() << n << " segments, state " << k;
    }
  }
  EXPECT_GE(2 * states, 100000);
}

TEST(ThickArms, AgreeWithLongDouble) {
  RandomArm random(7);
  for (int k = 0; k < 4000; ++k) {
    const int n = 1 + k % 6;
    const double theta = k % 2 == 0 ? 7.0 : 1.6;
    const ArmParameters arm = random.thick(random.arm(n, {MassModel::distributed, k >= 2000}));
    expect_within(AgainstReference(arm, random.state(arm, theta)), n, theta);
    if (HasFailure()) FAIL() << n << " segments, state " << k;
  }
}

TEST_P(RandomStates, AgreeForRatiosOfAMillion) {
  RandomArm random(3);
  for (const int n : {2, 3, 5, 8, 16, 40, 64}) {
    for (int k = 0; k < (n < 10 ? 150 : 3); ++k) {
      const ArmParameters arm = random.arm(n, GetParam(), 1e6);
      const double theta = n > 10 ? 3.2 : 7.0;
      expect_within(AgainstReference(arm, random.state(arm, theta), false), n, theta);
      if (HasFailure()) FAIL() << n << " segments, state " << k;
    }
  }
}

TEST_P(RandomStates, AgreeWhereNeighboursDifferByAMillion) {
  // Light and short beside heavy and long, in both orders.
  RandomArm random(4);
  for (int k = 0; k < 300; ++k) {
    const int n = 2 + k % 5;
    ArmParameters arm = random.arm(n, GetParam());
    for (int i = k % 2; i < n; i += 2) {
      SegmentParameters& s = arm.segments[static_cast<std::size_t>(i)];
      if (k % 3 != 0) s.length_m *= 1e-6;
      if (k % 3 != 1) s.mass_kg *= 1e6;
      s.stiffness_nm_per_rad *= 1e-6;
    }
    expect_within(AgainstReference(arm, random.state(arm, 7.0), false), n, 7.0);
    if (HasFailure()) FAIL() << n << " segments, state " << k;
  }
}

INSTANTIATE_TEST_SUITE_P(ArmKinds, RandomStates, ::testing::ValuesIn(testing_support::kArmKinds),
                         [](const auto& kind) { return name(kind.param); });

}  // namespace
}  // namespace softarm
