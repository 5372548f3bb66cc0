// A flood of frames: the model-based observer takes the newest few, as if the others had not come.
#include "softarm/runtime/newest_frames.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "softarm/estimation/model_observer.hpp"
#include "unit/runtime/pipeline_bench.hpp"

namespace softarm {
namespace {

using test::PipelineBench;

Experiment observed(int segments) {
  Experiment it = test::paper_arm();
  it.arm.segments.resize(static_cast<std::size_t>(segments));
  it.actuation.segments.resize(it.arm.segments.size(), it.actuation.segments.front());
  for (std::vector<double>* gains : {&it.control.kp, &it.control.kd, &it.control.ki})
    if (!gains->empty()) gains->assign(2 * it.arm.segments.size(), gains->front());
  it.estimation.model_observer.load.clear();
  it.reference.phases = {{PaperReference{.theta_rad = 0.2}, 0.0}};
  it.estimation.observer = ObserverKind::model;
  it.safety.arming = Arming::automatic;
  it.safety.valve_readback = false;
  return it;
}

/// Frames of the last period, each a little later than the one before.
std::vector<MocapFrame> flood(PipelineBench& bench, int count) {
  std::vector<MocapFrame> frames;
  for (int k = 0; k < count; ++k) {
    frames.push_back(bench.exact_frame());
    frames.back().capture_ns += 10'000 * (k + 1);
    frames.back().body[1].position_m.x() += 1e-5 * std::sin(k);
  }
  return frames;
}

/// Two arms with the same past; in one tick the first is sent all `frames`, the second only those
/// that `taken` lets through. From then on the observers are the same, bit for bit.
void expect_same(int segments, const std::function<void(std::vector<MocapFrame>&)>& change,
                 const std::function<bool(std::size_t index, std::size_t count)>& taken,
                 std::int64_t left_out) {
  PipelineBench flooded(observed(segments)), spared(observed(segments));
  for (PipelineBench* bench : {&flooded, &spared}) {
    ASSERT_GT(bench->run_to(Mode::active), 0) << name(bench->pipeline.output().reason);
    bench->run(500);
    ASSERT_NE(bench->pipeline.output().observer, nullptr);
    bench->publishing = false;
    bench->run(4);  // what is on its way arrives
    std::vector<MocapFrame> frames = flood(*bench, 60);
    change(frames);
    for (std::size_t k = 0; k < frames.size(); ++k)
      if (bench == &flooded || taken(k, frames.size())) bench->send(frames[k], 0);
    bench->publishing = true;
  }
  for (int k = 0; k < 300; ++k) {
    const TickOutput &a = flooded.tick(), &b = spared.tick();
    ASSERT_EQ(a.mode, Mode::active) << name(a.reason);
    ASSERT_EQ(b.mode, Mode::active) << name(b.reason);
    ASSERT_NE(a.observer, nullptr);
    ASSERT_EQ(a.motion.u_rad, b.motion.u_rad) << k;
    ASSERT_EQ(a.motion.velocity_radps, b.motion.velocity_radps) << k;
    ASSERT_EQ(a.observer->correction().disturbance_nm, b.observer->correction().disturbance_nm);
    ASSERT_EQ(a.pressure_bar, b.pressure_bar) << k;
  }
  EXPECT_EQ(flooded.pipeline.frames_left_out(), left_out);
  EXPECT_EQ(spared.pipeline.frames_left_out(), 0);
}

TEST(NewestFrames, HalfAPeriodIsEnoughForThem) {
  EXPECT_EQ(NewestFrames::most(1, 0.002), NewestFrames::kMost);
  EXPECT_EQ(NewestFrames::most(3, 0.002), 6);
  EXPECT_EQ(NewestFrames::most(10, 0.002), 2);
  EXPECT_EQ(NewestFrames::most(10, 0.01), 10);
  EXPECT_EQ(NewestFrames::most(kMaxSegments, 0.001), 1);
}

TEST(NewestFrames, AFloodIsAsIfOnlyTheNewestHadCome) {
  for (const int segments : {1, 3, 10}) {
    SCOPED_TRACE(segments);
    const auto most = static_cast<std::size_t>(NewestFrames::most(segments, 0.002));
    expect_same(
        segments, [](auto&) {},
        [most](std::size_t index, std::size_t count) { return index + most >= count; },
        60 - static_cast<std::int64_t>(most));
  }
}

TEST(NewestFrames, FramesThatAreRefusedDoNotDisplaceOneThatIsNot) {
  expect_same(
      3,
      [](std::vector<MocapFrame>& frames) {
        for (std::size_t k = 1; k < frames.size(); ++k)
          frames[k].body[2].orientation.coeffs() *= 2.0;
      },
      [](std::size_t index, std::size_t) { return index == 0; }, 0);
}

}  // namespace
}  // namespace softarm
