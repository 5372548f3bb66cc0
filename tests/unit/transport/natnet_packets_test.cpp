// NatNet's packets, written here section by section as the SDK's sample reads them, against ours.
#include "transport/natnet_packets.hpp"

#include <gtest/gtest.h>

#include <random>

#include "counted_malloc.hpp"
#include "transport/byte_writer.hpp"

namespace softarm {
namespace {

using Bytes = std::vector<std::byte>;

const NatnetVersion kVersions[] = {{3, 0}, {3, 1}, {4, 0}, {4, 1}, {4, 2}};

/// Numbers and texts one after the other; `section` puts the number of bytes where 4.1 has it.
struct Writer {
  explicit Writer(NatnetVersion of) : version(of) {}

  template <class... Numbers>
  Writer& put(Numbers... numbers) {
    (writer.put(numbers), ...);
    return *this;
  }
  Writer& text(const char* text) {
    writer.put_text(text);
    return *this;
  }
  template <class Body>
  Writer& section(std::int32_t elements, const Body& body) {
    put(elements);
    const std::size_t at = bytes.size();
    if (version >= NatnetVersion{4, 1}) put(std::int32_t{0});
    body();
    if (version >= NatnetVersion{4, 1})
      writer.put_at(at, static_cast<std::int32_t>(bytes.size() - at - 4));
    return *this;
  }
  void rigid_body(std::int32_t id, float x, std::uint16_t params) {
    put(id, x, 2.0F, 3.0F, 0.1F, 0.2F, 0.3F, 0.9F, 0.001F, params);
  }

