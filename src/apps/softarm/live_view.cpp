#include "apps/softarm/live_view.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "apps/program.hpp"
#include "softarm/base/clock.hpp"
#include "softarm/base/time.hpp"

namespace softarm {
namespace {

constexpr std::int64_t kPeriod_ns = 200'000'000;
constexpr std::int64_t kRateSpan_ns = 1'000'000'000;
constexpr int kShownSegments = 12;

std::string flag_text(const ArmStatus& status) {
  const std::pair<bool, const char*> flags[] = {
      {status.saturated, "saturated"},
      {status.slew_limited, "slew limited"},
      {status.reference_limited, "reference limited"},
      {status.soft_limit, "soft limit"},
      {status.shadow, "shadow"},
      {status.armed, "armed"},
      {status.bounded, "bounded"},
      {status.length_warning, "length not as configured"}};
  std::string text;
  for (const auto& [set, name] : flags)
    if (set) text += fmt::format("   {}", name);
  return text;
}

}  // namespace

bool LiveView::due() const {
  return isatty(STDERR_FILENO) != 0 && monotonic_now_ns() - drawn_ns_ >= kPeriod_ns;
}

void LiveView::draw(const StatusRecord& record) {
  const ArmStatus& status = record.status();
  update_rates(record);
  std::string text = fmt::format(
      "{:.1f} s   {}{}{}\nstatus {:.1f} Hz   frames {:.1f} Hz, {:.1f} ms old\n"
      "frames {} accepted, {} rejected, {} repeated, {} missing   ticks {} missed   messages {} "
      "malformed\n",
      record.time_s(), status.text(), flag_text(status),
      status.version.empty() ? "" : "   softarmd " + status.version, status_hz_, frames_hz_,
      1e3 * status.frame_age_s, status.frames_accepted, status.frames_rejected,
      status.frames_repeated, status.frames_missing, status.overruns, status.messages_malformed);
  text += input_text(status);
  const bool torque = experiment_.actuation.kind == ActuationKind::torque;
  const bool stretches = status.elongation_m.size() > 0;
  text += fmt::format("segment   theta [rad]   phi [rad]   error of u [mrad]   {}{}\n",
                      stretches ? "elongation [mm]   error [mm]   " : "",
                      torque ? "moments [N m]" : "pressures [bar]");
  for (int i = 0; i < std::min(status.segments(), kShownSegments); ++i)
    text += segment_text(status, i);
  if (status.segments() > kShownSegments)
    text += fmt::format("... {} segments more\n", status.segments() - kShownSegments);
  softarm::draw(lines_ > 0 ? fmt::format("\033[{}A\033[J", lines_) : "", text);
  lines_ = std::count(text.begin(), text.end(), '\n');
  drawn_ns_ = monotonic_now_ns();
}

std::string LiveView::input_text(const ArmStatus& status) {
  std::string refused;
  const auto count = [&refused]<class Verdict>(const char* what, const auto& counts, Verdict) {
    for (std::size_t k = 1; k < counts.size(); ++k)
      if (counts[k] > 0)
        refused += fmt::format("   {} {} {}", what, counts[k], name(static_cast<Verdict>(k)));
  };
  count("reference", status.references_refused, LiveVerdict{});
  count("law", status.law_answers, LawVerdict{});
  std::string text;
  if (status.law_answers[0] > 0)
    text += fmt::format("law {} answers, the newest after {:.2f} ms\n", status.law_answers[0],
                        1e3 * status.law_round_trip_s);
  if (!refused.empty()) text += fmt::format("refused{}\n", refused);
  return text;
}

std::string LiveView::segment_text(const ArmStatus& status, int segment) const {
  std::string text = fmt::format("{:7}   {:11.3f}   {:+9.3f}   ", segment + 1,
                                 status.theta_rad[segment], status.phi_rad[segment]);
  if (status.mode == Mode::active) {
    const Eigen::Vector2d error_rad =
        (status.reference_u_rad - status.u_rad).segment<2>(2 * segment);
    text += fmt::format("{:17.2f}  ", 1e3 * error_rad.norm());
  } else {
    text += fmt::format("{:>17}  ", "-");
  }
  if (status.elongation_m.size() > 0) {
    text += fmt::format("{:15.2f}   ", 1e3 * status.elongation_m[segment]);
    const double error_m = status.reference_elongation_m[segment] - status.elongation_m[segment];
    text += std::isfinite(error_m) ? fmt::format("{:10.2f}  ", 1e3 * error_m)
                                   : fmt::format("{:>10}  ", "-");
  }
  const auto& segments = experiment_.actuation.segments;
  const auto index = static_cast<std::size_t>(segment);
  Eigen::Index chamber = 0;
  for (std::size_t before = 0; before < index && before < segments.size(); ++before)
    chamber += std::ssize(segments[before]);
  const Eigen::Index end =
      chamber + (index < segments.size() ? std::ssize(segments[index]) : Eigen::Index{0});
  for (; chamber < std::min(end, status.pressure_bar.size()); ++chamber)
    text += fmt::format(" {:6.3f}", status.pressure_bar[chamber]);
  return text + "\n";
}

void LiveView::update_rates(const StatusRecord& record) {
  const std::int64_t now_ns = monotonic_now_ns();
  const std::int64_t span_ns = now_ns - counted_ns_;
  if (span_ns < kRateSpan_ns) return;
  if (counted_ns_ > 0) {
    const double span_s = to_seconds(span_ns);
    status_hz_ = static_cast<double>(record.rows() - rows_) / span_s;
    frames_hz_ = static_cast<double>(record.status().frames_accepted - frames_) / span_s;
  }
  counted_ns_ = now_ns;
  rows_ = record.rows();
  frames_ = record.status().frames_accepted;
}

}  // namespace softarm
