// What a tick was given comes back from its record bit for bit, and the records come twice.
#include "softarm/transport/tick_record.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <random>

#include "counted_malloc.hpp"
#include "softarm/runtime/settings.hpp"
#include "softarm/transport/message_decoding.hpp"
#include "unit/transport/messages.hpp"

namespace softarm {
namespace {

using softarm_messages::tick_record_t;

/// Any bits at all, NaN with payloads, infinities and denormals among them.
struct AnyBits {
  std::mt19937_64 random;
  std::int64_t integer() { return static_cast<std::int64_t>(random()); }
  double number() { return std::bit_cast<double>(random()); }
  SegmentVector vector(int size) {
    SegmentVector v(size);
    for (double& each : v) each = number();
    return v;
  }
  MocapFrame frame(int segments) {
    MocapFrame frame;
    frame.frame_number = integer();
    frame.capture_ns = integer();
    frame.segments = segments;
    for (auto& body : frame.body) {
      for (double& each : body.position_m) each = number();
      body.orientation = Eigen::Quaterniond(number(), number(), number(), number());
      body.valid = random() % 2 == 0;
    }
    return frame;
  }
};

template <class A, class B>
bool same_bits(const A& a, const B& b, std::size_t count) {
  return std::memcmp(a.data(), b.data(), count * sizeof(double)) == 0;
}

void expect_same(const TickInput& a, const TickInput& b) {
  // A new field of TickInput stops the build here too: it belongs into this test.
  const auto& [now_a, frames_a, reference_a, requests_a, expired_a, paused_a, overruns_a,
               measurement_a, tip_a, law_a, measured_a, go_a, foreign_a] = a;
  const auto& [now_b, frames_b, reference_b, requests_b, expired_b, paused_b, overruns_b,
               measurement_b, tip_b, law_b, measured_b, go_b, foreign_b] = b;
  const auto& [arm_a, disarm_a, stop_a, shutdown_a, lost_a] = requests_a;
  const auto& [arm_b, disarm_b, stop_b, shutdown_b, lost_b] = requests_b;
  EXPECT_EQ(now_a, now_b);
  EXPECT_EQ(arm_a, arm_b);
  EXPECT_EQ(disarm_a, disarm_b);
  EXPECT_EQ(shutdown_a, shutdown_b);
  EXPECT_EQ(expired_a, expired_b);
  EXPECT_EQ(paused_a, paused_b);
  EXPECT_EQ(overruns_a, overruns_b);
  EXPECT_EQ(measurement_a, measurement_b);
  EXPECT_EQ(stop_a, stop_b);
  EXPECT_EQ(go_a, go_b);
  EXPECT_EQ(foreign_a, foreign_b);
  EXPECT_EQ(lost_a, lost_b);
  ASSERT_EQ(tip_a == nullptr, tip_b == nullptr);
  if (tip_a != nullptr) {
    EXPECT_TRUE(same_bits(tip_a->position_m, tip_b->position_m, 3));
    EXPECT_TRUE(same_bits(tip_a->velocity_mps, tip_b->velocity_mps, 3));
  }
  ASSERT_EQ(law_a == nullptr, law_b == nullptr);
  if (law_a != nullptr) {
    const auto& [state_a, arrival_a, validity_a, answer_a, values_a] = *law_a;
    const auto& [state_b, arrival_b, validity_b, answer_b, values_b] = *law_b;
    EXPECT_EQ(state_a, state_b);
    EXPECT_EQ(arrival_a, arrival_b);
    EXPECT_EQ(validity_a, validity_b);
    EXPECT_EQ(answer_a, answer_b);
    ASSERT_EQ(values_a.size(), values_b.size());
    EXPECT_TRUE(same_bits(values_a, values_b, static_cast<std::size_t>(values_a.size())));
  }
  ASSERT_EQ(measured_a == nullptr, measured_b == nullptr);
  if (measured_a != nullptr) {
    ASSERT_EQ(measured_a->size(), measured_b->size());
    EXPECT_EQ(std::memcmp(measured_a->data(), measured_b->data(),
                          sizeof(double) * static_cast<std::size_t>(measured_a->size())),
              0);
  }
  ASSERT_EQ(reference_a == nullptr, reference_b == nullptr);
  if (reference_a != nullptr) {
    const auto& [u_a, velocity_a, acceleration_a] = *reference_a;
    const auto& [u_b, velocity_b, acceleration_b] = *reference_b;
    const auto size = static_cast<std::size_t>(u_a.size());
    ASSERT_EQ(u_b.size(), u_a.size());
    EXPECT_TRUE(same_bits(u_a, u_b, size) && same_bits(velocity_a, velocity_b, size) &&
                same_bits(acceleration_a, acceleration_b, size));
  }
  ASSERT_EQ(frames_a.size(), frames_b.size());
  for (std::size_t k = 0; k < frames_a.size(); ++k) {
    const auto& [number_a, capture_a, segments_a, body_a] = frames_a[k];
    const auto& [number_b, capture_b, segments_b, body_b] = frames_b[k];
    EXPECT_EQ(number_a, number_b);
    EXPECT_EQ(capture_a, capture_b);
    ASSERT_EQ(segments_a, segments_b);
    for (std::size_t i = 0; i <= static_cast<std::size_t>(segments_a); ++i) {
      EXPECT_TRUE(same_bits(body_a[i].position_m, body_b[i].position_m, 3));
      EXPECT_TRUE(same_bits(body_a[i].orientation.coeffs(), body_b[i].orientation.coeffs(), 4));
      EXPECT_EQ(body_a[i].valid, body_b[i].valid);
    }
  }
}

PipelineSettings arm_of(int segments) {
  PipelineSettings settings;
  settings.arm.segments.resize(static_cast<std::size_t>(segments));
  settings.actuation.segments.assign(static_cast<std::size_t>(segments), std::vector<Chamber>(4));
  settings.control.law = ExternalLaw{};
  return settings;
}

const Provenance kProvenance{.version = "test",
                             .configuration_hash = 0xfedcba9876543210,
                             .seed = 1,
                             .build = std::string(200, 'b')};

TEST(TickRecord, AnyInputComesBackBitForBit) {
  AnyBits any;
  for (const int segments : {1, 3, 10, kMaxSegments}) {
    TickRecorder recorder(arm_of(segments), kProvenance, true);
    RecordedInput replayed;
    for (int k = 1; k <= 200; ++k) {
      std::vector<MocapFrame> frames;
      const auto count = static_cast<int>(any.random() % 3);
      for (int i = 0; i < std::min(count, recorder.frame_capacity()); ++i)
        frames.push_back(any.frame(segments));
      const LiveReferenceInput reference{any.vector(2 * segments), any.vector(2 * segments),
                                         any.vector(2 * segments)};
      TickInput input;
      input.now_ns = any.integer();
      input.frames = frames;
      input.reference = k % 2 == 0 ? &reference : nullptr;
      input.requests.arm = k % 3 == 0;
      input.requests.disarm = k % 5 == 0;
      input.requests.shutdown = k % 7 == 0;
      input.command_expired = k % 11 == 0;
      input.paused = k % 13 == 0;
      input.consecutive_overruns = static_cast<int>(any.random());
      input.newest_measurement_ns = any.integer();
      input.newest_go_ns = any.integer();
      input.newest_foreign_ns = any.integer();
      input.requests.lost = k % 13 == 0;
      input.requests.emergency_stop = k % 11 == 0;
      const PressureVector measured =
          PressureVector::Random(4 * segments).cast<float>().cast<double>();
      if (k % 4 == 0) input.measured_bar = &measured;
      LawInput law{any.integer(),
                   any.integer(),
                   any.integer(),
                   k % 6 == 0 ? LawAnswer::pressures : LawAnswer::force,
                   {}};
      law.values.resize(law.answer == LawAnswer::pressures ? 4 * segments : 2 * segments);
      for (double& each : law.values) each = any.number();
      if (k % 3 == 0) input.law = &law;
      const auto place = [&] { return Eigen::Vector3d(any.number(), any.number(), any.number()); };
      const TipTargetInput target{place(), place()};
      if (k % 5 == 0) input.tip_target = &target;
      const PressureVector command = PressureVector::Random(4 * segments);

      const auto bytes = recorder.record(k, input, command);
      tick_record_t record{};
      ASSERT_TRUE(decode(bytes, record)) << segments << " segments, tick " << k;
      EXPECT_TRUE(is_intact(bytes));
      EXPECT_EQ(record.tick, k);
      EXPECT_EQ(record.shadow, 1);
      EXPECT_EQ(static_cast<std::uint64_t>(record.configuration_hash),
                kProvenance.configuration_hash);
      EXPECT_EQ(record.build, k == 1 ? kProvenance.build : "");
      EXPECT_TRUE(same_bits(record.pressure_bar, command, record.pressure_bar.size()));
      expect_same(replayed.from(record), input);
    }
  }
}

TEST(TickRecord, EveryChangedBitIsSeen) {
  TickRecorder recorder(arm_of(3), kProvenance, false);
  AnyBits any;
  const std::vector<MocapFrame> frames = {any.frame(3)};
  TickInput input;
  input.frames = frames;
  const auto bytes = recorder.record(1, input, PressureVector::Zero(12));
  test::Bytes copy(bytes.begin(), bytes.end());
  for (std::size_t bit = 0; bit < 8 * copy.size(); ++bit) {
    copy[bit / 8] ^= static_cast<std::byte>(1u << bit % 8);
    ASSERT_FALSE(is_intact(copy)) << bit;
    copy[bit / 8] ^= static_cast<std::byte>(1u << bit % 8);
  }
  EXPECT_TRUE(is_intact(copy));
  EXPECT_FALSE(is_intact(test::Bytes(7)));
}

TEST(TickRecord, TheUsualArmsFitIntoOnePacket) {
  AnyBits any;
  for (const auto& [segments, with_reference] : {std::pair{3, true}, {10, false}}) {
    TickRecorder recorder(arm_of(segments), kProvenance, false);
    const std::vector<MocapFrame> frames = {any.frame(segments)};
    const LiveReferenceInput reference{any.vector(2 * segments), any.vector(2 * segments),
                                       any.vector(2 * segments)};
    TickInput input;
    input.frames = frames;
    if (with_reference) input.reference = &reference;
    EXPECT_LT(recorder.record(1, input, PressureVector::Zero(4 * segments)).size(), 1400u);
  }
}

TEST(TickRecord, TheFullestRecordFits) {
  AnyBits any;
  for (const int segments : {1, 10, 30, kMaxSegments}) {
    TickRecorder recorder(arm_of(segments), kProvenance, false);
    ASSERT_GE(recorder.frame_capacity(), 1);
    ASSERT_LE(recorder.frame_capacity(), TickRecorder::kMostFrames);
    if (segments <= 10) {
      EXPECT_EQ(recorder.frame_capacity(), TickRecorder::kMostFrames);
    }
    const std::vector<MocapFrame> frames(static_cast<std::size_t>(recorder.frame_capacity()),
                                         any.frame(segments));
    const LiveReferenceInput reference{any.vector(2 * segments), any.vector(2 * segments),
                                       any.vector(2 * segments)};
    TickInput input;
    input.frames = frames;
    input.reference = &reference;
    LawInput law;
    law.answer = LawAnswer::pressures;
    law.values.setZero(4 * segments);
    input.law = &law;
    const TipTargetInput target{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
    input.tip_target = &target;
    const auto bytes = recorder.record(1, input, PressureVector::Zero(4 * segments));
    tick_record_t record{};
    EXPECT_TRUE(decode(bytes, record)) << segments;
    EXPECT_LE(bytes.size(), 60'000u);
  }
}

TEST(TickRecord, EveryRecordIsGivenOnceMoreInOrderAndNothingAllocates) {
  TickRecorder recorder(arm_of(3), kProvenance, false);
  AnyBits any;
  const std::vector<MocapFrame> frames(10, any.frame(3));
  const LiveReferenceInput reference{any.vector(6), any.vector(6), any.vector(6)};
  const PressureVector command = PressureVector::Zero(12);
  tick_record_t record{};
  EXPECT_TRUE(recorder.take_oldest().empty());
  std::int64_t repeated = 0;
  for (std::int64_t k = 1; k <= 2000; ++k) {
    if (recorder.full()) {
      const auto bytes = recorder.take_oldest();
      if (!decode(bytes, record)) FAIL();
      ASSERT_EQ(record.tick, ++repeated);
      ASSERT_EQ(record.tick, k - TickRecorder::kRepeatAfter);
    }
    const long before = test::allocations;
    TickInput input;
    input.frames = std::span(frames).first(static_cast<std::size_t>(k % 11));
    input.reference = k % 3 == 0 ? &reference : nullptr;
    if (recorder.record(k, input, command).empty()) FAIL();
    ASSERT_EQ(test::allocations - before, 0);
  }
  while (!recorder.take_oldest().empty()) ++repeated;
  EXPECT_EQ(repeated, 2000);
}

}  // namespace
}  // namespace softarm
