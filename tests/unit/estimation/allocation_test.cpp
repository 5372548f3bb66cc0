// The whole module at work without a single allocation.
#include <gtest/gtest.h>

#include "counted_malloc.hpp"
#include "frames.hpp"
#include "softarm/estimation/clock_relation.hpp"
#include "softarm/estimation/curvature_filter.hpp"
#include "softarm/estimation/frame_validator.hpp"

namespace softarm {
namespace {

TEST(Estimation, AllocatesNothingAfterConstruction) {
  const int n = 40;
  const ArmParameters arm = test::arm_of(n);
  const EstimationSettings settings;
  FrameValidator validator(settings, arm, test::fixed_base_noise(settings, n));
  CurvatureFilter filter(settings, n);
  ClockRelation clock(ClockMode::sender, 5e-3);
  KnownMotion known;
  known.u_rad = known.velocity_radps = known.acceleration_radps2 = SegmentVector::Zero(2 * n);
  FilteredMotion motion;
  MocapFrame frame = test::frame_of(arm, Eigen::VectorXd::Constant(2 * n, 0.2));

  const long before = test::allocations;
  for (int k = 0; k < 1000; ++k) {
    frame.frame_number = k;
    frame.capture_ns = clock.capture_ns(5'000'000LL * k, 5000LL * k);
    frame.body[3].valid = k % 7 != 0;
    if (validator.accept(frame) != FrameVerdict::accepted) continue;
    known.source = static_cast<std::uint32_t>(k / 100);
    const bool expects = k % 50 < 25;
    filter.update(frame.capture_ns, validator.estimate(), expects ? &known : nullptr);
    filter.predict(frame.capture_ns + 7'000'000, motion, expects ? &known : nullptr);
  }
  EXPECT_EQ(test::allocations - before, 0);
  EXPECT_EQ(validator.counters().accepted, 1000);
}

TEST(Estimation, TheCountSeesAnAllocation) {
  if (SOFTARM_COUNTS_MALLOC == 0) GTEST_SKIP() << "a sanitizer owns malloc";
  const long before = test::allocations;
  // Called by name: a new-expression could be optimised away.
  ::operator delete(::operator new(1000));
  EXPECT_EQ(test::allocations - before, 1);
}

}  // namespace
}  // namespace softarm
