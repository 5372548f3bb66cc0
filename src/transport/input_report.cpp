#include "softarm/transport/input_report.hpp"

#include <fmt/format.h>

namespace softarm {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
/// Times a second that numbers jump back with one sender: packets overtake each other now and then,
/// and a sender may start again.
constexpr std::int64_t kTolerated = 10;

}  // namespace

std::string_view InputReport::refusals(std::int64_t now_ns, const Counts& counts) noexcept {
  if (reported_ns_ == kNever) reported_ns_ = now_ns;
  if (now_ns - reported_ns_ < kSecond_ns) return {};
  reported_ns_ = now_ns;
  const FrameCounters& now = counts.frames;
  const std::int64_t late = counts.late_frames - late_before_;
  const std::int64_t stale = now.stale - before_.stale;
  const std::int64_t refused = now.rejected() - before_.rejected() + late;
  const std::int64_t accepted = now.accepted - before_.accepted;
  std::string_view text;
  if (counts.mode != Mode::active && (refused > 0 || stale > 0)) {
    char* end = text_.data();
    char* const last = text_.data() + text_.size();
    const auto put = [&](auto format, const auto&... values) {
      end = fmt::format_to_n(end, static_cast<std::size_t>(last - end), format, values...).out;
    };
    put(FMT_STRING("{} of {} frames refused in a second:"), refused, refused + accepted);
    for (int k = 1; k < kFrameVerdicts; ++k) {
      const auto verdict = static_cast<FrameVerdict>(k);
      const std::int64_t count = now.of(verdict) - before_.of(verdict);
      if (verdict != FrameVerdict::repeated && count > 0)
        put(FMT_STRING(" {} {},"), count, name(verdict));
    }
    if (late > 0) put(FMT_STRING(" {} too old,"), late);
    if (stale > 0) put(FMT_STRING(" {} in which a body repeats an old pose,"), stale);
    text = {text_.data(), static_cast<std::size_t>(end - text_.data()) - 1};  // without the comma
  }
  before_ = now;
  late_before_ = counts.late_frames;
  return text;
}

template <class Verdict, int verdicts>
std::string_view InputReport::refused(std::int64_t now_ns, const char* what,
                                      const VerdictCounts<verdicts>& now,
                                      Refused<verdicts>& last) noexcept {
  if (last.reported_ns == kNever) last.reported_ns = now_ns;
  if (now_ns - last.reported_ns < kSecond_ns) return {};
  last.reported_ns = now_ns;
  char* end = text_.data();
  char* const limit = text_.data() + text_.size();
  for (std::size_t k = 1; k < now.size(); ++k) {  // 0: accepted
    const std::int64_t count = now[k] - last.before[k];
    if (count == 0) continue;
    end = fmt::format_to_n(end, static_cast<std::size_t>(limit - end), FMT_STRING("{} {} {}"),
                           end == text_.data() ? what : ",", count, name(static_cast<Verdict>(k)))
              .out;
  }
  last.before = now;
  return {text_.data(), static_cast<std::size_t>(end - text_.data())};
}

std::string_view InputReport::refused_references(std::int64_t now_ns,
                                                 const Counts& counts) noexcept {
  return refused<LiveVerdict, kLiveVerdicts>(
      now_ns, "live references refused in a second:", counts.live, live_);
}

std::string_view InputReport::refused_answers(std::int64_t now_ns, const Counts& counts) noexcept {
  return refused<LawVerdict, kLawVerdicts>(
      now_ns, "answers of the law refused in a second:", counts.answers, answers_);
}

std::string_view InputReport::backward(std::int64_t now_ns, const Backward& now,
                                       std::int64_t tolerated, Window& window) noexcept {
  if (window.begin_ns == kNever) window = {now_ns, now.count, false};
  if (now_ns - window.begin_ns < kSecond_ns) return {};
  const std::int64_t times = now.count - window.before;
  window.begin_ns = now_ns;
  window.before = now.count;
  if (window.reported || times <= tolerated) return {};
  window.reported = true;
  const auto end =
      fmt::format_to_n(text_.data(), text_.size(),
                       FMT_STRING("two senders on {}? Numbers jumped back {} times in a second"),
                       now.channel, times);
  return {text_.data(), static_cast<std::size_t>(end.out - text_.data())};
}

std::string_view InputReport::second_sender(std::int64_t now_ns, const Counts& counts) noexcept {
  const Backward frames{counts.frame_channel,
                        counts.frames.out_of_order + 4 * counts.frames.restarted};
  const Backward* const streams[] = {&frames, &counts.measurements, &counts.references};
  for (std::size_t k = 0; k < windows_.size(); ++k)
    if (const auto text = backward(now_ns, *streams[k], kTolerated, windows_[k]); !text.empty())
      return text;
  return {};
}

}  // namespace softarm
