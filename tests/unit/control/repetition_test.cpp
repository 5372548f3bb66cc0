// What repeats with the reference is learnt and known ahead; what does not is bounded.
#include "softarm/control/repetition.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "counted_malloc.hpp"
#include "unit/control/arms.hpp"

namespace softarm {
namespace {

constexpr double kPeriod_s = 3.0, kStep_s = 0.002, kLead_s = 0.1;

/// Of two harmonics, in the size of a segment's hysteresis (N m).
double repeating_nm(double t_s, double phase = 0.0) {
  const double angle = 2.0 * std::numbers::pi * t_s / kPeriod_s + phase;
  return 0.03 * std::sin(angle) + 0.01 * std::cos(3.0 * angle);
}

/// A disturbance of all components, through `compensation`.
class Seen {
 public:
  explicit Seen(const ArmParameters& arm = test::paper_arm(3), double lead_s = kLead_s)
      : compensation(arm, lead_s, kStep_s), segments_(arm.size()) {
    compensation.start(kPeriod_s);
  }
  /// @return component 0 of what is added
  double tick(double disturbance_nm, bool learn = true) {
    found.disturbance_nm.setConstant(2 * segments_, disturbance_nm);
    compensation.advance(t_s, learn, found);
    t_s += kStep_s;
    return found.disturbance_nm[0] - disturbance_nm;
  }
  /// RMS of the true disturbance minus what is known of it, over a period; it is seen kLead_s late.
  double rms_nm() {
    double squares = 0.0;
    int count = 0;
    for (const double end_s = t_s + kPeriod_s; t_s < end_s; ++count) {
      const double truth_nm = repeating_nm(t_s);
      tick(repeating_nm(t_s - kLead_s));
      squares += std::pow(found.disturbance_nm[0] - truth_nm, 2);
    }
    return std::sqrt(squares / count);
  }
  void periods(int count, const std::function<double(double)>& disturbance_nm, bool learn = true) {
    for (const double end_s = t_s + count * kPeriod_s; t_s < end_s;)
      tick(disturbance_nm(t_s), learn);
  }

  RepetitiveCompensation compensation;
  ModelCorrection found;
  double t_s = 0.0;

