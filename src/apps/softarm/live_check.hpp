// softarm check --live: listens to a running arm, optionally fills its chambers, and reports.
#pragma once

#include "softarm/commissioning/preflight/pulses.hpp"
#include "softarm/config/experiment.hpp"

namespace softarm {

struct LiveCheckOptions {
  double listen_s = 5.0;
  bool pulse = false;  ///< fill every chamber once: this moves the arm
  PulsePlan plan = {};
  bool json = false;
};

/// Prints the report on standard output. Returns kExitOk where nothing failed, kExitFailure where
/// something did or the pulses could not be played, kExitOtherInstance where pulses were asked for
/// and another program commands the arm.
/// @throws TransportError
int check_live(const Experiment& experiment, const LiveCheckOptions& options);

}  // namespace softarm
