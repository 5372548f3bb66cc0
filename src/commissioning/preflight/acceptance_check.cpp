// What the daemon itself would do with the frames: its own validator judges them.
#include <fmt/format.h>

#include <algorithm>

#include "softarm/base/time.hpp"
#include "softarm/commissioning/preflight/checks.hpp"
#include "softarm/estimation/frame_validator.hpp"

namespace softarm {
namespace {

constexpr double kAcceptedEnough = 0.9;

struct Acceptance {
  FrameCounters counters;
  std::int64_t frames = 0, late = 0;
};

Acceptance judge(const Experiment& experiment, const Observation& seen) {
  const int n = experiment.arm.size();
  FrameValidator validator(experiment.estimation, experiment.arm,
                           body_noise(experiment.estimation, n));
  Acceptance out;
  MocapFrame frame;
  frame.segments = n;
  for (const SeenFrame& each : seen.frames) {
    ++out.frames;
    frame.frame_number = each.number;
    frame.capture_ns = each.capture_ns != kNever
                           ? each.capture_ns
                           : each.arrival_ns - to_ns(experiment.safety.frame_latency_s);
    if (each.arrival_ns - frame.capture_ns > to_ns(experiment.safety.max_latency_s)) {
      ++out.late;
      continue;
    }
    std::copy(each.body.begin(), each.body.end(), frame.body.begin());
    validator.accept(frame);
  }
  out.counters = validator.counters();
  return out;
}

std::string fix_for(FrameVerdict verdict) {
  switch (verdict) {
    case FrameVerdict::repeated:
      return "the sender must count its frames up: their number stands still";
    case FrameVerdict::out_of_order:
    case FrameVerdict::sender_restarted:
      return "one sender only; frame numbers and capture times that increase";
    case FrameVerdict::bad_quaternion:
      return "the sender must send unit quaternions, daemon.mocap.quaternion their order";
    case FrameVerdict::bad_length:
      return "arm.length_m, daemon.mocap.unit and the marker frames must fit the arm";
    case FrameVerdict::bad_torsion:
      return "a body is recognised turned about its axis: give it markers that are not symmetric, "
             "or "
             "run softarm calibrate";
    default:
      return "docs/reference/faults.md lists what each verdict means";
  }
}

}  // namespace

void check_acceptance(const Experiment& experiment, const Observation& seen,
                      std::vector<Finding>& findings) {
  Finding out{.check = kAccepted};
  if (seen.frames.empty()) return;  // which the first check reports
  const Acceptance found = judge(experiment, seen);
  const FrameCounters& counters = found.counters;
  const auto part = [&](std::int64_t count) {
    return static_cast<double>(count) / static_cast<double>(found.frames);
  };
  // A sender may send every frame of a camera more than once; but not nearly always the same one.
  const bool stands = part(counters.repeated) > kAcceptedEnough;
  const std::int64_t judged = stands ? found.frames : found.frames - counters.repeated;
  const std::int64_t good = counters.accepted - counters.stale;
  const double accepted =
      static_cast<double>(good) / static_cast<double>(std::max<std::int64_t>(1, judged));
  out.text = fmt::format("{:.1f} % of the frames by the daemon's own checks", 100.0 * accepted);
  if (accepted >= kAcceptedEnough) {
    findings.front().text += fmt::format("; the daemon accepts {:.1f} %", 100.0 * accepted);
    return;
  }
  FrameVerdict commonest = stands ? FrameVerdict::repeated : FrameVerdict::wrong_size;
  for (int k = 0; k < kFrameVerdicts && !stands; ++k) {
    const auto verdict = static_cast<FrameVerdict>(k);
    if (verdict != FrameVerdict::accepted && verdict != FrameVerdict::repeated &&
        counters.of(verdict) > counters.of(commonest))
      commonest = verdict;
  }
  const std::int64_t most = counters.of(commonest);
  if (found.late > most) {
    out.text += fmt::format(", {} older than max_latency_s", found.late);
    out.fix = "daemon.safety.max_latency_s, or what makes frames late";
  } else if (counters.stale > most) {
    out.text += fmt::format(", {} with a body that repeats an old pose", counters.stale);
    out.fix = "the sender must mark a body that it has lost as not valid";
  } else {
    out.text += fmt::format(", {} {}", most, name(commonest));
    out.fix = fix_for(commonest);
  }
  if (any_failed(findings)) {  // each of those may be the reason
    out.text += "; fix what failed first";
    out.fix.clear();
  } else {
    out.verdict = Verdict::fail;
  }
  findings.push_back(out);
}

}  // namespace softarm