  NatnetVersion version;
  Bytes bytes;
  ByteWriter writer{bytes};
};

/// A frame with something in every section.
Bytes full_frame(NatnetVersion version, std::uint64_t exposure_ticks = 12'345'678'900ULL) {
  Writer it(version);
  it.put(std::int32_t{77});
  it.section(2, [&] {
    it.text("arm").put(std::int32_t{1}, 1.0F, 2.0F, 3.0F);
    it.text("all").put(std::int32_t{0});
  });
  it.section(1, [&] { it.put(4.0F, 5.0F, 6.0F); });
  it.section(2, [&] {
    it.rigid_body(8, 1.5F, 1);
    it.rigid_body(9, -1.5F, 0);
  });
  it.section(1, [&] {
    it.put(std::int32_t{1}, std::int32_t{1});
    it.rigid_body(100, 0.0F, 1);
  });
  if (version >= NatnetVersion{4, 1})
    it.section(1, [&] {
      it.put(std::int32_t{5}, std::int32_t{1});
      it.rigid_body(200, 0.0F, 1);
      it.put(std::int32_t{1}, std::int32_t{3}, 1.0F, 1.0F, 1.0F, 0.01F, std::uint16_t{0}, 0.0F);
    });
  it.section(1, [&] { it.put(std::int32_t{6}, 1.0F, 1.0F, 1.0F, 0.01F, std::uint16_t{0}, 0.0F); });
  for (int devices = 0; devices < 2; ++devices)
    it.section(1, [&] {
      it.put(std::int32_t{0}, std::int32_t{2}, std::int32_t{1}, 1.0F, std::int32_t{2}, 1.0F, 2.0F);
    });
  it.put(std::uint32_t{0}, std::uint32_t{0}, 1234.5, exposure_ticks, std::uint64_t{2},
         std::uint64_t{3});
  if (version >= NatnetVersion{4, 1}) it.put(std::uint32_t{0}, std::uint32_t{0});
  it.put(std::uint16_t{2}, std::uint32_t{0});
  return it.bytes;
}

Bytes full_models(NatnetVersion version) {
  Writer it(version);
  const auto model = [&](std::int32_t kind, const auto& body) { it.section(kind, body); };
  const auto rigid_body = [&](const char* name, std::int32_t id, int markers) {
    it.text(name).put(id, std::int32_t{-1}, 0.0F, 0.0F, 0.0F);
    if (version >= NatnetVersion{4, 2}) it.put(0.0F, 0.0F, 0.0F, 1.0F);
    it.put(std::int32_t{markers});
    for (int k = 0; k < markers; ++k) it.put(0.1F, 0.2F, 0.3F);
    for (int k = 0; k < markers; ++k) it.put(std::int32_t{0});
    for (int k = 0; k < markers && version >= NatnetVersion{4, 0}; ++k) it.text("marker");
  };
  it.put(std::int32_t{7});
  model(0, [&] { it.text("base").put(std::int32_t{2}).text("a").text("b"); });
  model(2, [&] {
    it.text("skeleton").put(std::int32_t{3}, std::int32_t{1});
    rigid_body("tip", 1, 0);  // a bone of the same name
  });
  model(1, [&] { rigid_body("tip", 9, 3); });
  model(3, [&] {
    it.put(std::int32_t{0}).text("serial").put(1.0F, 2.0F, 0.0F, 0.0F, 0.0F);
    for (int k = 0; k < 12 * 12 + 4 * 3; ++k) it.put(0.5F);
    it.put(std::int32_t{0}, std::int32_t{0}, std::int32_t{1}).text("Fx");
  });
  model(4, [&] {
    it.put(std::int32_t{0}).text("daq").text("serial").put(std::int32_t{0}, std::int32_t{0});
    it.put(std::int32_t{1}).text("voltage");
  });
  model(5, [&] { it.text("camera").put(0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 1.0F); });
  model(1, [&] { rigid_body("base", 8, 0); });
  return it.bytes;
}

BodyNames base_and_tip() {
  BodySettings bodies{.base_id = 0, .segment_ids = {1}};
  bodies.base_marker_frame.name = "base";
  bodies.segment_marker_frames = {{.name = "tip"}};
  return BodyNames(bodies);
}

TEST(NatnetPackets, FramesOfEveryVersionGiveTheirBodiesAndTimes) {
  for (const NatnetVersion& version : kVersions) {
    SCOPED_TRACE(testing::Message() << version.major << "." << version.minor);
    SentFrame frame;
    NatnetNews news;
    ASSERT_TRUE(decode_natnet_frame(full_frame(version), {version, 10'000'000}, frame, news));
    EXPECT_EQ(frame.frame_number, 77);
    EXPECT_EQ(frame.sender_time_us, 1'234'567'890);
    ASSERT_EQ(frame.bodies, 2U);
    EXPECT_EQ(frame.body[0].id, 8);
    EXPECT_TRUE(frame.body[0].seen);
    EXPECT_EQ(frame.body[0].position, (std::array<double, 3>{1.5, 2.0, 3.0}));
    EXPECT_EQ(frame.body[0].orientation[3], static_cast<double>(0.9F));
    EXPECT_EQ(frame.body[1].id, 9);
    EXPECT_FALSE(frame.body[1].seen);
    EXPECT_TRUE(news.models_changed);
    EXPECT_FALSE(news.version_changed);
    // Without a high-resolution clock the time of the software counts.
    for (const auto& [ticks, per_s] : {std::pair{0ULL, 10'000'000ULL}, {5ULL, 0ULL}}) {
      ASSERT_TRUE(decode_natnet_frame(full_frame(version, ticks), {version, per_s}, frame, news));
      EXPECT_EQ(frame.sender_time_us, 1'234'500'000);
    }
  }
}

TEST(NatnetPackets, ModelsOfEveryVersionGiveTheIdsOfRigidBodies) {
  for (const NatnetVersion& version : kVersions) {
    SCOPED_TRACE(testing::Message() << version.major << "." << version.minor);
    BodyNames names = base_and_tip();
    ASSERT_TRUE(decode_natnet_models(full_models(version), version, names));
    EXPECT_EQ(names.bodies()[0].sent_id, 8);
    EXPECT_EQ(names.bodies()[1].sent_id, 9);
    EXPECT_EQ(names.missing(), nullptr);
    SentFrame frame;
    NatnetNews news;
    ASSERT_TRUE(decode_natnet_frame(full_frame(version), {version, 1000}, frame, news));
    names.translate(frame);
    EXPECT_EQ(frame.body[0].id, 0);
    EXPECT_EQ(frame.body[1].id, 1);
  }
}

/// A shorter packet is none, and no count or size leads out of one.
TEST(NatnetPackets, CutAndChangedPacketsAreRefusedOrHarmless) {
  std::mt19937 random(1);
  for (const NatnetVersion& version : kVersions) {
    const Bytes frame_bytes = full_frame(version), model_bytes = full_models(version);
    SentFrame frame;
    NatnetNews news;
    BodyNames names = base_and_tip();
    // The last four bytes, which end a frame, are not used.
    for (std::size_t length = 0; length + 6 <= frame_bytes.size(); length += 3)
      EXPECT_FALSE(
          decode_natnet_frame(std::span(frame_bytes).first(length), {version}, frame, news));
    for (std::size_t length = 0; length < model_bytes.size(); length += 3)
      EXPECT_FALSE(decode_natnet_models(std::span(model_bytes).first(length), version, names));
    for (int k = 0; k < 3000; ++k) {
      for (Bytes bytes : {frame_bytes, model_bytes}) {
        const std::size_t at = random() % (bytes.size() - 4);
        const std::int32_t numbers[] = {-1,      INT32_MAX, INT32_MIN,
                                        1 << 28, 1000,      static_cast<std::int32_t>(random())};
        ByteWriter(bytes).put_at(at, numbers[random() % 6]);
        if (decode_natnet_frame(bytes, {version}, frame, news)) {
          EXPECT_LE(frame.bodies, SentFrame::kMostBodies);
        }
        decode_natnet_models(bytes, version, names);
      }
    }
  }
}

TEST(NatnetPackets, DecodingAllocatesNothing) {
  const Bytes frame_bytes = full_frame({4, 1}), model_bytes = full_models({4, 1});
  SentFrame frame;
  NatnetNews news;
  BodyNames names = base_and_tip();
  const long before = test::thread_allocations;
  EXPECT_TRUE(decode_natnet_frame(frame_bytes, {}, frame, news));
  EXPECT_TRUE(decode_natnet_models(model_bytes, {4, 1}, names));
  names.translate(frame);
  EXPECT_EQ(test::thread_allocations, before);
}

TEST(NatnetPackets, ASimulatedServerIsUnderstood) {
  for (const NatnetVersion& version : kVersions) {
    SCOPED_TRACE(testing::Message() << version.major << "." << version.minor);
    Bytes packet;
    NatnetDialect dialect{.version = version};
    encode_natnet_server(dialect, packet);
    NatnetDialect found{.version = {0, 0}, .ticks_per_s = 0};
    ASSERT_TRUE(decode_natnet_server(natnet_contents(packet, NatnetMessage::server_info), found));
    EXPECT_EQ(found.version, version);
    EXPECT_EQ(found.ticks_per_s, dialect.ticks_per_s);
    BodyNames names = base_and_tip();
    encode_natnet_models(version, names, packet);
    ASSERT_TRUE(
        decode_natnet_models(natnet_contents(packet, NatnetMessage::models), version, names));
    EXPECT_EQ(names.bodies()[1].sent_id, 1);
    SentFrame sent, got;
    sent.frame_number = 3;
    sent.sender_time_us = 5'000'001;
    sent.bodies = 1;
    sent.body[0] = {1, true, {0.5, 0.25, 0.125}, {0, 0, 0, 1}};
    encode_natnet_frame(sent, dialect, packet);
    NatnetNews news;
    ASSERT_TRUE(
        decode_natnet_frame(natnet_contents(packet, NatnetMessage::frame), dialect, got, news));
    EXPECT_EQ(got.sender_time_us, sent.sender_time_us);
    EXPECT_EQ(got.body[0].position, sent.body[0].position);
    EXPECT_EQ(got.body[0].orientation, sent.body[0].orientation);
  }
}

TEST(NatnetPackets, OlderServersAndWrongLengthsAreRefused) {
  Bytes packet;
  NatnetDialect dialect{.version = {2, 10}};
  encode_natnet_server(dialect, packet);
  EXPECT_FALSE(decode_natnet_server(natnet_contents(packet, NatnetMessage::server_info), dialect));
  packet.push_back(std::byte{0});
  EXPECT_TRUE(natnet_contents(packet, NatnetMessage::server_info).empty());
}

}  // namespace
}  // namespace softarm
