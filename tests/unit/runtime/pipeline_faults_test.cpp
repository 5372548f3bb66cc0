// NaN and infinity, and the same sequence of faults twice.
#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <vector>

#include "unit/runtime/pipeline_bench.hpp"
#include "unit/runtime/random_faults.hpp"

namespace softarm {
namespace {

using test::kMs;
using test::PipelineBench;
using test::PressureLimits;
using test::RandomFaults;

// The same with a valve read-back that falls silent: FAULT vents too.
TEST(PipelineFaults, SilentValvesVentWithinTheLimits) {
  Experiment experiment = test::paper_arm();
  experiment.safety.valve_readback = true;
  PipelineBench bench(experiment);
  bench.valves_publish = false;
  PressureLimits limits(experiment);
  for (int k = 0; k < 1500; ++k) {
    bench.input.newest_measurement_ns = std::min(bench.now_ns, 3000 * kMs);
    ASSERT_STREQ(limits.violation(bench.tick()), "") << k;
  }
  EXPECT_EQ(bench.pipeline.output().mode, Mode::fault);
  EXPECT_TRUE(bench.pipeline.fully_vented());
}

// Every number of a frame in turn is corrupted while the arm is bent under pressure.
TEST(PipelineFaults, NoBadNumberReachesTheValves) {
  const Experiment experiment = test::paper_arm();
  const double bad[] = {std::numeric_limits<double>::quiet_NaN(),
                        std::numeric_limits<double>::infinity(),
                        -std::numeric_limits<double>::infinity(),
                        std::numeric_limits<double>::max(), -std::numeric_limits<double>::max()};
  PipelineBench bench(experiment);
  PressureLimits limits(experiment);
  ASSERT_GT(bench.run_to(Mode::active), 0);
  limits.violation(bench.run(500));
  int corrupted = 0;
  bench.corrupt = [&](MocapFrame& frame) {
    const int which = corrupted++;
    const std::size_t body = static_cast<std::size_t>(which / 7 % 4);
    const double number = bad[which / 28 % 5];
    if (which % 7 < 3) {
      frame.body[body].position_m[which % 7] = number;
    } else {
      frame.body[body].orientation.coeffs()[which % 7 - 3] = number;
    }
    return true;
  };
  const std::int64_t accepted = bench.pipeline.counters().accepted;
  while (corrupted < 140) ASSERT_STREQ(limits.violation(bench.tick()), "") << corrupted;
  EXPECT_LE(bench.pipeline.counters().accepted, accepted + 1);
  EXPECT_EQ(bench.pipeline.output().mode, Mode::vent);
}

/// Every bit of an output that a test can tell apart.
std::vector<double> bits_of(const TickOutput& output) {
  std::vector<double> bits{static_cast<double>(output.mode),
                           static_cast<double>(output.reason),
                           static_cast<double>(output.saturated),
                           static_cast<double>(output.slew_limited),
                           static_cast<double>(output.reference_limited),
                           static_cast<double>(output.soft_limit),
                           static_cast<double>(output.frame_number),
                           output.frame_age_s};
  for (const SegmentVector* v : {&output.motion.u_rad, &output.motion.velocity_radps,
                                 &output.reference.u, &output.tau_actuation_nm})
    bits.insert(bits.end(), v->begin(), v->end());
  bits.insert(bits.end(), output.pressure_bar.begin(), output.pressure_bar.end());
  return bits;
}

TEST(PipelineFaults, SameInputSameBits) {
  const Experiment experiment = test::paper_arm();
  const auto history = [&](unsigned seed) {
    PipelineBench bench(experiment);
    RandomFaults faults(bench, seed);
    bench.corrupt = [&](MocapFrame& frame) { return faults.corrupt(frame); };
    std::vector<double> all;
    for (int k = 0; k < 3000; ++k) {
      faults.before_tick();
      const std::vector<double> bits = bits_of(bench.tick());
      all.insert(all.end(), bits.begin(), bits.end());
    }
    return all;
  };
  const std::vector<double> first = history(5), second = history(5), other = history(6);
  ASSERT_EQ(first.size(), second.size());
  EXPECT_EQ(std::memcmp(first.data(), second.data(), first.size() * sizeof(double)), 0);
  EXPECT_NE(first, other);
}

}  // namespace
}  // namespace softarm
