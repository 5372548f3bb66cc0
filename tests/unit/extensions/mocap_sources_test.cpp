// A motion-capture source that the library does not know, through public headers alone: lines of
// text in place of messages.
#include <gtest/gtest.h>

#include <charconv>
#include <stdexcept>
#include <string>

#include "counted_malloc.hpp"
#include "softarm/transport/mocap_format.hpp"
#include "softarm/transport/mocap_source.hpp"

namespace softarm {
namespace {

/// "FRAME TIME_US" and, for every body, " ID X Y Z W X Y Z".
class TextFormat final : public MocapFormat {
 public:
  bool decode(std::span<const std::byte> bytes, SentFrame& frame) noexcept override {
    const char* at = reinterpret_cast<const char*>(bytes.data());
    const char* const end = at + bytes.size();
    const auto take = [&](auto& number) {
      while (at != end && *at == ' ') ++at;
      const auto [rest, error] = std::from_chars(at, end, number);
      at = rest;
      return error == std::errc();
    };
    if (!take(frame.frame_number) || !take(frame.sender_time_us)) return false;
    for (frame.bodies = 0; at != end; ++frame.bodies) {
      if (frame.bodies == SentFrame::kMostBodies) return false;
      SentBody& body = frame.body[frame.bodies];
      body.seen = true;
      bool good = take(body.id);
      for (double& each : body.position) good = good && take(each);
      for (double& each : body.orientation) good = good && take(each);
      if (!good) return false;
    }
    return true;
  }

  std::span<const std::byte> encode(const SentFrame& frame) override {
    text_ = std::to_string(frame.frame_number) + " " + std::to_string(frame.sender_time_us);
    for (const SentBody& body : std::span(frame.body).first(frame.bodies)) {
      if (!body.seen) continue;
      text_ += " " + std::to_string(body.id);
      for (const double each : body.position) text_ += " " + std::to_string(each);
      for (const double each : body.orientation) text_ += " " + std::to_string(each);
    }
    return std::as_bytes(std::span(text_));
  }

 private:
  std::string text_;
};

std::unique_ptr<MocapFormat> make_text() { return std::make_unique<TextFormat>(); }

const MocapSourceRegistration kText({.label = "text", .make = make_text, .channel = "TEXT"});

TransportSettings text_source() {
  TransportSettings transport;
  transport.mocap.source = *mocap_sources().find("text");
  transport.mocap.unit = LengthUnit::millimetre;
  transport.lcm.mocap_channel = transport.mocap.source.channel;
  transport.bodies = {.base_id = -1, .segment_ids = {7, 5}};
  return transport;
}

ArmParameters two_segments() {
  ArmParameters arm;
  arm.segments.resize(2);
  return arm;
}

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text));
}

TEST(MocapFormat, AnotherSourceIsOneLine) {
  EXPECT_THROW(MocapSourceRegistration({.label = "text", .make = make_text}),
               std::invalid_argument);
  MocapSource source(text_source(), {}, two_segments());
  ASSERT_EQ(source.channels(), std::vector<std::string>{"TEXT"});
  MocapFrame frame;
  const std::string text = "12 5000 5 100 0 -300 1 0 0 0 9 1 2 3 1 0 0 0 7 0 0 -150 0.6 0.8 0 0";
  ASSERT_EQ(source.take(0, bytes_of(text), 1'000'000, frame), MocapReceipt::frame);
  EXPECT_EQ(frame.frame_number, 12);
  EXPECT_EQ(source.sender_time_us(), 5000);
  EXPECT_TRUE(frame.body[0].valid) << "fixed";
  EXPECT_LT((frame.body[1].position_m - Eigen::Vector3d(0, 0, -0.15)).norm(), 1e-15);
  EXPECT_EQ(frame.body[1].orientation.x(), 0.8);
  EXPECT_LT((frame.body[2].position_m - Eigen::Vector3d(0.1, 0, -0.3)).norm(), 1e-15);
  for (const char* bad : {"", "12", "12 5000 5 1 2", "12 x", "12 5000 5 100 0 -300 1 0 0 zero"})
    EXPECT_EQ(source.take(0, bytes_of(bad), 2'000'000, frame), MocapReceipt::malformed) << bad;
  const long before = test::thread_allocations;
  for (int k = 0; k < 100; ++k) source.take(0, bytes_of(text), 3'000'000 + k, frame);
  EXPECT_EQ(test::thread_allocations, before);
}

TEST(MocapFormat, ASimulatedArmSendsWhatTheSourceReads) {
  const TransportSettings transport = text_source();
  const MocapAdapter adapter(transport.bodies, two_segments(), transport.mocap);
  MocapSource source(transport, {}, two_segments());
  MocapFrame frame, again;
  frame.frame_number = 3;
  frame.body[1] = {{0.25, -0.5, 0.125}, Eigen::Quaterniond(0.0, 0.0, 1.0, 0.0), true};
  frame.body[2].valid = false;
  SentFrame sent;
  adapter.to_sent(frame, 42, sent);
  const auto format = transport.mocap.source.make();
  ASSERT_EQ(source.take(0, format->encode(sent), 0, again), MocapReceipt::frame);
  EXPECT_EQ(again.frame_number, 3);
  EXPECT_EQ(again.body[1].position_m, frame.body[1].position_m);
  EXPECT_EQ(again.body[1].orientation.coeffs(), frame.body[1].orientation.coeffs());
  EXPECT_FALSE(again.body[2].valid);
}

}  // namespace
}  // namespace softarm
