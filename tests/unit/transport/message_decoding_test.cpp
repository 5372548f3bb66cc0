// Bytes from a network may be anything; only exactly one message of the right type gets through.
#include "softarm/transport/message_decoding.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <random>

#include "counted_malloc.hpp"
#include "softarm/estimation/mocap_frame.hpp"
#include "unit/transport/messages.hpp"

namespace softarm {
namespace {

using namespace softarm_messages;
using test::Bytes;
using test::encoded;
using test::example;

/// Where a length stands in the encoded message, counted by hand from lcmtypes/*.lcm after the
/// eight bytes of the hash.
struct LengthField {
  std::size_t offset;
  std::size_t bytes;
};

template <class Message>
std::vector<LengthField> length_fields(const Message&) {
  return {};
}
std::vector<LengthField> length_fields(const mocap_frame_t&) { return {{24, 2}}; }
std::vector<LengthField> length_fields(const pressure_command_t&) { return {{29, 2}}; }
std::vector<LengthField> length_fields(const torque_command_t&) { return {{29, 2}}; }
std::vector<LengthField> length_fields(const pressure_measurement_t&) { return {{33, 2}}; }
std::vector<LengthField> length_fields(const curvature_reference_t&) { return {{16, 2}}; }
std::vector<LengthField> length_fields(const valves_status_t&) { return {{64, 2}}; }
std::vector<LengthField> length_fields(const observer_status_t&) { return {{82, 2}, {84, 2}}; }
std::vector<LengthField> length_fields(const plant_state_t&) { return {{17, 2}, {19, 2}}; }
std::vector<LengthField> length_fields(const law_state_t&) { return {{41, 2}, {43, 2}}; }
std::vector<LengthField> length_fields(const law_command_t&) { return {{29, 2}}; }
std::vector<LengthField> length_fields(const tick_record_t& record) {
  const auto lists = static_cast<std::size_t>(record.num_chambers + 3 * record.dimension +
                                              record.num_law + record.num_tip);
  const auto bodies = static_cast<std::size_t>(record.frames.at(0).num_bodies);
  const auto measured = static_cast<std::size_t>(record.num_measured);
  const std::size_t frame = 113 + 8 * lists + 4 * measured;
  return {{101, 2}, {103, 2}, {105, 2},        {107, 2},
          {109, 2}, {111, 2}, {frame + 16, 2}, {frame + 18 + 61 * bodies, 4}};
}
std::vector<LengthField> length_fields(const controller_status_t& status) {
  const std::size_t counts = 56 + 4 + status.version.size() + 1 + 4 + 4 + 24 + 1 + 76;
  return {{56, 4}, {counts, 2}, {counts + 2, 2}};
}

std::int64_t get(const Bytes& bytes, const LengthField& field) {
  std::uint64_t value = 0;
  for (std::size_t k = 0; k < field.bytes; ++k)
    value = value << 8 | std::to_integer<std::uint64_t>(bytes[field.offset + k]);
  return static_cast<std::int64_t>(value);
}
void put(Bytes& bytes, const LengthField& field, std::int64_t value) {
  for (std::size_t k = 0; k < field.bytes; ++k)
    bytes[field.offset + k] = static_cast<std::byte>(value >> (8 * (field.bytes - 1 - k)) & 0xff);
}

template <class Message>
class MessageDecoding : public ::testing::Test {
 protected:
  /// On the heap and no longer than it is, so that a sanitizer sees a read beyond it.
  static bool accepts(const Bytes& bytes) {
    const Bytes exact(bytes.begin(), bytes.end());
    return decode(exact, into);
  }
  static inline Message into{};
};

using AllMessages =
    ::testing::Types<mocap_frame_t, pressure_command_t, pressure_measurement_t,
                     curvature_reference_t, operator_command_t, controller_status_t, plant_state_t,
                     timing_t, tick_record_t, valves_status_t, deadman_t, rigid_transform_t,
                     torque_command_t, observer_status_t, law_state_t, law_command_t, tip_target_t>;
class MessageName {
 public:
  template <class Message>
  static std::string GetName(int) {
    return Message::getTypeName();
  }
};
TYPED_TEST_SUITE(MessageDecoding, AllMessages, MessageName);

TYPED_TEST(MessageDecoding, RoundTripsUpToTheCapacities) {
  for (const auto& [segments, chambers] : {std::pair{0, 0}, {1, 3}, {3, 4}, {10, 4}, {64, 8}}) {
    const Bytes bytes = encoded(example<TypeParam>(segments, chambers));
    ASSERT_FALSE(bytes.empty());
    TypeParam message{};
    ASSERT_TRUE(decode(bytes, message)) << segments;
    EXPECT_EQ(encoded(message), bytes) << segments;
  }
}

TYPED_TEST(MessageDecoding, TenSegmentsFitIntoOnePacket) {
  EXPECT_LT(example<TypeParam>(10, 4).getEncodedSize(), 1400);
}

TYPED_TEST(MessageDecoding, EveryTruncationAndEveryTrailIsRefused) {
  const Bytes whole = encoded(example<TypeParam>(3, 4));
  for (std::size_t length = 0; length < whole.size(); ++length)
    ASSERT_FALSE(this->accepts({whole.begin(), whole.begin() + static_cast<long>(length)}))
        << length << " of " << whole.size();
  for (const std::size_t trail : {1u, 2u, 3u, 4u, 8u, 57u, 61u, 1000u, 60'000u})
    for (const std::byte filling : {std::byte{0}, std::byte{0xff}}) {
      Bytes longer = whole;
      longer.resize(whole.size() + trail, filling);
      ASSERT_FALSE(this->accepts(longer)) << trail;
    }
  EXPECT_TRUE(this->accepts(whole));
}

TYPED_TEST(MessageDecoding, AnotherHashIsRefused) {
  const Bytes whole = encoded(example<TypeParam>(3, 4));
  for (std::size_t bit = 0; bit < 64; ++bit) {
    Bytes other = whole;
    other[bit / 8] ^= static_cast<std::byte>(1u << bit % 8);
    ASSERT_FALSE(this->accepts(other)) << bit;
  }
}

TYPED_TEST(MessageDecoding, EveryWrongLengthIsRefused) {
  for (const auto& [segments, chambers] : {std::pair{1, 3}, {3, 4}, {64, 8}}) {
    const auto message = example<TypeParam>(segments, chambers);
    const Bytes whole = encoded(message);
    for (const LengthField& field : length_fields(message)) {
      const std::int64_t right = get(whole, field);
      const std::int64_t top = std::int64_t{1} << (8 * field.bytes - 1);
      for (const std::int64_t wrong :
           {std::int64_t{-1}, std::int64_t{-2}, -top, -top + 1, top - 1, top / 2, top / 8,
            right + 1, right - 1, right + 2, right + 256, 2 * right, -right, std::int64_t{0}}) {
        if (wrong == right) continue;
        Bytes other = whole;
        put(other, field, wrong);
        ASSERT_FALSE(this->accepts(other)) << "length " << wrong << " for " << right;
        // And with as many bytes behind it as such a length might ask for.
        other.resize(whole.size() + 60'000);
        ASSERT_FALSE(this->accepts(other)) << "length " << wrong << " for " << right;
      }
    }
  }
}

// A text is its length, its letters and a byte 0: what ends otherwise, or holds another 0, would be
// another text once it is encoded again. Letters that a terminal obeys are refused too.
TEST(MessageDecoding, TextsThatDoNotEndWhereTheySayAreRefused) {
  const auto refused = [](const auto& message, std::size_t length_at, std::size_t length) {
    const Bytes whole = encoded(message);
    auto into = message;
    ASSERT_TRUE(decode(whole, into));
    ASSERT_EQ(get(whole, {length_at, 4}), static_cast<std::int64_t>(length) + 1);
    Bytes endless = whole;
    endless[length_at + 4 + length] = std::byte{'x'};
    EXPECT_FALSE(decode(endless, into));
    for (std::size_t k = 0; k < length; ++k) {
      Bytes broken = whole;
      for (const int letter : {0, 1, 7, 10, 27, 127, 128, 155, 255}) {  // 27, 155: of terminals
        broken[length_at + 4 + k] = static_cast<std::byte>(letter);
        ASSERT_FALSE(decode(broken, into)) << k << ' ' << letter;
      }
    }
  };
  const auto status = example<controller_status_t>(3, 4);
  refused(status, length_fields(status)[0].offset, status.version.size());
  const auto record = example<tick_record_t>(3, 4);
  refused(record, length_fields(record)[7].offset, record.build.size());
}

// A length beyond this project's capacities is refused even where the bytes are all there.
TYPED_TEST(MessageDecoding, MoreThanTheCapacitiesIsRefused) {
  if (length_fields(example<TypeParam>(1, 1)).empty()) GTEST_SKIP() << "a message of fixed size";
  EXPECT_FALSE(this->accepts(encoded(example<TypeParam>(4 * kMaxBodies + 1, 8))));
}

TYPED_TEST(MessageDecoding, RandomBytesAreRefused) {
  std::mt19937 random(1);
  const Bytes whole = encoded(example<TypeParam>(3, 4));
  Bytes noise;
  for (int k = 0; k < 100'000; ++k) {
    noise.resize(std::uniform_int_distribution<std::size_t>(0, 2 * whole.size())(random));
    for (auto& byte : noise) byte = static_cast<std::byte>(random());
    // Half of them begin like the real thing.
    if (k % 2 == 0)
      std::copy_n(whole.begin(), std::min<std::size_t>(8, noise.size()), noise.begin());
    TypeParam& message = this->into;
    if (decode(Bytes(noise), message)) {  // a copy that ends where the bytes do
      // A fixed size and the right hash are enough; then everything was a value.
      ASSERT_EQ(k % 2, 0);
      ASSERT_EQ(static_cast<std::size_t>(message.getEncodedSize()), noise.size());
    }
  }
}

TYPED_TEST(MessageDecoding, MutationsAreRefusedOrStillOneWholeMessage) {
  std::mt19937 random(2);
  const auto below = [&](std::size_t end) {
    return std::uniform_int_distribution<std::size_t>(0, end - 1)(random);
  };
  const Bytes whole = encoded(example<TypeParam>(3, 4));
  int accepted = 0;
  for (int k = 0; k < 100'000; ++k) {
    Bytes mutant = whole;
    for (std::size_t edits = 1 + below(4); edits-- > 0 && !mutant.empty();) {
      const std::size_t at = below(mutant.size());
      switch (below(4)) {
        case 0:
          mutant[at] = static_cast<std::byte>(random());
          break;
        case 1:
          mutant[at] ^= static_cast<std::byte>(1u << below(8));
          break;
        case 2:
          mutant.resize(at);
          break;
        default:
          mutant.insert(mutant.begin() + static_cast<long>(at), below(9), std::byte{0x7f});
          break;
      }
    }
    TypeParam& message = this->into;
    if (decode(Bytes(mutant), message)) {
      ++accepted;
      ASSERT_EQ(static_cast<std::size_t>(message.getEncodedSize()), mutant.size());
    }
  }
  EXPECT_GT(accepted, 100) << "changed values are no fault of form";
}

TYPED_TEST(MessageDecoding, DecodingAgainAllocatesNothing) {
  const Bytes whole = encoded(example<TypeParam>(10, 4));
  Bytes broken = whole;
  broken.pop_back();
  TypeParam message{};
  ASSERT_TRUE(decode(whole, message));
  const long before = test::allocations;
  for (int k = 0; k < 1000; ++k) {
    const bool right = decode(whole, message);
    const bool wrong = decode(broken, message);
    if (!right || wrong) FAIL();
  }
  EXPECT_EQ(test::allocations - before, 0);
}

}  // namespace
}  // namespace softarm
