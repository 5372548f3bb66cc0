// Everything the control pipeline needs to know; an experiment adds the simulated arm and the run
// to it.
#pragma once

#include "softarm/actuation/settings.hpp"
#include "softarm/control/settings.hpp"
#include "softarm/daemon/settings.hpp"
#include "softarm/estimation/settings.hpp"
#include "softarm/model/arm.hpp"

namespace softarm {

/// Everything the pipeline of a tick is built from.
struct PipelineSettings {
  ArmParameters arm;  ///< what the controller believes
  EstimationSettings estimation;
  ControllerSettings control;
  ReferenceSettings reference;
  ActuationSettings actuation;
  DaemonSettings daemon;
};

}  // namespace softarm
