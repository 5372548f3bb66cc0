// Set points that a tool plays on a running arm, watched: the first thing that goes wrong ends
// them.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <utility>

#include "softarm/client/arm_client.hpp"

namespace softarm {

/// Commands are at an end where
///  - `stop` says so (Ctrl-C), or this program was held up for so long that the valves vented,
///  - a daemon is armed, or somebody else commands the arm,
///  - no frame shows every segment for `lost_ns`,
///  - a segment bends beyond identification.max_theta_rad or moves faster than max_speed_radps.
/// Whoever uses this vents afterwards.
class GuardedMotion {
 public:
  /// @param client  holds the lock on the command channel
  GuardedMotion(ArmClient& client, std::int64_t lost_ns, std::function<bool()> stop)
      : client_(client), lost_ns_(lost_ns), stop_(std::move(stop)) {}

  /// Commands `bar`, at `rate_bar_per_s` at most, until `done()`; it is asked once a round, after
  /// messages were handled. Returns at once where the motion is at an end.
  void command(const PressureVector& bar, double rate_bar_per_s, const std::function<bool()>& done);
  /// Why the motion is at an end, for a person; empty while it is not.
  const std::string& aborted() const { return aborted_; }

 private:
  std::string reason_to_end() const;

  ArmClient& client_;
  std::int64_t lost_ns_;
  std::function<bool()> stop_;
  std::string aborted_;
};

}  // namespace softarm
