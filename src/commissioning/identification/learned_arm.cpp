#include "softarm/commissioning/identification/learned_arm.hpp"

#include <fmt/format.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "softarm/commissioning/identification/fit_report.hpp"
#include "softarm/commissioning/identification/response_model.hpp"
#include "softarm/model/coordinates.hpp"
#include "softarm/model/dynamics.hpp"
#include "softarm/model/model_correction.hpp"

namespace softarm {
namespace {

/// Of a force along the straight arm, as of an arm that lies, nothing is in a disturbance. Directions
/// with less than this part of the other one's leverage have no load.
constexpr double kLeastLeverage = 0.1;

/// The horizontal load of every segment that this disturbance (2n, N m) amounts to on the straight
/// arm, 2 x n; what is constant of it is one that is not learnt yet.
Eigen::Matrix2Xd load_of(const ArmParameters& arm_as_it_is, ConstVectorRef disturbance_nm) {
  const ArmParameters arm = at_rest_length(arm_as_it_is);
  const int n = arm.size();
  Eigen::Matrix2Xd load = Eigen::Matrix2Xd::Zero(2, n);
  if (arm.gravity_mps2.isZero(0.0) || disturbance_nm.size() != 2 * n) return load;
  DynamicsWorkspace workspace(arm);
  SegmentVector along_x(2 * n), along_y(2 * n);
  HorizontalLoad(arm).rows(Eigen::VectorXd::Zero(2 * n), workspace, along_x, along_y);
  for (int i = 0; i < n; ++i) {
    Eigen::Matrix2d rows;
    rows << along_x.segment<2>(2 * i), along_y.segment<2>(2 * i);
    Eigen::JacobiSVD<Eigen::Matrix2d> svd(rows, Eigen::ComputeFullU | Eigen::ComputeFullV);
    svd.setThreshold(kLeastLeverage);
    load.col(i) = -svd.solve(Eigen::Vector2d(disturbance_nm.segment<2>(2 * i)));
  }
  return load;
}

}  // namespace

Experiment corrected(const Experiment& experiment, const ObserverReport& learned) {
  Experiment out = experiment;
  ModelObserverSettings& observer = out.estimation.model_observer;
  observer.load.clear();
  double load_deviation = 0.0;
  const Eigen::Matrix2Xd rest = load_of(experiment.arm, learned.correction.disturbance_nm);
  for (std::size_t i = 0; i < out.arm.segments.size(); ++i) {
    const SegmentCorrection& by = learned.correction.segment[i];
    out.arm.segments[i].stiffness_nm_per_rad *= (1.0 + by.stiffness);
    out.arm.segments[i].damping_nms_per_rad *= (1.0 + by.damping);
    const Eigen::Vector2d not_learnt = rest.col(static_cast<Eigen::Index>(i));
    for (const double each : by.load + not_learnt)
      observer.load.push_back(std::clamp(each, -1.0, 1.0));
    load_deviation =
        std::max(load_deviation,
                 std::hypot(learned.deviation.segment[i].load.maxCoeff(), not_learnt.norm()));
    if (out.actuation.kind != ActuationKind::chambers) continue;
    for (Chamber& chamber : out.actuation.segments[i]) chamber.gain_nm_per_bar *= (1.0 + by.gain);
  }
  observer.load_deviation = std::min(load_deviation, 1.0);
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
