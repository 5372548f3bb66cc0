// Frames of an arm that hangs without pressure, for a calibration.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "softarm/config/experiment.hpp"
#include "softarm/estimation/mocap_frame.hpp"

namespace softarm {

/// Poses of the tracked bodies themselves, without the configured marker frames, for `duration_s`
/// from the first frame. @throws TransportError; std::runtime_error if no frame comes within 5 s,
/// somebody commands pressures, or `stop` returns true
std::vector<MocapFrame> record_rest(const Experiment& experiment, double duration_s,
                                    const std::function<bool()>& stop,
                                    const std::function<void(const std::string&)>& progress);

}  // namespace softarm
