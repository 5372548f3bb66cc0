#include "softarm/commissioning/identification/learned_arm.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "softarm/commissioning/identification/fit_report.hpp"
#include "softarm/commissioning/identification/response_model.hpp"

namespace softarm {

Experiment corrected(const Experiment& experiment, const ObserverReport& learned) {
  Experiment out = experiment;
  ModelObserverSettings& observer = out.estimation.model_observer;
  observer.load.clear();
  observer.load_deviation = 0.0;
  for (std::size_t i = 0; i < out.arm.segments.size(); ++i) {
    const SegmentCorrection& by = learned.correction.segment[i];
    out.arm.segments[i].stiffness_nm_per_rad *= (1.0 + by.stiffness);
    out.arm.segments[i].damping_nms_per_rad *= (1.0 + by.damping);
    observer.load.insert(observer.load.end(), by.load.begin(), by.load.end());
    observer.load_deviation =
        std::max(*observer.load_deviation, learned.deviation.segment[i].load.maxCoeff());
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
  const Experiment found = corrected(experiment, learned);
  const ModelObserverSettings& observer = found.estimation.model_observer;
  std::string text = identified_yaml(experiment, configured(found), choice, note, config, output) +
                     "\nestimation:\n  model_observer:\n    load: [";
  for (std::size_t i = 0; i < observer.load.size(); i += 2)
    text += fmt::format("{}[{:.5f}, {:.5f}]", i > 0 ? ", " : "", observer.load[i],
                        observer.load[i + 1]);
  return text + fmt::format("]\n    load_deviation: {:.5f}\n", *observer.load_deviation);
}

}  // namespace softarm
