// Which chamber bends which segment, and in which direction.
#pragma once

#include <optional>
#include <vector>

#include "softarm/commissioning/preflight/checks.hpp"

namespace softarm {

/// The response to one pulse, as the moment with which the model explains it.
struct PulseResponse {
  Pulse pulse;
  double configured_rad = 0.0;  ///< the chamber's angle chi
  double configured_nm = 0.0;   ///< gain times pressure
  int segment = 0;              ///< on which the largest moment acts
  double measured_rad = 0.0;    ///< angle of a chamber with this effect
  double measured_nm = 0.0;
  bool silent() const { return measured_nm < 0.2 * configured_nm; }
  bool astray() const { return segment != pulse.segment; }
  /// measured minus configured, in [-pi, pi]
  double turned_rad() const;
};

/// Empty if some body was not seen before or during the pulse.
std::optional<PulseResponse> response_to(const Experiment& experiment, const Observation& seen,
                                         const Pulse& pulse);

Finding check_valve_map(const Experiment& experiment, const Observation& seen);

}  // namespace softarm
