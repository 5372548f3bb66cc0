// Event logs: every byte is in one event or in one damaged range, events are read as written, and
// damage costs nothing of what precedes it.
#include <sstream>

#include "fuzz/target.hpp"
#include "softarm/transport/event_log.hpp"
#include "unit/recording/recorded_log.hpp"

namespace softarm::test {
namespace {

constexpr std::size_t kHeader = 28;

struct Reading {
  std::vector<std::int64_t> positions;
  std::int64_t bytes = 0;  ///< in events
};

Reading read_checked(const std::string& text) {
  std::istringstream stream(text);
  EventLogReader log(stream);
  Reading reading;
  std::int64_t end = 0;
  for (LogEvent event; log.next(event);) {
    require(event.position >= end, "events stand in order and do not overlap");
    const auto size = static_cast<std::int64_t>(kHeader + event.channel.size() + event.data.size());
    end = event.position + size;
    require(end <= static_cast<std::int64_t>(text.size()), "an event ends within the log");
    const std::string_view there = std::string_view(text).substr(
        static_cast<std::size_t>(event.position), static_cast<std::size_t>(size));
    require(there.substr(kHeader, event.channel.size()) == event.channel,
            "the channel stands there");
    require(
        there.substr(kHeader + event.channel.size()) ==
            std::string_view(reinterpret_cast<const char*>(event.data.data()), event.data.size()),
        "the data stand there");
    reading.positions.push_back(event.position);
    reading.bytes += size;
  }
  require(log.position() == static_cast<std::int64_t>(text.size()), "the log is read to its end");
  require(reading.bytes + log.damaged_bytes() == log.position(),
          "every byte is of an event or damaged");
  require(log.damage_text().empty() == (log.damaged_bytes() == 0), "damage is reported");
  return reading;
}

std::string whole_log() {
  LogBytes log;
  log.add("A", to_bytes(std::string("one")));
  log.add("SOFTARM_STATUS", to_bytes(std::string(40, 'x')));
  log.add(std::string(63, 'c'), {});
  return log.bytes;
}

}  // namespace

void run_log(std::span<const std::byte> input) {
  const std::string text = to_text(input);
  read_checked(text);
  static const std::string kBefore = whole_log();
  static const Reading kWhole = read_checked(kBefore);
  const Reading both = read_checked(kBefore + text);
  require(both.positions.size() >= kWhole.positions.size() &&
              std::equal(kWhole.positions.begin(), kWhole.positions.end(), both.positions.begin()),
          "what precedes damage is returned");
}

std::vector<Bytes> log_seeds() {
  LogBytes nested;  // a log within an event
  nested.add("LOG", to_bytes(whole_log()));
  nested.add("B", {});
  return {to_bytes(whole_log()), to_bytes(nested.bytes), to_bytes(whole_log().substr(0, 90))};
}

std::vector<std::string> log_words() {
  return {"\xED\xA1\xDA\x01",
          std::string("\xED\xA1\xDA\x01\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\1\0\0\0\0A", 29),
          std::string("\0\0\0\0", 4),
          std::string("\0\0\0\1", 4),
          std::string("\0\0\0\x3f", 4),
          std::string("\0\0\0\x40", 4),
          std::string("\0\x40\0\0", 4),
          "\x7f\xff\xff\xff",
          "\xff\xff\xff\xff"};
}

}  // namespace softarm::test
