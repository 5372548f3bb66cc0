#include "softarm/transport/log_timeline.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

#include "softarm/transport/mocap_source.hpp"
#include "transport/byte_cursor.hpp"

namespace softarm {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kBack_ns = 5 * kMs;       ///< stamps of several senders cross by less
constexpr std::int64_t kForward_ns = 300 * kMs;  ///< without any message: a gap, or a clock set
constexpr std::int64_t kAgree_ns = 20 * kMs;     ///< a sender's clock and the stamps
constexpr std::int64_t kMocapAgree_ns = 100 * kMs;
constexpr std::int64_t kLongest_ns = 30LL * 86'400 * 1000 * kMs;  ///< of a clock that ran on
constexpr std::int64_t kAlive_ns = 1000 * kMs;                    ///< since its newest message
constexpr std::int64_t kLongestStop_ns = 300 * kMs;
constexpr int kConfirmations = 3;
constexpr int kLongestHold = 64;

// Bytes of the messages: 8 of the type's fingerprint, then its members.
constexpr std::size_t kFirst = 8, kSecond = 16, kFourth = 32;

}  // namespace

LogTimeline::LogTimeline(const TransportSettings& transport)
    : format_(transport.mocap.source.make()), sent_(std::make_unique<SentFrame>()) {
  const LcmSettings& lcm = transport.lcm;
  sources_ = {
      {lcm.command_channel, kSecond, 1000, true}, {lcm.measurement_channel, kSecond, 1000, true},
      {lcm.status_channel, kFirst, 1000, true},   {lcm.timing_channel, kFirst, 1000, true},
      {lcm.observer_channel, kFirst, 1000, true}, {lcm.valves_channel, kFirst, 1000, true},
      {lcm.plant_channel, kFirst, 1000, true},    {lcm.tick_channel, kFourth, 1, true}};
  for (const std::string& channel : mocap_channels(transport))
    sources_.push_back({channel, 0, 1000, false});
}

LogTimeline::Source* LogTimeline::find(std::string_view channel) {
  const auto at = std::find_if(sources_.begin(), sources_.end(), [&](const Source& each) {
    return !each.channel.empty() && each.channel == channel;
  });
  return at == sources_.end() ? nullptr : &*at;
}

std::optional<std::int64_t> LogTimeline::own_ns(const Source& source,
                                                std::span<const std::byte> data) {
  std::int64_t own = 0;
  if (source.own_at == 0) {
    if (!format_->decode(data, *sent_)) return std::nullopt;
    own = sent_->sender_time_us;
  } else {
    BigEndianCursor cursor(data);
    cursor.skip(source.own_at);
    own = cursor.take<std::int64_t>();
    if (!cursor.ok()) return std::nullopt;
  }
  if (!is_time_us(source.own_unit_ns == 1 ? own / 1000 : own)) return std::nullopt;
  return own * source.own_unit_ns;
}

std::optional<std::int64_t> LogTimeline::arrival_ns(const LogEvent& event) {
  Source* const source = find(event.channel);
  const auto stamp_ns = event.arrival_ns();
  if (source == nullptr || !stamp_ns) return std::nullopt;
  const auto own = own_ns(*source, event.data);
  if (!started_) {
    started_ = true;
    newest_ns_ = *stamp_ns;
  }
  const std::int64_t placed_ns = place(*source, own, *stamp_ns, event.position);
  const std::int64_t line_ns = std::max(newest_ns_, placed_ns);
  newest_ns_ = line_ns;
  if (own && own != source->own_ns && !undecided_) {
    source->runs = source->own_ns && *own > *source->own_ns;
    source->own_ns = own;
    source->line_ns = placed_ns;
  }
  return line_ns;
}

