// Our reader and writer of LCM's logs against LCM's own writer, and what damage of every kind
// costs: the event it hits, and no other.
#include "softarm/transport/event_log.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <lcm/lcm-cpp.hpp>
#include <random>
#include <sstream>
#include <string>

#include "test_folder.hpp"

namespace softarm {
namespace {

struct Copy {
  std::int64_t position, number, time_us;
  std::string channel, data;
  bool operator==(const Copy&) const = default;
};

struct Reading {
  std::vector<Copy> events;
  std::vector<LogDamage> damages;
  std::int64_t damage_count = 0, damaged_bytes = 0, position = 0;
};

Reading read(const std::string& bytes) {
  std::istringstream stream(bytes);
  EventLogReader log(stream);
  Reading reading;
  for (LogEvent event; log.next(event);)
    reading.events.push_back(
        {event.position, event.number, event.time_us, std::string(event.channel),
         std::string(reinterpret_cast<const char*>(event.data.data()), event.data.size())});
  reading.damages = log.damages();
  reading.damage_count = log.damage_count();
  reading.damaged_bytes = log.damaged_bytes();
  reading.position = log.position();
  return reading;
}

/// A log as LCM itself writes it: events of all small sizes, random bytes, the empty one too.
std::string lcm_log(int events, std::size_t largest, unsigned seed = 1) {
  const TestFolder folder;
  const auto path = folder / "log";
  std::mt19937 random(seed);
  {
    lcm::LogFile log(path.string(), "w");
    for (int k = 0; k < events; ++k) {
      std::string data(random() % (largest + 1), '\0');
      for (char& byte : data) byte = static_cast<char>(random());
      lcm::LogEvent event{};
      event.timestamp = 1'000'000 + 17 * k;
      event.channel = "CHANNEL_" + std::string(1 + static_cast<std::size_t>(k) % 5, 'x');
      event.data = data.data();
      event.datalen = static_cast<std::int32_t>(data.size());
      log.writeEvent(&event);
    }
  }
  return file_text(path);
}

std::size_t end_of(const Copy& event) {
  return static_cast<std::size_t>(event.position) + 28 + event.channel.size() + event.data.size();
}

TEST(EventLog, ReadsWhatLcmWrote) {
  const std::string bytes = lcm_log(3000, 200);
  const Reading reading = read(bytes);
  ASSERT_EQ(reading.events.size(), 3000u);
  EXPECT_EQ(reading.damage_count, 0);
  EXPECT_EQ(reading.position, static_cast<std::int64_t>(bytes.size()));
  std::mt19937 random(1);
  for (std::size_t k = 0; k < 3000; ++k) {
    const Copy& event = reading.events[k];
    std::string data(random() % 201, '\0');
    for (char& byte : data) byte = static_cast<char>(random());
    ASSERT_EQ(event.number, static_cast<std::int64_t>(k));
    ASSERT_EQ(event.time_us, 1'000'000 + 17 * static_cast<std::int64_t>(k));
    ASSERT_EQ(event.channel, "CHANNEL_" + std::string(1 + k % 5, 'x'));
    ASSERT_EQ(event.data, data);
  }
}

TEST(EventLog, EventsLargerThanABlock) {
  const std::string bytes = lcm_log(12, 500'000, 3);
  const Reading reading = read(bytes);
  EXPECT_EQ(reading.events.size(), 12u);
  EXPECT_EQ(reading.damage_count, 0);
}

TEST(EventLog, CutAtEveryByteItKeepsWhatWasWhole) {
  const std::string bytes = lcm_log(12, 30);
  const Reading whole = read(bytes);
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    const Reading cut = read(bytes.substr(0, length));
    std::size_t kept = 0;
    while (kept < whole.events.size() && end_of(whole.events[kept]) <= length) ++kept;
    ASSERT_EQ(cut.events.size(), kept) << length;
    const std::size_t end = kept == 0 ? 0 : end_of(whole.events[kept - 1]);
    ASSERT_EQ(cut.damage_count, end == length ? 0 : 1) << length;
    ASSERT_EQ(cut.damaged_bytes, static_cast<std::int64_t>(length - end)) << length;
    if (cut.damage_count > 0) {
      ASSERT_EQ(cut.damages[0].begin, static_cast<std::int64_t>(end));
      ASSERT_EQ(cut.damages[0].end, static_cast<std::int64_t>(length));
    }
  }
}

TEST(EventLog, EveryChangedByteCostsNoMoreThanItsEvent) {
  const std::string bytes = lcm_log(12, 30);
  const Reading whole = read(bytes);
  for (std::size_t at = 0; at < bytes.size(); ++at)
    for (const int change : {0x01, 0x80, 0xff}) {
      std::string other = bytes;
      other[at] = static_cast<char>(other[at] ^ change);
      const Reading reading = read(other);
      for (const Copy& event : whole.events) {
        const bool hit = static_cast<std::size_t>(event.position) <= at && at < end_of(event);
        if (!hit) {
          ASSERT_EQ(std::count(reading.events.begin(), reading.events.end(), event), 1)
              << "event " << event.number << " is lost by byte " << at << " ^ " << change;
        }
      }
      ASSERT_LE(reading.events.size(), whole.events.size());
    }
}

TEST(EventLog, BytesLostAndBytesInsertedAreSteppedOver) {
  const std::string bytes = lcm_log(200, 300);
  const Reading whole = read(bytes);
  const std::size_t from = end_of(whole.events[70]) + 10, to = end_of(whole.events[75]) + 40;
  const Reading lost = read(bytes.substr(0, from) + bytes.substr(to));
  EXPECT_EQ(lost.events.size(), 200u - 6u) << "71 to 76 are hit";
  ASSERT_EQ(lost.damages.size(), 1u);
  EXPECT_EQ(lost.damages[0].begin, static_cast<std::int64_t>(from - 10));

  const std::size_t place = end_of(whole.events[99]);
  const std::string zeros(200'000, '\0');
  const Reading inserted = read(bytes.substr(0, place) + zeros + bytes.substr(place));
  EXPECT_EQ(inserted.events.size(), 200u);
  ASSERT_EQ(inserted.damages.size(), 1u);
  EXPECT_EQ(inserted.damages[0].begin, static_cast<std::int64_t>(place));
  EXPECT_EQ(inserted.damages[0].end, static_cast<std::int64_t>(place + zeros.size()));
}

TEST(EventLog, NoiseAndHostileSizesAreOnlyDamage) {
  std::mt19937 random(7);
  std::string noise(300'000, '\0');
  for (char& byte : noise) byte = static_cast<char>(random());
  const std::string sync = "\xED\xA1\xDA\x01";
  for (std::size_t at = 0; at + 40 < noise.size(); at += 40) {
    noise.replace(at, 4, sync);
    // Every length of the channel and of the data that a header may claim.
    const std::uint32_t claims[] = {0, 1, 63, 64, 0x3fffff, 0x400000, 0x7fffffff, 0xffffffff};
    for (std::size_t k = 0; k < 4; ++k) {
      noise[at + 20 + k] = static_cast<char>(claims[at / 40 % 8] >> (24 - 8 * k));
      noise[at + 24 + k] = static_cast<char>(claims[at / 320 % 8] >> (24 - 8 * k));
    }
  }
  const Reading reading = read(noise);
  EXPECT_EQ(reading.position, static_cast<std::int64_t>(noise.size()));
  EXPECT_LE(reading.damages.size(), EventLogReader::kDamagesKept);
  EXPECT_GT(reading.damaged_bytes, 250'000);
  EXPECT_EQ(read("").events.size(), 0u);
  EXPECT_EQ(read(sync).damaged_bytes, 4);
}

class WrittenLog : public ::testing::Test {
 protected:
  const TestFolder folder_;
  const std::filesystem::path path_ = folder_ / "log";
};

TEST_F(WrittenLog, IsByteForByteWhatLcmWrites) {
  const std::string expected = lcm_log(500, 300);
  {
    std::istringstream stream(expected);
    EventLogReader reader(stream);
    EventLogWriter log(path_);
    for (LogEvent event; reader.next(event);) log.write(event.time_us, event.channel, event.data);
    log.close();
  }
  EXPECT_TRUE(file_text(path_) == expected);
}

TEST_F(WrittenLog, RefusesWhatNoReaderWouldTakeAndReportsAFullDisk) {
  EventLogWriter log(path_);
  const std::vector<std::byte> data(10);
  EXPECT_THROW(log.write(0, "", data), std::invalid_argument);
  EXPECT_THROW(log.write(0, std::string(64, 'x'), data), std::invalid_argument);
  const std::vector<std::byte> much(EventLogReader::kLargestData + 1);
  EXPECT_THROW(log.write(0, "X", much), std::invalid_argument);
  log.write(0, std::string(63, 'x'), data);
  log.close();
  EXPECT_THROW(EventLogWriter("/nowhere/log"), std::runtime_error);
  EventLogWriter full("/dev/full");
  EXPECT_THROW(
      {
        full.write(0, "X", data);
        full.close();
      },
      std::runtime_error);
}

}  // namespace
}  // namespace softarm
