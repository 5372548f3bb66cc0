// What the model-based observer has learnt of an arm, as an experiment.
#pragma once

#include <filesystem>
#include <string>

#include "softarm/config/experiment.hpp"
#include "softarm/estimation/observer_report.hpp"

namespace softarm {

/// The experiment's arm and chambers with the observer's corrections of stiffness, damping and gain,
/// and its horizontal load (a tilt, a payload, a force on the tip) as what the observer starts from.
/// That is the load learnt and, as it is learnt slowly, what the disturbance of this instant amounts to
/// on the straight arm; the deviation is the largest of both together.
Experiment corrected(const Experiment& experiment, const ObserverReport& learned);

/// An experiment that includes `config`, with what was learnt in place of the configured values; the
/// simulated arm stays as it was. To be written to `output`.
std::string learned_yaml(const Experiment& experiment, const ObserverReport& learned,
                         const std::string& note, const std::filesystem::path& config,
                         const std::filesystem::path& output);

}  // namespace softarm
