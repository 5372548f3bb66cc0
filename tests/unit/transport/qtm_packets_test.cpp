// The packets of QTM RT, written here as Qualisys' documentation has them, against ours.
#include "transport/qtm_packets.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <random>
#include <string>

#include "counted_malloc.hpp"
#include "transport/byte_writer.hpp"

namespace softarm {
namespace {

using Bytes = std::vector<std::byte>;

/// Contents of a data packet: a component of 3D markers, then 6DOF with residual.
Bytes frame_of(const std::vector<Eigen::Isometry3f>& bodies) {
  Bytes bytes;
  ByteWriter writer(bytes);
  const auto put = [&](auto... numbers) { (writer.put(numbers), ...); };
  put(std::int64_t{2'500'000}, std::uint32_t{42}, std::uint32_t{2});
  put(std::uint32_t{8 + 8 + 12}, std::uint32_t{1}, std::uint32_t{1}, std::uint32_t{0}, 1.0F, 2.0F,
      3.0F);
  const auto count = static_cast<std::uint32_t>(bodies.size());
  put(8 + 8 + 52 * count, std::uint32_t{11}, count, std::int16_t{0}, std::int16_t{0});
  for (const Eigen::Isometry3f& body : bodies) {
    for (int axis = 0; axis < 3; ++axis) put(body.translation()[axis]);
    for (int column = 0; column < 3; ++column)
      for (int row = 0; row < 3; ++row) put(body.linear()(row, column));
    put(0.3F);
  }
  return bytes;
}

Eigen::Isometry3f turned(float angle_rad) {
  Eigen::Isometry3f pose = Eigen::Isometry3f::Identity();
  pose.linear() =
      Eigen::AngleAxisf(angle_rad, Eigen::Vector3f(1, 2, -2).normalized()).toRotationMatrix();
  pose.translation() = Eigen::Vector3f(100, 200, 300);
  return pose;
}

BodyNames base_then_tip() {
  BodySettings bodies{.base_id = 0, .segment_ids = {1}};
  bodies.base_marker_frame.name = "base & <frame>";
  bodies.segment_marker_frames = {{.name = "tip"}};
  return BodyNames(bodies);
}

constexpr const char* kXml =
    "<QTM_Parameters_Ver_1.25><The_6D><Bodies>3</Bodies><Euler><First>Roll</First></Euler>"
    "<Body><Name>other</Name><Color R=\"1\"/><Points><Point X=\"1\" Name=\"tip\"/></Points></Body>"
    "<Body ID=\"2\"><Enabled>true</Enabled><Name>tip</Name></Body>"
    "<Body><Name>base &amp; &lt;frame&gt;</Name></Body></The_6D></QTM_Parameters_Ver_1.25>";

TEST(QtmPackets, FramesGivePosesInTheOrderOfTheList) {
  SentFrame frame;
  for (const float angle_rad : {0.0F, 0.7F, 3.1F}) {
    ASSERT_TRUE(decode_qtm_frame(frame_of({turned(0.2F), turned(angle_rad)}), frame));
    EXPECT_EQ(frame.frame_number, 42);
    EXPECT_EQ(frame.sender_time_us, 2'500'000);
    ASSERT_EQ(frame.bodies, 2U);
    EXPECT_EQ(frame.body[1].id, 2);
    EXPECT_TRUE(frame.body[1].seen);
    EXPECT_EQ(frame.body[1].position, (std::array<double, 3>{100, 200, 300}));
    const auto& q = frame.body[1].orientation;
    const Eigen::Vector3d axis = Eigen::Vector3d(1, 2, -2) / 3.0;
    const double half = 0.5 * static_cast<double>(angle_rad), sign = q[0] < 0.0 ? -1.0 : 1.0;
    EXPECT_NEAR(sign * q[0], std::cos(half), 1e-6);
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(sign * q[static_cast<std::size_t>(k) + 1], std::sin(half) * axis[k], 1e-6);
  }
}

TEST(QtmPackets, ABodyNotSeenAndAMatrixThatIsNoRotation) {
  Eigen::Isometry3f lost = turned(0.1F), mirror = turned(0.1F), stretched = turned(0.1F);
  lost.translation()[1] = std::numeric_limits<float>::quiet_NaN();
  mirror.linear().col(0) *= -1.0F;
  stretched.linear() *= 1.01F;
  SentFrame frame;
  ASSERT_TRUE(decode_qtm_frame(frame_of({lost, mirror, stretched}), frame));
  EXPECT_FALSE(frame.body[0].seen);
  for (const std::size_t k : {1U, 2U}) {
    EXPECT_TRUE(frame.body[k].seen);
    EXPECT_EQ(frame.body[k].orientation, (std::array<double, 4>{})) << "for the validator";
  }
}

TEST(QtmPackets, NamesBecomePlacesInTheList) {
  BodyNames names = base_then_tip();
  read_qtm_names(kXml, names);
  EXPECT_EQ(names.bodies()[0].sent_id, 3);
  EXPECT_EQ(names.bodies()[1].sent_id, 2);
  SentFrame frame;
  ASSERT_TRUE(decode_qtm_frame(frame_of({turned(0), turned(0), turned(0)}), frame));
  names.translate(frame);
  EXPECT_EQ(frame.body[1].id, 1);
  EXPECT_EQ(frame.body[2].id, 0);
  EXPECT_NE(frame.body[0].id, 0);
  EXPECT_NE(frame.body[0].id, 1);
}

TEST(QtmPackets, ASimulatedServerIsUnderstood) {
  Bytes packet;
  encode_qtm_names(base_then_tip(), packet);
  BodyNames names = base_then_tip();
  const auto header = qtm_header(packet);
  ASSERT_TRUE(header);
  EXPECT_EQ(header->size, packet.size());
  EXPECT_EQ(header->kind, QtmMessage::xml);
  read_qtm_names(qtm_text(std::span(packet).subspan(kQtmHeader)), names);
  EXPECT_EQ(names.bodies()[0].sent_id, 1);
  EXPECT_EQ(names.bodies()[1].sent_id, 2);
}

TEST(QtmPackets, CutAndChangedPacketsAreRefusedOrHarmless) {
  const Bytes whole = frame_of({turned(0.2F), turned(0.3F)});
  SentFrame frame;
  for (std::size_t length = 0; length < whole.size(); ++length)
    EXPECT_FALSE(decode_qtm_frame(std::span(whole).first(length), frame));
  std::mt19937 random(1);
  for (int k = 0; k < 5000; ++k) {
    Bytes bytes = whole;
    const std::int32_t numbers[] = {-1,      INT32_MAX, INT32_MIN,
                                    1 << 28, 1000,      static_cast<std::int32_t>(random())};
    ByteWriter(bytes).put_at(random() % (bytes.size() - 4), numbers[random() % 6]);
    if (decode_qtm_frame(bytes, frame)) {
      EXPECT_LE(frame.bodies, SentFrame::kMostBodies);
    }
    std::string xml(kXml);
    xml[random() % xml.size()] = static_cast<char>(random());
    BodyNames names = base_then_tip();
    read_qtm_names(xml.substr(0, random() % xml.size()), names);
  }
}

TEST(QtmPackets, DecodingAllocatesNothing) {
  const Bytes bytes = frame_of({turned(0.2F), turned(0.3F)});
  SentFrame frame;
  BodyNames names = base_then_tip();
  const long before = test::thread_allocations;
  EXPECT_TRUE(decode_qtm_frame(bytes, frame));
  read_qtm_names(kXml, names);
  names.translate(frame);
  EXPECT_EQ(test::thread_allocations, before);
}

}  // namespace
}  // namespace softarm
