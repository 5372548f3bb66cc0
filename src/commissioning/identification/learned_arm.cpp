#include "softarm/commissioning/identification/learned_arm.hpp"

#include "softarm/commissioning/identification/fit_report.hpp"
#include "softarm/commissioning/identification/response_model.hpp"

namespace softarm {
Experiment corrected(const Experiment& experiment, const ObserverReport& learned) {
  Experiment out = experiment;
  for (std::size_t i = 0; i < out.arm.segments.size(); ++i) {
    const SegmentCorrection& by = learned.correction.segment[i];
    out.arm.segments[i].stiffness_nm_per_rad *= (1.0 + by.stiffness);
    out.arm.segments[i].damping_nms_per_rad *= (1.0 + by.damping);
    if (out.actuation.kind != ActuationKind::chambers) continue;
    for (Chamber& chamber : out.actuation.segments[i]) chamber.gain_nm_per_bar *= (1.0 + by.gain);
  }
  return out;
}

std::string learned_yaml(const Experiment& experiment, const ObserverReport& learned,
                         const std::string& note, const std::filesystem::path& config,
                         const std::filesystem::path& output) {
  FitChoice choice;
  choice.lag = false;  // the observer does not learn it
  return identified_yaml(experiment, configured(corrected(experiment, learned)), choice, note,
                         config, output);
}

}  // namespace softarm
