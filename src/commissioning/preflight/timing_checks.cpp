#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "commissioning/median.hpp"
#include "softarm/base/time.hpp"
#include "softarm/commissioning/preflight/checks.hpp"
#include "softarm/runtime/safety_monitor.hpp"
#include "softarm/runtime/settings.hpp"
#include "softarm/transport/mocap_source.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {
namespace {

constexpr double kSeenEnough = 0.99;        ///< of the frames
constexpr double kRateTolerance = 0.05;     ///< of the period
constexpr double kMissingTolerance = 0.01;  ///< of the frames
constexpr double kLatencyTolerance_s = 0.002;
constexpr double kLongestLatency_s = 1.0;  ///< a longer latency means two clocks

std::string body_name(std::size_t index, const TransportSettings& transport) {
  const BodySettings& bodies = transport.bodies;
  const std::string what = index == 0 ? "base" : fmt::format("end of segment {}", index);
  if (transport.mocap.source.channel_per_body)
    return fmt::format(
        "{} (channel {})", what,
        body_channel(transport.lcm, index == 0 ? bodies.base_marker_frame
                                               : bodies.segment_marker_frames[index - 1]));
  const MarkerFrameSettings* const frame = index == 0 ? &bodies.base_marker_frame
                                           : index <= bodies.segment_marker_frames.size()
                                               ? &bodies.segment_marker_frames[index - 1]
                                               : nullptr;
  if (frame != nullptr && !frame->name.empty()) return fmt::format("{} ({})", what, frame->name);
  return fmt::format("{} (id {})", what,
                     index == 0 ? bodies.base_id : bodies.segment_ids[index - 1]);
}

Finding check_bodies(const Experiment& experiment, const Observation& seen) {
  const LcmSettings& lcm = experiment.transport.lcm;
  const bool has_server = experiment.transport.mocap.source.network.has_value();
  const std::string channels = has_server ? mocap_place(experiment.transport)
                                          : fmt::format("{}", fmt::join(seen.channels, ", "));
  const double listened_s = to_seconds(seen.rest_end_ns - seen.start_ns);
  if (seen.frames.empty())
    return Finding::failed(
        kBodies,
        fmt::format("no frame on {} within {:.1f} s{}", channels, listened_s,
                    seen.not_frames > 0
                        ? fmt::format(", but {} packets that are not frames", seen.not_frames)
                        : ""),
        has_server ? "start the server and its streaming of rigid bodies, or fix daemon.mocap"
                   : fmt::format("start the sender of frames, or fix daemon.mocap.source; it must "
                                 "publish on {} at {}",
                                 channels, lcm.url));
  const auto count = static_cast<int>(seen.frames.front().body.size());
  const MeanPoses mean = mean_poses(seen, seen.start_ns, kForever, count);
  std::vector<std::string> missing;
  for (std::size_t i = 0; i < mean.seen.size(); ++i)
    if (mean.seen[i] < kSeenEnough)
      missing.push_back(mean.seen[i] == 0.0 ? body_name(i, experiment.transport) + " never seen"
                                            : fmt::format("{} seen in {:.1f} % of the frames",
                                                          body_name(i, experiment.transport),
                                                          100.0 * mean.seen[i]));
  const std::string text =
      fmt::format("{} frames in {:.1f} s on {}", seen.frames.size(),
                  to_seconds(seen.frames.back().arrival_ns - seen.start_ns), channels);
  if (missing.empty())
    return Finding::passed(kBodies, fmt::format("{}, all {} bodies seen", text, count));
  return Finding::failed(kBodies, fmt::format("{}: {}", text, fmt::join(missing, ", ")),
                         seen.other_ids.empty()
                             ? "markers hidden, too few or not tracked"
                             : fmt::format("daemon.bodies does not name ids {}, which are there",
                                           fmt::join(seen.other_ids, ", ")));
}

/// Time stamps that advance: the sender's, else the arrivals.
struct Times {
  bool stamped = false;
  std::vector<double> s;             ///< of every new frame
  std::vector<std::int64_t> number;  ///< of the same
  std::vector<double> arrival_s;
};

Times times_of(const Observation& seen) {
  Times out;
  int advancing = 0;
  for (std::size_t k = 1; k < seen.frames.size(); ++k)
    advancing += seen.frames[k].sender_us > seen.frames[k - 1].sender_us ? 1 : 0;
  out.stamped = 2 * advancing > static_cast<int>(seen.frames.size());
  const SeenFrame* last = nullptr;
  for (const SeenFrame& frame : seen.frames) {
    if (last != nullptr && frame.number <= last->number) continue;  // repeated or overtaken
    last = &frame;
    out.number.push_back(frame.number);
    out.arrival_s.push_back(to_seconds(frame.arrival_ns - seen.start_ns));
    out.s.push_back(
        out.stamped ? 1e-6 * static_cast<double>(frame.sender_us - seen.frames.front().sender_us)
                    : out.arrival_s.back());
  }
  return out;
}

Finding check_rate(const Experiment& experiment, const Times& times) {
  std::vector<double> periods_s;
  for (std::size_t k = 1; k < times.s.size(); ++k)
    periods_s.push_back((times.s[k] - times.s[k - 1]) /
                        static_cast<double>(times.number[k] - times.number[k - 1]));
  const double period_s = median(periods_s);
  const double configured_s = experiment.safety.frame_period_s;
  const auto sent = static_cast<double>(times.number.back() - times.number.front() + 1);
  const double missing = 1.0 - static_cast<double>(times.number.size()) / sent;
  const std::string text = fmt::format(
      "{:.1f} Hz{}, {:.1f} Hz configured; {:.1f} % of the frames missing", 1.0 / period_s,
      times.stamped ? "" : " by arrival", 1.0 / configured_s, 100.0 * missing);
  if (std::abs(period_s / configured_s - 1.0) > kRateTolerance)
    return Finding::failed(
        "rate", text,
        fmt::format("daemon.safety.frame_period_s: {:.4g}, or the camera's rate", period_s));
  if (missing > kMissingTolerance)
    return Finding::failed("rate", text,
                           "a separate wired network between camera host and this machine; a "
                           "receive buffer that holds the frames");
  return Finding::passed("rate", text);
}

Finding check_jitter(const Experiment& experiment, const Times& times) {
  const SafetySettings& safety = experiment.safety;
  const double hold_s =
      to_seconds(resolve_thresholds(safety, 1.0 / experiment.rate_hz).hold_after_ns);
  double longest_s = 0.0, least_s = 1e300, most_s = -1e300;
  int late = 0;
  for (std::size_t k = 0; k < times.s.size(); ++k) {
    const double way_s = times.arrival_s[k] - times.s[k];
    least_s = std::min(least_s, way_s);
    most_s = std::max(most_s, way_s);
    if (k == 0) continue;
    const double gap_s = times.arrival_s[k] - times.arrival_s[k - 1];
    longest_s = std::max(longest_s, gap_s);
    late += gap_s + safety.frame_latency_s > hold_s ? 1 : 0;
  }
  std::string text = fmt::format("frames arrive at most {:.1f} ms apart", 1e3 * longest_s);
  if (times.stamped) text += fmt::format(", with a jitter of {:.1f} ms", 1e3 * (most_s - least_s));
  text += fmt::format("; HOLD after {:.1f} ms", 1e3 * hold_s);
  if (late == 0) return Finding::passed("jitter", text);
  return Finding::failed(
      "jitter", fmt::format("{}, which would have occurred {} times", text, late),
      "reduce the load on the network and this machine, or raise daemon.safety.hold_after_s");
}

/// Shortest time from stamp to arrival, if the stamps are from one of our clocks.
std::optional<double> least_latency_s(const Observation& seen, std::string& clock) {
  std::int64_t least_ns = kForever;
  for (const SeenFrame& frame : seen.frames)
    least_ns = std::min(least_ns, frame.arrival_ns - 1000 * frame.sender_us);
  for (const auto& [name, offset_ns] : {std::pair<const char*, std::int64_t>{"monotonic clock", 0},
                                        {"wall clock", seen.wall_minus_ns}}) {
    const double latency_s = to_seconds(least_ns + offset_ns);
    if (latency_s < -1e-3 || latency_s > kLongestLatency_s) continue;
    clock = name;
    return latency_s;
  }
  return std::nullopt;
}

Finding check_latency(const Experiment& experiment, const Observation& seen, const Times& times) {
  const char* check = "latency";
  const double declared_s = experiment.safety.frame_latency_s;
  if (!times.stamped && experiment.transport.capture_time == ClockMode::latency)
    return Finding::not_checked(
        check, fmt::format("frames carry no advancing time; {:.1f} ms declared", 1e3 * declared_s));
  if (!times.stamped)
    return Finding::failed(check, "the sender's time stamps do not advance",
                           "stamp every frame at exposure, or daemon.capture_time: latency");
  std::string clock;
  const std::optional<double> least_s = least_latency_s(seen, clock);
  if (!least_s)
    return Finding::not_checked(
        check, fmt::format("the sender's clock is not one of ours, so only changes of latency show "
                           "(see jitter); {:.1f} ms declared",
                           1e3 * declared_s));
  const std::string text = fmt::format("at least {:.1f} ms by our {}, {:.1f} ms declared",
                                       1e3 * *least_s, clock, 1e3 * declared_s);
  if (std::abs(*least_s - declared_s) <= std::max(kLatencyTolerance_s, 0.25 * declared_s))
    return Finding::passed(check, text);
  return Finding::failed(
      check, text,
      fmt::format("daemon.safety.frame_latency_s: {:.4f}, unless stamps are not taken at exposure",
                  std::max(0.0, *least_s)));
}

}  // namespace

std::vector<Finding> check_timing(const Experiment& experiment, const Observation& seen) {
  std::vector<Finding> out{check_bodies(experiment, seen)};
  const Times times = times_of(seen);
  if (times.s.size() < 10) {
    for (const char* check : {"rate", "jitter", "latency"})
      out.push_back(Finding::not_checked(check, "fewer than 10 frames"));
    return out;
  }
  out.push_back(check_rate(experiment, times));
  out.push_back(check_jitter(experiment, times));
  out.push_back(check_latency(experiment, seen, times));
  return out;
}

}  // namespace softarm
