#include "softarm/transport/daemon_loop.hpp"

#include <algorithm>
#include <utility>

#include "softarm/base/clock.hpp"
#include "softarm/base/realtime.hpp"
#include "softarm/base/time.hpp"

namespace softarm {
namespace {

/// Zero commands sent before leaving: one may be lost on the wire.
constexpr int kLastCommands = 3;
constexpr std::int64_t kRepeatPause_ns = 500'000;
constexpr std::int64_t kMostNotKept_ns = 1'000'000'000;
constexpr std::int64_t kManyMissed = 1'000'000;  // a larger count means nothing new; fits an int

}  // namespace

DaemonLoop::DaemonLoop(const PipelineSettings& settings, const TransportSettings& transport,
                       const Provenance& provenance, bool shadow)
    : pipeline_(settings),
      link_(settings, transport, provenance, shadow),
      ticks_per_second_(static_cast<std::int64_t>(settings.rate_hz)) {}

void DaemonLoop::run(const std::function<bool()>& stop_requested,
                     const std::function<void(const Report&)>& after_tick) {
  // Without SCHED_FIFO overruns are not evidence of a fault in the daemon.
  judge_overruns_ = runs_under_fifo();
  const std::int64_t start_ns = monotonic_now_ns();
  PeriodicDeadline deadline(pipeline_.period_ns(), start_ns);
  int vented_commands = 0;
  while (vented_commands < kLastCommands) {
    sleep_until_ns(deadline.next_ns());
    const std::int64_t woken_ns = monotonic_now_ns();
    if (woken_ns < deadline.next_ns()) continue;  // a signal cut the sleep short
    timing_.lateness.add_ns(woken_ns - deadline.next_ns());
    const bool stopping = stop_requested();
    tick(woken_ns, stopping);
    const std::int64_t missed = deadline.advance(monotonic_now_ns());
    timing_.overruns += missed;
    missed_in_row_ =
        missed > 0 ? missed_in_row_ + static_cast<int>(std::min(missed, kManyMissed)) : 0;
    after_tick({.woken_ns = woken_ns,
                .since_start_ns = woken_ns - start_ns,
                .on_time = missed == 0,
                .stopping = stopping});
    if (stopping && pipeline_.output().mode >= Mode::vent && pipeline_.fully_vented())
      ++vented_commands;
  }
  // Repeats the records sent only once, a few at a time: a logger's queue is short.
  while (link_.repeat_record()) sleep_until_ns(monotonic_now_ns() + kRepeatPause_ns);
}

bool DaemonLoop::may_publish_status(std::int64_t now_ns, const TickOutput& output) noexcept {
  const bool kept = !kept_ || kept_(output.mode, output.reason);
  if (kept || output.mode != Mode::fault) {
    not_kept_since_ns_ = kForever;
    return true;
  }
  not_kept_since_ns_ = std::min(not_kept_since_ns_, now_ns);
  return now_ns - not_kept_since_ns_ > kMostNotKept_ns;
}

void DaemonLoop::tick(std::int64_t woken_ns, bool stopping) noexcept {
  TickInput input = link_.collect(woken_ns);
  input.requests.shutdown = stopping;
  input.requests.emergency_stop |= std::exchange(begin_stopped_, false);
  input.consecutive_overruns = judge_overruns_ ? missed_in_row_ : 0;
  const TickOutput& output = pipeline_.tick(input);
  const std::int64_t decided_ns = monotonic_now_ns();
  link_.publish_command(decided_ns, output);
  link_.publish_law_state(woken_ns, output);
  ++timing_.ticks;
  link_.publish_status(woken_ns, pipeline_, timing_, may_publish_status(woken_ns, output));
  link_.publish_record(input, output);
  if (timing_.ticks % ticks_per_second_ == 0) link_.publish_timing(woken_ns, timing_);
  if (input.law != nullptr)
    timing_.law.add_ns(std::max<std::int64_t>(input.law->arrival_ns - input.law->state_ns, 0));
  timing_.tick.add_ns(decided_ns - woken_ns);
  timing_.publish.add_ns(monotonic_now_ns() - decided_ns);
  if (output.frame_age_s >= 0.0) timing_.frame_age.add_ns(to_ns(output.frame_age_s));
}

}  // namespace softarm
