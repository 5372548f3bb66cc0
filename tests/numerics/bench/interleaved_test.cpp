// Timing by a clock of the test's own, which a call advances by what it is said to take: on
// machines from a million times slower than a real one to infinitely fast.
#include "dev/bench/interleaved.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace softarm {
namespace {

/// A machine on which a call of each of two functions takes a configured time, and everything
/// else a microsecond.
class Machine {
 public:
  InterleavedTiming timing() {
    return InterleavedTiming({.wall_ns = [this] { return now_ns_ += 1000.0; },
                              .processor_ns = [this] { return now_ns_; }});
  }
  std::function<void(int)> function(double call_ns) {
    return [this, call_ns](int calls) {
      calls_ += calls;
      now_ns_ += call_ns * calls;
    };
  }
  double calls() const { return calls_; }

 private:
  double now_ns_ = 0.0, calls_ = 0.0;
};

TEST(InterleavedTiming, FindsWhatACallTakesOnAnyMachine) {
  for (const double call_ns : {1e-3, 0.1, 1.0, 10.0, 1e3, 1e5, 1e7, 1e9}) {
    SCOPED_TRACE(call_ns);
    Machine machine;
    InterleavedTiming timing = machine.timing();
    timing.add(machine.function(call_ns));
    timing.add(machine.function(3.0 * call_ns));
    double share = 0.0;
    timing.measure(0.1, [&](double done) {
      EXPECT_GE(done, share);
      share = done;
    });
    EXPECT_EQ(share, 1.0);
    for (const std::size_t k : {0U, 1U}) {
      const CallTime time = timing.time(k);
      EXPECT_GE(time.rounds, call_ns < 1e6 ? 3U : 1U) << "long calls sit out most rounds";
      const double expected_ns = k == 0 ? call_ns : 3.0 * call_ns;
      EXPECT_NEAR(time.lower_ns, expected_ns, 1e-6 * expected_ns);
      EXPECT_NEAR(time.median_ns, expected_ns, 1e-6 * expected_ns);
      EXPECT_NEAR(time.upper_ns, expected_ns, 1e-6 * expected_ns);
    }
    EXPECT_NEAR(timing.ratio(1, 0), 3.0, 1e-6);
    EXPECT_GT(machine.calls(), 6);
  }
}

TEST(InterleavedTiming, EndsOnAMachineOnWhichACallTakesNoTime) {
  Machine machine;
  InterleavedTiming timing = machine.timing();
  timing.add(machine.function(0.0));
  timing.measure(1e-3, [](double) {});
  EXPECT_EQ(timing.time(0).median_ns, 0.0);
  EXPECT_TRUE(std::isnan(timing.ratio(0, 0)));
}

TEST(Quantile, InterpolatesBetweenFiniteValues) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_DOUBLE_EQ(quantile({4.0, kNan, 1.0, 2.0, 3.0}, 0.5), 2.5);
  EXPECT_DOUBLE_EQ(quantile({4.0, 1.0, 2.0, 3.0, 5.0}, 0.25), 2.0);
  EXPECT_TRUE(std::isnan(quantile({kNan}, 0.5)));
}

}  // namespace
}  // namespace softarm
