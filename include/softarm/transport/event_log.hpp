// LCM event logs (lcm-logger): reading, including damaged ones, and writing.
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

#include "softarm/base/output_file.hpp"
#include "softarm/base/time.hpp"

namespace softarm {

/// One logged message; channel and data are valid until the next one is read.
struct LogEvent {
  std::int64_t position = 0;  ///< byte offset in the log
  std::int64_t number = 0;    ///< event number, counted by the logger
  std::int64_t time_us = 0;   ///< arrival at the logger, on its wall clock; arbitrary if damaged
  std::string_view channel;
  std::span<const std::byte> data;

  /// time_us in ns; empty if it is negative or too large to calculate with in ns (is_time_us).
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

/// Reads a log event by event. An event is accepted if its sizes lead to the sync word of the next
/// event or to the end of the log, or, where damage follows, if no other sync word begins within
/// it. After damage, reading continues at the next sync word that begins an event. Reads forward
/// only; holds one event and a block of 64 KiB, whatever sizes the bytes claim.
class EventLogReader {
 public:
  static constexpr std::size_t kLargestChannel = 63;    ///< bytes; the limit of LCM
  static constexpr std::size_t kLargestData = 4 << 20;  ///< bytes; larger events count as damage
  static constexpr std::size_t kDamagesKept = 16;       ///< in damages()

  /// @throws std::runtime_error if the file cannot be read
  explicit EventLogReader(const std::filesystem::path& path);
  /// Reads from a stream, which must outlive the reader.
  explicit EventLogReader(std::istream& stream) : stream_(stream) {}

  /// Reads the next whole event; false at the end of the log.
  bool next(LogEvent& event);

  /// Bytes of the log read so far.
  std::int64_t position() const { return base_ + static_cast<std::int64_t>(at_); }
  /// The first kDamagesKept damaged ranges found so far, in order.
  const std::vector<LogDamage>& damages() const { return damages_; }
  /// Number of damaged ranges found so far.
  std::int64_t damage_count() const { return damage_count_; }
  /// Total size of the damaged ranges, in bytes.
  std::int64_t damaged_bytes() const { return damaged_bytes_; }
  /// A summary for a person; empty if nothing is damaged.
  std::string damage_text() const;

 private:
  std::size_t available(std::size_t wanted);
  bool sync_at(std::size_t offset) const;
  bool meets_sync(std::size_t size);
  std::size_t plausible_size();
  void skip_to_sync();
  void add_damage(std::int64_t begin, std::int64_t end);

  std::ifstream file_;
  std::istream& stream_;
  std::vector<std::byte> buffer_;
  std::size_t at_ = 0;         ///< cursor in the buffer: bytes before it have been read
  std::int64_t base_ = 0;      ///< position of the buffer's first byte in the log
  std::size_t event_ = 0;      ///< size of the event returned last, still in the buffer
  std::int64_t searched_ = 0;  ///< no sync word begins in (position, searched_) of the log
  std::vector<LogDamage> damages_;
  std::int64_t damage_count_ = 0;
  std::int64_t damaged_bytes_ = 0;
};

/// Writes a log for lcm-logplayer and EventLogReader. Events are numbered from 0.
class EventLogWriter {
 public:
  /// Replaces an existing file at the end. @param inputs  files that are read
  /// @param kind  record: what was written is kept, even without close()
  /// @throws OutputIsInput, OutputError if it cannot be opened
  explicit EventLogWriter(const std::filesystem::path& file, const Files& inputs = {},
                          OutputFile::Kind kind = OutputFile::Kind::record)
      : file_(file, inputs, kind) {}

  /// Appends an event.
  /// @param time_us  arrival on the wall clock, as in the logs of lcm-logger
  /// @param channel  1 to EventLogReader::kLargestChannel bytes
  /// @param data  up to EventLogReader::kLargestData bytes
  /// @throws std::invalid_argument for other sizes; OutputError if the file could not be written,
  /// which then ends with the last whole event
  void write(std::int64_t time_us, std::string_view channel, std::span<const std::byte> data);

  /// Ends the log; the file is complete afterwards. @throws OutputError if it is not
  void close() { file_.commit(); }

 private:
  OutputFile file_;
  std::string event_;
  std::int64_t number_ = 0;
};

}  // namespace softarm
