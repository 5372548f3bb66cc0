#include "softarm/transport/valves_loop.hpp"

#include "softarm/base/clock.hpp"
#include "softarm/base/time.hpp"

namespace softarm {

ValvesLoop::ValvesLoop(const LcmSettings& lcm, double rate_hz, ValveDriver& driver)
    : driver_(driver), link_(lcm, driver), period_ns_(to_ns(1.0 / rate_hz)) {}

bool ValvesLoop::run(const std::function<bool()>& stop_requested,
                     const std::function<void(const Report&)>& after_cycle) {
  const std::int64_t start_ns = monotonic_now_ns();
  PeriodicDeadline deadline(period_ns_, start_ns);
  while (true) {
    link_.take_until(deadline.next_ns());
    const std::int64_t now_ns = monotonic_now_ns();
    if (!driver_.stopping() && stop_requested()) driver_.stop(now_ns);
    link_.drain(driver_.wake(now_ns));
    if (driver_.cycle(now_ns)) link_.publish_measurement(now_ns);
    const std::int64_t missed = deadline.advance(monotonic_now_ns());
    late_cycles_ += missed;
    const bool changed = link_.publish_status(now_ns, late_cycles_);
    after_cycle({.now_ns = now_ns,
                 .since_start_ns = now_ns - start_ns,
                 .changed = changed,
                 .on_time = missed == 0});
    if (!driver_.stopped(now_ns)) continue;
    driver_.close();
    return driver_.guard().zero_confirmed();
  }
}

}  // namespace softarm
