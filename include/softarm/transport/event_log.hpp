// LCM's event logs (lcm-logger): reading them, damaged ones too, and writing them.
//
//   EventLogReader log(path);
//   for (LogEvent event; log.next(event);) use(event.channel, event.data);
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <istream>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "softarm/base/time.hpp"

namespace softarm {

/// One logged message; channel and data are valid until the next is read.
struct LogEvent {
  std::int64_t position = 0;  ///< of its first byte in the log
  std::int64_t number = 0;    ///< as the logger counted
  std::int64_t time_us = 0;   ///< arrival at the logger, its wall clock; any number if damaged
  std::string_view channel;
  std::span<const std::byte> data;

  /// The same in ns; nothing where it is no time whose nanoseconds can be added and subtracted.
  std::optional<std::int64_t> arrival_ns() const noexcept {
    if (time_us < 0 || !is_time_us(time_us)) return std::nullopt;
    return 1000 * time_us;
  }
};

/// Bytes [begin, end) of a log that belong to no event.
struct LogDamage {
  std::int64_t begin = 0;
  std::int64_t end = 0;
};

/// An event is believed where its sizes lead to the next event's sync word or to the end of the
/// log, or, where damage follows, where no other sync word begins within them. After damage reading
/// goes on at the next sync word that begins an event. Reads forward only; holds one event and a
/// block of 64 KiB, whatever the bytes claim.
class EventLogReader {
 public:
  static constexpr std::size_t kLargestChannel = 63;    ///< LCM's own limit
  static constexpr std::size_t kLargestData = 4 << 20;  ///< larger ones count as damage
  static constexpr std::size_t kDamagesKept = 16;

  /// @throws std::runtime_error where the file cannot be read
  explicit EventLogReader(const std::filesystem::path& path);
  /// The stream must outlive the reader.
  explicit EventLogReader(std::istream& stream) : stream_(stream) {}

  /// The next whole event; false at the end of the log.
  bool next(LogEvent& event);

  /// Bytes of the log read so far.
  std::int64_t position() const { return base_ + static_cast<std::int64_t>(at_); }
  /// The first kDamagesKept stretches of damage met so far, in order.
  const std::vector<LogDamage>& damages() const { return damages_; }
  std::int64_t damage_count() const { return damage_count_; }
  std::int64_t damaged_bytes() const { return damaged_bytes_; }
  /// For people; empty where nothing is damaged.
  std::string damage_text() const;

 private:
  std::size_t available(std::size_t wanted);
  bool sync_at(std::size_t offset) const;
  bool meets_sync(std::size_t size);
  std::size_t believable_size();
  void skip_to_sync();
  void add_damage(std::int64_t begin, std::int64_t end);

  std::ifstream file_;
  std::istream& stream_;
  std::vector<std::byte> buffer_;
  std::size_t at_ = 0;         ///< of the buffer: what precedes it has been read
  std::int64_t base_ = 0;      ///< position of the buffer's first byte in the log
  std::size_t event_ = 0;      ///< size of the event handed out last, still in the buffer
  std::int64_t searched_ = 0;  ///< no sync word begins in (position, searched_) of the log
  std::vector<LogDamage> damages_;
  std::int64_t damage_count_ = 0;
  std::int64_t damaged_bytes_ = 0;
};

/// Writes a log that lcm-logplayer and EventLogReader read. Events are numbered from 0.
class EventLogWriter {
 public:
  /// What was there before is overwritten. @throws std::runtime_error if it cannot be opened
  explicit EventLogWriter(const std::filesystem::path& file);

  /// @param time_us  arrival, wall clock, as the logs of lcm-logger have it
  /// @param channel  1 to EventLogReader::kLargestChannel bytes  @param data  up to kLargestData
  /// @throws std::invalid_argument for others; std::runtime_error if the file could not be written
  void write(std::int64_t time_us, std::string_view channel, std::span<const std::byte> data);

  /// Everything is in the file after this, or it throws std::runtime_error. Writes nothing further.
  void close();

 private:
  void check();

  std::filesystem::path path_;
  std::ofstream file_;
  std::int64_t number_ = 0;
};

}  // namespace softarm
