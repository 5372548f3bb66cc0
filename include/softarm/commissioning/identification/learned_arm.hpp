// What the model-based observer has learnt of an arm, as an experiment.
#pragma once

#include <filesystem>
#include <string>

#include "softarm/config/experiment.hpp"
#include "softarm/estimation/observer_report.hpp"

namespace softarm {

/// The experiment's arm and chambers with the observer's corrections of stiffness, damping and gain,
/// and of gravity's direction, if all segments have the same horizontal load: that is a base tilted by
/// atan |load|. All corrections are relative to the vertical component of the weight, so under a
/// tilt by a they are multiplied by cos a. A load that differs from segment to segment (a payload, a
/// force on the tip) has no place in a configuration and is left out.
Experiment corrected(const Experiment& experiment, const ObserverReport& learned);

/// Whether the loads are those of a tilted base: their mean is more than three standard deviations,
/// and each differs from it by at most three deviations plus a fifth of the mean.
bool is_tilt(const ObserverReport& learned);

/// An experiment that includes `config`, with what was learnt in place of the configured values; the
/// simulated arm stays as it was. To be written to `output`.
std::string learned_yaml(const Experiment& experiment, const ObserverReport& learned,
                         const std::string& note, const std::filesystem::path& config,
                         const std::filesystem::path& output);

}  // namespace softarm