std::int64_t LogTimeline::place(Source& source, std::optional<std::int64_t> own_ns,
                                std::int64_t stamp_ns, std::int64_t position) {
  const std::int64_t guess_ns = stamp_ns - shift_ns_, passed_ns = guess_ns - newest_ns_;
  const bool jumps = passed_ns < -kBack_ns || passed_ns > kForward_ns;
  const bool dated = own_ns && source.own_ns;
  const std::int64_t advance_ns = dated ? *own_ns - *source.own_ns : 0;
  const bool clocked = source.runs && advance_ns > 0 && advance_ns < kLongest_ns;
  const std::int64_t own_line_ns = source.line_ns + advance_ns;
  const bool agree = clocked && std::abs(guess_ns - own_line_ns) <=
                                    (source.monotonic ? kAgree_ns : kMocapAgree_ns);
  undecided_ = false;
  if (!jumps) {
    held_ = 0;
    if (!source.monotonic || !clocked) return guess_ns;
    if (agree) {
      suspicions_ = disagreements_ = 0;
    } else if (confirmed(guess_ns - own_line_ns)) {
      return bridged(own_line_ns, stamp_ns, position);
    } else {
      undecided_ =
          ++disagreements_ < kLongestHold;  // the last message that agreed is compared with
    }
    return guess_ns;
  }
  // Motion capture may be stamped by the clock that was set: a message of ours decides.
  const bool decides =
      source.monotonic || held_ >= kLongestHold ||
      std::none_of(sources_.begin(), sources_.end(), [&](const Source& each) {
        return each.monotonic && each.runs && newest_ns_ - each.line_ns < kAlive_ns;
      });
  if (decides && agree) return after_gap(passed_ns, stamp_ns, position);
  if (decides && clocked) return bridged(own_line_ns, stamp_ns, position);
  if (decides && source.runs && dated && advance_ns != 0) return restart(stamp_ns, position);
  const bool any_runs =
      std::any_of(sources_.begin(), sources_.end(), [](const Source& each) { return each.runs; });
  if (any_runs && held_ < kLongestHold) {
    ++held_;
    return newest_ns_;
  }
  return passed_ns > 0 && passed_ns <= kLongestGap_ns ? after_gap(passed_ns, stamp_ns, position)
                                                      : restart(stamp_ns, position);
}

std::int64_t LogTimeline::after_gap(std::int64_t passed_ns, std::int64_t stamp_ns,
                                    std::int64_t position) {
  held_ = 0;
  if (passed_ns > kLongestGap_ns) {
    shift_ns_ += passed_ns - kLongestGap_ns;
    add(LogBreak::Kind::gap, position, passed_ns);
  }
  return stamp_ns - shift_ns_;
}

/// The clock was set: the line runs on by the messages' own time.
std::int64_t LogTimeline::bridged(std::int64_t line_ns, std::int64_t stamp_ns,
                                  std::int64_t position) {
  const std::int64_t step_ns = stamp_ns - shift_ns_ - line_ns;
  // Not long before what has come: the line would stand still until then.
  const std::int64_t placed_ns =
      std::clamp(line_ns, newest_ns_ - kLongestStop_ns, newest_ns_ + kLongestGap_ns);
  shift_ns_ = stamp_ns - placed_ns;
  held_ = suspicions_ = disagreements_ = 0;
  add(LogBreak::Kind::clock_set, position, step_ns);
  if (line_ns > placed_ns) add(LogBreak::Kind::gap, position, line_ns - newest_ns_);
  return placed_ns;
}

/// Another recording begins, or the clock was set and nothing bridges it.
std::int64_t LogTimeline::restart(std::int64_t stamp_ns, std::int64_t position) {
  for (Source& each : sources_) each.runs = false;
  held_ = suspicions_ = 0;
  shift_ns_ = stamp_ns - (newest_ns_ + kLongestGap_ns);
  restarted_ = true;
  add(LogBreak::Kind::restart, position, 0);
  return newest_ns_ + kLongestGap_ns;
}

/// Whether several messages in a row agree by how much the stamps are off.
bool LogTimeline::confirmed(std::int64_t error_ns) {
  suspicions_ = std::abs(error_ns - suspected_ns_) <= kAgree_ns ? suspicions_ + 1 : 1;
  suspected_ns_ = error_ns;
  return suspicions_ > kConfirmations;
}

void LogTimeline::add(LogBreak::Kind kind, std::int64_t position, std::int64_t length_ns) {
  ++count_;
  if (breaks_.size() < kBreaksKept) breaks_.push_back({kind, position, to_seconds(length_ns)});
}

std::string LogTimeline::text() const {
  std::string text;
  const auto add = [&text](auto format, const auto&... values) {
    text += (text.empty() ? "" : "; ") + fmt::format(format, values...);
  };
  for (const LogBreak& each : breaks_) {
    if (each.kind == LogBreak::Kind::clock_set)
      add(FMT_STRING("the logger's clock was set by {:+.3f} s at byte {} (the messages' own times "
                     "are used)"),
          each.seconds, each.position);
    else if (each.kind == LogBreak::Kind::gap)
      add(FMT_STRING("nothing was logged for {:.1f} s before byte {}"), each.seconds,
          each.position);
    else
      add(FMT_STRING("all clocks begin again at byte {}: another recording was appended, or the "
                     "clock was set; the time between is not known"),
          each.position);
  }
  const auto more = count_ - static_cast<std::int64_t>(breaks_.size());
  if (more > 0) add(FMT_STRING("and {} more"), more);
  return text;
}

}  // namespace softarm
