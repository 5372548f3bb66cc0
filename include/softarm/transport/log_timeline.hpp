// One time line for the messages of a log, whatever was done to the clock of the computer that logged.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "softarm/base/time.hpp"
#include "softarm/transport/event_log.hpp"
#include "softarm/transport/mocap_format.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {

/// Where the logger's clock did not simply run on.
struct LogBreak {
  /// What happened.
  enum class Kind {
    clock_set,  ///< the clock was set, or a stamp damaged: the messages' own times bridge it
    gap,        ///< nothing came for longer than LogTimeline::kLongestGap_ns
    restart     ///< the messages' own clocks begin again too: the time between is not known
  };
  Kind kind;
  std::int64_t position;  ///< byte of the first event after it
  double seconds;         ///< by which the clock was set, or that nothing came; 0: not known
};

/// Arrival times of a log's events on a line that never runs back. The logger stamps events with a
/// wall clock, which may be set, or start in 1970; the messages carry the monotonic clock of their
/// sender. As long as both agree, an event's time is its stamp. Where they do not, the messages' own
/// clock counts: that of softarm's programs at once, that of motion capture where the stamps jump.
/// Gaps are shortened to kLongestGap_ns.
class LogTimeline {
 public:
  static constexpr std::int64_t kLongestGap_ns = 10'000'000'000;
  static constexpr std::size_t kBreaksKept = 16;  ///< in breaks()

  explicit LogTimeline(const TransportSettings& transport);

  /// The arrival of an event, events in the order of the log; empty on a channel that carries no
  /// time, or for a stamp that is none (LogEvent::arrival_ns).
  std::optional<std::int64_t> arrival_ns(const LogEvent& event);

  /// The first kBreaksKept breaks.
  const std::vector<LogBreak>& breaks() const { return breaks_; }
  /// Whether two parts have an unknown time between them.
  bool restarted() const { return restarted_; }
  /// A summary for a person, with byte positions; empty where the clock simply ran on.
  std::string text() const;

 private:
  struct Source {
    std::string channel;
    std::size_t own_at;  ///< byte of the sender's time in a message; 0: as the mocap format has it
    std::int64_t own_unit_ns;                 ///< one unit of it
    bool monotonic;                           ///< a clock that nobody sets
    std::optional<std::int64_t> own_ns = {};  ///< of its newest message
    std::int64_t line_ns = 0;                 ///< arrival of that message
    bool runs = false;                        ///< has been seen to advance
  };

  Source* find(std::string_view channel);
  std::optional<std::int64_t> own_ns(const Source& source, std::span<const std::byte> data);
  std::int64_t place(Source& source, std::optional<std::int64_t> own_ns, std::int64_t stamp_ns,
                     std::int64_t position);
  std::int64_t bridged(std::int64_t line_ns, std::int64_t stamp_ns, std::int64_t position);
  std::int64_t after_gap(std::int64_t passed_ns, std::int64_t stamp_ns, std::int64_t position);
  std::int64_t restart(std::int64_t stamp_ns, std::int64_t position);
  bool confirmed(std::int64_t error_ns);
  void add(LogBreak::Kind kind, std::int64_t position, std::int64_t length_ns);

  std::vector<Source> sources_;
  std::unique_ptr<MocapFormat> format_;
  std::unique_ptr<SentFrame> sent_;
  bool started_ = false, restarted_ = false;
  std::int64_t shift_ns_ = 0;   ///< stamp minus line
  std::int64_t newest_ns_ = 0;  ///< on the line
  int held_ = 0;                ///< events in a row that waited for a message with a clock
  std::int64_t suspected_ns_ = 0;
  bool undecided_ = false;  ///< the newest message may have shown that the clock was set
  int disagreements_ = 0;
  int suspicions_ = 0;  ///< events in a row by whose clocks the line is suspected_ns_ ahead
  std::vector<LogBreak> breaks_;
  std::int64_t count_ = 0;
};

}  // namespace softarm
