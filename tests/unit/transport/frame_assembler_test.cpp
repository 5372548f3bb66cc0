// Bodies that come one by one: which belong to one frame, and when it is done.
#include "softarm/transport/frame_assembler.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <vector>

#include "milliseconds.hpp"

namespace softarm {
namespace {

using test::kMs;

/// Three segments at 200 Hz; bodies carry their stamp and number in their position.
class Assembling : public ::testing::Test {
 protected:
  struct Done {
    std::int64_t number;
    std::int64_t capture_ns;
    std::vector<int> seen;
    double stamp_us;
  };

  FrameAssembler::Outcome add(std::size_t body, std::int64_t stamp_us, std::int64_t arrival_ns) {
    BodyPose pose;
    pose.valid = true;
    pose.position_m = {static_cast<double>(stamp_us), static_cast<double>(body), 0.0};
    const auto outcome = assembler.add(body, pose, stamp_us, arrival_ns);
    if (outcome == FrameAssembler::Outcome::begun) assembler.set_capture_ns(7 * stamp_us);
    collect();
    return outcome;
  }
  void look(std::int64_t now_ns) {
    assembler.look_at_clock(now_ns);
    collect();
  }
  void collect() {
    MocapFrame frame;
    frame.body[0].valid = true;  // where the base is fixed, its pose is set before
    if (!assembler.take_done(frame)) return;
    Done out{frame.frame_number, frame.capture_ns, {}, -1.0};
    for (int i = 0; i < 4; ++i) {
      const auto& body = frame.body[static_cast<std::size_t>(i)];
      if (!body.valid) continue;
      out.seen.push_back(i);
      if (i == 0) continue;
      EXPECT_EQ(body.position_m.y(), i);
      out.stamp_us = body.position_m.x();
    }
    done.push_back(out);
    EXPECT_FALSE(assembler.take_done(frame)) << "once";
  }

