// Random sequences of everything that can go wrong with frames: the limits hold in every tick.
#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <random>
#include <set>
#include <vector>

#include "unit/daemon/pipeline_bench.hpp"

namespace softarm {
namespace {

using test::kMs;
using test::PipelineBench;
using test::PressureLimits;

/// Spoils frames at random, in spells.
class Faults {
 public:
  Faults(PipelineBench& bench, unsigned seed) : bench_(bench), random_(seed) {}

  void before_tick() {
    if (chance(0.005)) spell_ = std::uniform_int_distribution<int>(0, kKinds)(random_);
    if (chance(0.01)) spell_ = 0;
    if (chance(0.0005)) bench_.next_number -= 50;
    if (chance(0.0003)) bench_.now_ns += 150 * kMs;
    bench_.latency_ns = spell_ == 5 ? 70 * kMs : 5 * kMs;
    bench_.input.arm = chance(0.002);
    bench_.input.disarm = chance(0.0002);
  }

  bool spoil(MocapFrame& frame) {
    const std::size_t body = std::uniform_int_distribution<std::size_t>(0, 3)(random_);
    const int axis = std::uniform_int_distribution<int>(0, 2)(random_);
    switch (spell_) {
      case 1:
        return false;
      case 2:
        frame.body[body].position_m[axis] = bad_number();
        break;
      case 3:
        std::swap(frame.body[body], frame.body[(body + 1) % 4]);
        break;
      case 4:
        frame.body[body].position_m[axis] += 0.05;
        break;
      case 6:
        bench_.send(frame, bench_.latency_ns);
        break;
      case 7:
        frame.body = last_.body;
        break;
      case 8:
        frame.body[body].valid = false;
        break;
      case 9:
        frame.body[body].orientation.coeffs()[axis] = bad_number();
        break;
      case 10:
        frame.body[body].orientation.coeffs() *= 1.5;
        break;
      case 11:
        frame.segments = std::uniform_int_distribution<int>(-1, 4)(random_);
        break;
      default:
        break;
    }
    last_ = frame;
    return true;
  }

  bool chance(double p) { return std::bernoulli_distribution(p)(random_); }

 private:
  static constexpr int kKinds = 11;
  double bad_number() {
    constexpr double kBad[] = {std::numeric_limits<double>::quiet_NaN(),
                               std::numeric_limits<double>::infinity(),
                               -std::numeric_limits<double>::infinity(),
                               1e308,
                               -1e300,
                               std::numeric_limits<double>::denorm_min()};
    return kBad[std::uniform_int_distribution<int>(0, 5)(random_)];
  }

  PipelineBench& bench_;
  std::mt19937 random_;
  MocapFrame last_;
  int spell_ = 0;
};

TEST(PipelineFaults, LimitsHoldInEveryTick) {
  const Experiment experiment = test::paper_arm();
  const double vent_ticks = experiment.actuation.max_pressure_bar /
                            experiment.actuation.vent_bar_per_s * experiment.daemon.rate_hz;
  std::set<Mode> seen;
  for (unsigned seed = 1; seed <= 30; ++seed) {
    PipelineBench bench(experiment);
    Faults faults(bench, seed);
    PressureLimits limits(experiment);
    bench.spoil = [&](MocapFrame& frame) { return faults.spoil(frame); };
    const unsigned ticks = 1500 + 71 * seed;
    for (unsigned k = 0; k < ticks; ++k) {
      faults.before_tick();
      const TickOutput& output = bench.tick();
      ASSERT_STREQ(limits.violation(output), "") << "seed " << seed << ", tick " << k;
      ASSERT_TRUE(output.mode != Mode::active || output.motion.all_valid())
          << "seed " << seed << ", tick " << k;
      ASSERT_TRUE(output.motion.u_rad.allFinite() && output.motion.velocity_radps.allFinite());
      seen.insert(output.mode);
    }
    bench.input.shutdown = true;
    int to_vented = 0;
    do {
      faults.before_tick();
      const TickOutput& output = bench.tick();
      ASSERT_STREQ(limits.violation(output), "") << "seed " << seed << ", shutting down";
      ++to_vented;
    } while (!bench.pipeline.fully_vented() && to_vented < 1000);
    EXPECT_LE(to_vented, vent_ticks + 2) << "seed " << seed;
    for (int k = 0; k < 100; ++k) {
      faults.before_tick();
      bench.tick();
      ASSERT_TRUE(bench.pipeline.fully_vented());
    }
  }
  EXPECT_EQ(seen, (std::set{Mode::wait_frames, Mode::active, Mode::hold, Mode::vent}))
      << "the faults did not lead everywhere";
}

// The same with a valve read-back that falls silent: FAULT vents too.
TEST(PipelineFaults, SilentValvesVentWithinTheLimits) {
  Experiment experiment = test::paper_arm();
  experiment.daemon.safety.valve_readback = true;
  PipelineBench bench(experiment);
  PressureLimits limits(experiment);
  for (int k = 0; k < 1500; ++k) {
    bench.input.newest_measurement_ns = std::min(bench.now_ns, 3000 * kMs);
    ASSERT_STREQ(limits.violation(bench.tick()), "") << k;
  }
  EXPECT_EQ(bench.pipeline.output().mode, Mode::fault);
  EXPECT_TRUE(bench.pipeline.fully_vented());
}

// Every number of a frame in turn is spoilt while the arm is bent under pressure.
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
  int spoilt = 0;
  bench.spoil = [&](MocapFrame& frame) {
    const int which = spoilt++;
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
  while (spoilt < 140) ASSERT_STREQ(limits.violation(bench.tick()), "") << spoilt;
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
    Faults faults(bench, seed);
    bench.spoil = [&](MocapFrame& frame) { return faults.spoil(frame); };
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
