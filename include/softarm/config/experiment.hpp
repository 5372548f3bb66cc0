// One experiment: everything a YAML file decides, composed of the settings that each module declares.
// config/template.yaml documents every setting.
#pragma once

#include <cstdint>
#include <string>

#include "softarm/base/output_file.hpp"
#include "softarm/base/realtime.hpp"
#include "softarm/config/identification_settings.hpp"
#include "softarm/config/motion_limits.hpp"
#include "softarm/runtime/settings.hpp"
#include "softarm/simulation/settings.hpp"
#include "softarm/transport/settings.hpp"
#include "softarm/valves/settings.hpp"

namespace softarm {

/// Defaults of a simulated run.
struct RunSettings {
  double duration_s = 20.0;
  double tracking_from_s = 1.0;
  double log_rate_hz = 0.0;
};

/// How far the arm may differ from what is configured: what the check of the loop judges.
struct ArmUncertainty {
  double parameters = 0.1;  ///< of stiffness, damping, mass, length and gain, relative
  double payload_kg = 0.0;  ///< at the tip, at most
};

/// An experiment as in its file, defaults filled in.
struct Experiment : PipelineSettings {
  std::string name;
  std::uint64_t seed = 1;
  TransportSettings transport;
  RealtimeSettings realtime;
  ArmUncertainty uncertainty;
  PlantSettings plant;
  ValveDriverSettings valves;
  RunSettings run;
  IdentificationSettings identification;
  MotionLimits motion_limits;
  Files files;             ///< that it was read from: its own and all that it includes
  std::uint64_t hash = 0;  ///< FNV-1a of the resolved configuration's text
};

}  // namespace softarm