 private:
  int segments_;
};

TEST(Repetition, WhatRepeatsIsKnownBeforeItIsSeen) {
  Seen seen;
  const double before_nm = seen.rms_nm();
  for (int k = 0; k < 20; ++k) seen.rms_nm();
  EXPECT_LT(seen.rms_nm(), 0.05 * before_nm);
  // And nearly at once: 0.7 of the error is left after every period.
  Seen again;
  for (int k = 0; k < 5; ++k) again.rms_nm();
  EXPECT_LT(again.rms_nm(), 0.5 * before_nm);
}

TEST(Repetition, EveryComponentHasItsOwn) {
  Seen seen;
  const auto phase = [](Eigen::Index j) { return 0.7 * static_cast<double>(j); };
  const auto at = [&](double t_s) {
    SegmentVector d(6);
    for (Eigen::Index j = 0; j < 6; ++j) d[j] = repeating_nm(t_s, phase(j));
    return d;
  };
  double error_nm = 0.0, late_nm = 0.0;
  for (; seen.t_s < 25.0 * kPeriod_s; seen.t_s += kStep_s) {
    seen.found.disturbance_nm = at(seen.t_s - kLead_s);
    seen.compensation.advance(seen.t_s, true, seen.found);
    if (seen.t_s < 24.0 * kPeriod_s) continue;
    const SegmentVector truth = at(seen.t_s);
    error_nm = std::max(error_nm, (seen.found.disturbance_nm - truth).cwiseAbs().maxCoeff());
    late_nm = std::max(late_nm, (at(seen.t_s - kLead_s) - truth).cwiseAbs().maxCoeff());
  }
  EXPECT_LT(error_nm, 0.1 * late_nm);
}

TEST(Repetition, WhatDoesNotRepeatLeavesLittle) {
  Seen seen;
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0.0, 0.02);
  double squares = 0.0;
  int count = 0;
  double slow_nm = 0.0;  // correlated over 0.1 s, as what the observer finds
  for (; seen.t_s < 40.0 * kPeriod_s; ++count) {
    slow_nm += kStep_s / 0.1 * (10.0 * noise(random) - slow_nm);
    const double added_nm = seen.tick(slow_nm);
    EXPECT_LE(std::abs(added_nm), 0.1 * 0.626);
    squares += added_nm * added_nm;
  }
  // As large as what it is made of, and gone with it.
  EXPECT_LT(std::sqrt(squares / count), 0.015);
  seen.periods(40, [](double) { return 0.0; });
  EXPECT_LT(std::abs(seen.tick(0.0)), 1e-6);
}

/// Nor where learning has just come to: a large offset makes no step.
TEST(Repetition, AConstantLeavesNothing) {
  Seen seen;
  while (seen.t_s < 5.0 * kPeriod_s) EXPECT_EQ(seen.tick(0.25), 0.0);
}

TEST(Repetition, IsAtMostATenthOfTheTorqueScale) {
  Seen seen;
  double largest_nm = 0.0;
  for (const double end_s = 20.0 * kPeriod_s; seen.t_s < end_s;)
    largest_nm = std::max(largest_nm, std::abs(seen.tick(1000.0 * repeating_nm(seen.t_s))));
  EXPECT_NEAR(largest_nm, RepetitiveCompensation::kLargest * 0.626, 1e-12);
}

TEST(Repetition, StartForgets) {
  Seen seen;
  seen.periods(10, [](double t_s) { return repeating_nm(t_s); });
  EXPECT_NE(seen.tick(0.0), 0.0);
  seen.compensation.start(kPeriod_s);
  seen.t_s = 0.0;
  // The first period is that of joining.
  while (seen.t_s < kPeriod_s - kStep_s) EXPECT_EQ(seen.tick(repeating_nm(seen.t_s)), 0.0);
  seen.compensation.start(0.0);
  seen.t_s = 0.0;
  while (seen.t_s < 5.0 * kPeriod_s) EXPECT_EQ(seen.tick(repeating_nm(seen.t_s)), 0.0);
}

TEST(Repetition, NothingIsLearntOfWhatDoesNotCount) {
  Seen seen;
  seen.periods(
      10, [](double t_s) { return repeating_nm(t_s); }, false);
  EXPECT_EQ(seen.tick(0.0, false), 0.0);
  // Nor of the time across it: one tick in each lead is enough.
  for (int k = 0; seen.t_s < 20.0 * kPeriod_s; ++k)
    EXPECT_EQ(seen.tick(repeating_nm(seen.t_s), k % 50 != 0), 0.0);
}

/// Largest w after 150 periods of a harmonic of `size_nm` at which w is twice the table, the most it
/// can be. The moments are off by a part of themselves: with w commanded, that part of w is found.
double largest_added_nm(double size_nm, double off) {
  Seen seen(test::paper_arm(3), 0.25 * kPeriod_s);
  double added_nm = 0.0, largest_nm = 0.0;
  while (seen.t_s < 150.0 * kPeriod_s) {
    const double angle = 4.0 * std::numbers::pi * seen.t_s / kPeriod_s;
    added_nm = seen.tick(size_nm * std::cos(angle) + off * added_nm);
    if (seen.t_s > 149.0 * kPeriod_s) largest_nm = std::max(largest_nm, std::abs(added_nm));
  }
  return largest_nm;
}

TEST(Repetition, ConvergesWhereTheMomentsAreOffByLessThanHalf) {
  // T = h + off w, w = -2 T.
  for (const double off : {-0.4, -0.2, 0.2, 0.4, 0.8}) {
    const double expected_nm = 2.0 * 2e-3 / (1.0 + 2.0 * off);
    EXPECT_NEAR(largest_added_nm(2e-3, off), expected_nm, 0.05 * expected_nm) << off;
  }
  // Beyond: as far as it is bounded.
  EXPECT_GT(largest_added_nm(2e-3, -0.7), 0.9 * RepetitiveCompensation::kLargest * 0.626);
}

TEST(Repetition, AlongSegmentsThatStretchToo) {
  ArmParameters arm = test::paper_arm(3);
  arm.extensible = true;
  Seen seen(arm);
  double error_n = 0.0, late_n = 0.0;
  const auto force_n = [](double t_s) { return 10.0 * repeating_nm(t_s); };
  while (seen.t_s < 25.0 * kPeriod_s) {
    const double t_s = seen.t_s;
    seen.found.segment[2].axial_force_n = force_n(t_s - kLead_s);
    seen.tick(0.0);
    if (t_s < 24.0 * kPeriod_s) continue;
    error_n = std::max(error_n, std::abs(seen.found.segment[2].axial_force_n - force_n(t_s)));
    late_n = std::max(late_n, std::abs(force_n(t_s - kLead_s) - force_n(t_s)));
    EXPECT_EQ(seen.found.disturbance_nm[4], 0.0);
  }
  EXPECT_LT(error_n, 0.1 * late_n);
}

TEST(Repetition, DoesNotAllocate) {
  Seen seen;
  seen.tick(0.01);
  const long before = test::allocations;
  for (int k = 0; k < 3000; ++k) seen.tick(repeating_nm(seen.t_s));
  seen.compensation.start(kPeriod_s);
  EXPECT_EQ(test::allocations - before, 0);
}

}  // namespace
}  // namespace softarm
