// Plays set points on a running arm under supervision: the first violation ends the motion.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <utility>

#include "softarm/client/arm_client.hpp"

namespace softarm {

/// The motion ends when
///  - `stop` returns true (Ctrl-C), or this program was held up for so long that the valves vented,
///  - a daemon is armed, or another program commands the arm,
///  - no frame shows every segment for `lost_ns`,
///  - a segment bends beyond identification.max_theta_rad or moves faster than max_speed_radps.
/// The caller must vent afterwards.
class GuardedMotion {
 public:
  /// @param client  holds the lock on the command channel
  GuardedMotion(ArmClient& client, std::int64_t lost_ns, std::function<bool()> stop)
      : client_(client), lost_ns_(lost_ns), stop_(std::move(stop)) {}

  /// Commands `bar`, at `rate_bar_per_s` at most, until `done()`, which is called once a round
  /// after messages were handled. Returns at once if the motion has ended.
  void command(const PressureVector& bar, double rate_bar_per_s, const std::function<bool()>& done);
  /// Why the motion has ended, for a person; empty while it has not.
  const std::string& aborted() const { return aborted_; }

 private:
  std::string reason_to_end() const;

  ArmClient& client_;
  std::int64_t lost_ns_;
  std::function<bool()> stop_;
  std::string aborted_;
};

}  // namespace softarm