  FrameAssembler assembler{3, false, 0.005};
  std::vector<Done> done;
};

const std::vector<int> kAll{0, 1, 2, 3};

TEST_F(Assembling, AFrameIsDoneWithItsLastBody) {
  for (int k = 0; k < 3; ++k) {
    const std::int64_t stamp = 1000 + 5000 * k;
    for (const std::size_t body : {2U, 0U, 3U}) {
      add(body, stamp, stamp * 1000);
      EXPECT_EQ(done.size(), static_cast<std::size_t>(k));
    }
    add(1, stamp, stamp * 1000);
    ASSERT_EQ(done.size(), static_cast<std::size_t>(k + 1));
    EXPECT_EQ(done.back().number, k + 1);
    EXPECT_EQ(done.back().capture_ns, 7 * stamp);
    EXPECT_EQ(done.back().seen, kAll);
  }
}

TEST_F(Assembling, ABodyThatIsMissingIsNotSeenOnceTheNextFrameBegins) {
  add(0, 0, 0);
  add(1, 0, 0);
  add(3, 0, 0);
  EXPECT_TRUE(done.empty());
  add(2, 5000, 5 * kMs);
  ASSERT_EQ(done.size(), 1U);
  EXPECT_EQ(done[0].seen, (std::vector<int>{0, 1, 3}));
  EXPECT_EQ(done[0].capture_ns, 0);
  for (const std::size_t body : {0U, 1U, 3U}) add(body, 5000, 5 * kMs);
  ASSERT_EQ(done.size(), 2U);
  EXPECT_EQ(done[1].seen, kAll);
  EXPECT_EQ(done[1].stamp_us, 5000.0) << "nothing of the frame before shines through";
}

TEST_F(Assembling, WaitingEndsByTheClockToo) {
  add(1, 0, 100 * kMs);
  add(2, 0, 100 * kMs);
  look(102 * kMs);
  EXPECT_TRUE(done.empty());
  look(103 * kMs);
  ASSERT_EQ(done.size(), 1U);
  EXPECT_EQ(done[0].seen, (std::vector<int>{1, 2}));
  EXPECT_EQ(add(3, 0, 104 * kMs), FrameAssembler::Outcome::dropped) << "too late";
  look(200 * kMs);
  EXPECT_EQ(done.size(), 1U) << "done once";
  for (const std::size_t body : {3U, 2U, 1U, 0U}) add(body, 5000, 105 * kMs);
  ASSERT_EQ(done.size(), 2U);
  EXPECT_EQ(done[1].seen, kAll);
}

TEST_F(Assembling, StampsOfOneFrameMayDifferALittle) {
  add(0, 10'000, 0);
  add(1, 10'900, 0);
  add(2, 9'200, 0);
  add(3, 12'400, 0);
  ASSERT_EQ(done.size(), 1U);
  EXPECT_EQ(done[0].seen, kAll);
  EXPECT_EQ(done[0].capture_ns, 70'000);
}

TEST_F(Assembling, RepetitionsAreDropped) {
  for (const std::size_t body : {0U, 0U, 1U, 2U, 1U, 3U, 3U, 0U, 2U}) add(body, 500, 0);
  EXPECT_EQ(done.size(), 1U);
}

TEST_F(Assembling, ASenderThatIsFasterThanDeclaredLosesNothing) {
  for (int k = 0; k < 20; ++k)
    for (const std::size_t body : {0U, 1U, 2U, 3U}) add(body, 1000 * k, 0);
  EXPECT_EQ(done.size(), 20U);
}

TEST_F(Assembling, WhatIsOldIsDroppedUntilItIsPlainThatTheClockWasSetBack) {
  for (const std::size_t body : {0U, 1U, 2U, 3U}) add(body, 1'000'000, 0);
  EXPECT_EQ(add(1, 990'000, 0), FrameAssembler::Outcome::dropped);
  for (const std::size_t body : {0U, 1U, 2U, 3U}) add(body, 1'005'000, 0);
  EXPECT_EQ(done.size(), 2U);
  // Set back by 0.3 s.
  for (int k = 0; k < 10; ++k)
    for (const std::size_t body : {0U, 1U, 2U, 3U}) add(body, 700'000 + 5000 * k, 0);
  ASSERT_GE(done.size(), 9U) << "two frames are spent on finding out";
  EXPECT_EQ(done.back().stamp_us, 745'000.0);
  EXPECT_EQ(done.back().seen, kAll);
}

TEST_F(Assembling, AFixedBaseIsWaitedForByNobody) {
  assembler = FrameAssembler(3, true, 0.005);
  for (const std::size_t body : {1U, 2U, 3U}) add(body, 0, 0);
  ASSERT_EQ(done.size(), 1U);
  EXPECT_EQ(done[0].seen, kAll) << "what is there already is left alone";
  EXPECT_EQ(add(0, 0, 0), FrameAssembler::Outcome::dropped);
  EXPECT_EQ(add(4, 0, 0), FrameAssembler::Outcome::dropped);
}

TEST_F(Assembling, OneBodyMakesAFrame) {
  assembler = FrameAssembler(1, true, 0.005);
  for (int k = 0; k < 5; ++k) {
    add(1, 5000 * k, 0);
    ASSERT_EQ(done.size(), static_cast<std::size_t>(k + 1));
    EXPECT_EQ(done.back().capture_ns, 35'000 * k);
  }
}

TEST_F(Assembling, AnyOrderOfAnythingEndsInWholeNumbersOfFrames) {
  std::mt19937 random(5);
  std::int64_t now_ns = 0;
  for (int trial = 0; trial < 100'000; ++trial) {
    now_ns += static_cast<std::int64_t>(random() % 2'000'000);
    const auto stamp = static_cast<std::int64_t>(random() % 8'000'000'000) - 4'000'000'000;
    add(random() % 5, stamp * static_cast<std::int64_t>(1 + random() % 1'000'000), now_ns);
    if (random() % 8 == 0) look(now_ns);
  }
  for (std::size_t k = 0; k < done.size(); ++k)
    EXPECT_EQ(done[k].number, static_cast<std::int64_t>(k + 1));
}

}  // namespace
}  // namespace softarm
