#include "softarm/commissioning/identification/learned_arm.hpp"

#include <algorithm>
#include <cmath>

#include "softarm/commissioning/identification/fit_report.hpp"
#include "softarm/commissioning/identification/response_model.hpp"

namespace softarm {
namespace {

Eigen::Vector2d mean_load(const ObserverReport& learned) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero(), weights = Eigen::Vector2d::Zero();
  for (int i = 0; i < learned.segments; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const Eigen::Vector2d sigma = learned.deviation.segment[k].load.cwiseMax(1e-9);
    const Eigen::Vector2d weight = sigma.cwiseAbs2().cwiseInverse();
    sum += weight.cwiseProduct(learned.correction.segment[k].load);
    weights += weight;
  }
  return sum.cwiseQuotient(weights);
}

}  // namespace

bool is_tilt(const ObserverReport& learned) {
  if (learned.segments == 0) return false;
  const Eigen::Vector2d mean = mean_load(learned);
  double least_deviation = learned.deviation.segment.front().load.norm();
  for (int i = 1; i < learned.segments; ++i)
    least_deviation = std::min(least_deviation,
                               learned.deviation.segment[static_cast<std::size_t>(i)].load.norm());
  if (mean.norm() <= 3.0 * least_deviation) return false;  // level, as far as is known
  for (int i = 0; i < learned.segments; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const Eigen::Vector2d off = learned.correction.segment[k].load - mean;
    const double allowed = 3.0 * learned.deviation.segment[k].load.norm() + 0.2 * mean.norm();
    if (off.norm() > allowed) return false;
  }
  return true;
}

Experiment corrected(const Experiment& experiment, const ObserverReport& learned) {
  Experiment out = experiment;
  double vertical = 1.0;  // cosine of the tilt
  if (is_tilt(learned)) {
    const Eigen::Vector2d load = mean_load(learned);
    const HorizontalLoad horizontal(experiment.arm);
    const Eigen::Vector3d along =
        load.x() * horizontal.gravity_x_mps2() + load.y() * horizontal.gravity_y_mps2();
    vertical = 1.0 / std::sqrt(1.0 + load.squaredNorm());
    out.arm.gravity_mps2 = vertical * (experiment.arm.gravity_mps2 + along);
  }
  for (std::size_t i = 0; i < out.arm.segments.size(); ++i) {
    const SegmentCorrection& by = learned.correction.segment[i];
    out.arm.segments[i].stiffness_nm_per_rad *= vertical * (1.0 + by.stiffness);
    out.arm.segments[i].damping_nms_per_rad *= vertical * (1.0 + by.damping);
    if (out.actuation.kind != ActuationKind::chambers) continue;
    for (Chamber& chamber : out.actuation.segments[i])
      chamber.gain_nm_per_bar *= vertical * (1.0 + by.gain);
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
