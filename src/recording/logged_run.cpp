#include "softarm/recording/logged_run.hpp"

#include <fmt/format.h>

#include <stdexcept>

#include "softarm/base/clock.hpp"
#include "softarm/base/time.hpp"
#include "softarm/runtime/log_row.hpp"
#include "softarm/simulation/lock_step.hpp"

namespace softarm {

LoggedRun::LoggedRun(const Experiment& experiment, const std::filesystem::path& log)
    : experiment_(experiment),
      pipeline_(experiment),
      timeline_(experiment.transport),
      mocap_(experiment.transport, experiment.safety, experiment.arm),
      log_(log) {
  if (!read_frame())
    throw std::runtime_error(fmt::format(
        "{} holds no frame on channel {}; daemon.lcm.mocap_channel is the channel to look for",
        log.string(), mocap_.channels().front()));
  start_ns_ = next_arrival_ns_;
}

bool LoggedRun::read_frame() {
  for (LogEvent event; log_.next(event);) {
    const auto arrival_ns = timeline_.arrival_ns(event);
    const auto channel = mocap_.find(event.channel);
    if (!channel) continue;
    if (!arrival_ns) {
      ++malformed_;
      continue;
    }
    next_arrival_ns_ = *arrival_ns;
    const MocapReceipt receipt = mocap_.take(*channel, event.data, next_arrival_ns_, next_);
    if (receipt == MocapReceipt::malformed) ++malformed_;
    if (receipt == MocapReceipt::frame) return has_next_ = true;
  }
  return has_next_ = false;
}

bool LoggedRun::step(LogRow& row, bool logged) {
  if (!has_next_) return false;
  const std::int64_t now_ns = start_ns_ + ticks_++ * pipeline_.period_ns();
  frames_.clear();
  while (has_next_ && next_arrival_ns_ <= now_ns) {
    frames_.push_back(next_);
    read_frame();
  }
  TickInput input;
  input.now_ns = now_ns;
  input.frames = frames_;
  input.newest_measurement_ns = now_ns;  // as if valves were present
  operator_.attend(pipeline_.output(), input);
  const std::int64_t before_ns = monotonic_now_ns();
  pipeline_.tick(input);
  tick_times_.add_ns(monotonic_now_ns() - before_ns);
  if (!logged) return true;
  fill_from_pipeline(pipeline_, experiment_.arm, row);
  row.t_s = to_seconds(now_ns - start_ns_);
  row.truth.resize(0);
  row.real.resize(0);
  row.tip.reset();
  return true;
}

}  // namespace softarm
