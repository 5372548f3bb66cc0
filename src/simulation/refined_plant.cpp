// Arms of several constant-curvature pieces a segment.
#include <cmath>
#include <stdexcept>
#include <string>

#include "simulation/pcc_system.hpp"
#include "softarm/base/keys.hpp"
#include "softarm/simulation/settings.hpp"

namespace softarm {
namespace {

/// Weights as parts of one.
std::vector<double> parts(const std::vector<double>& weights, int pieces, const char* key) {
  if (weights.empty()) {
    return std::vector<double>(static_cast<std::size_t>(pieces), 1.0 / pieces);
  }
  double sum = 0.0;
  for (const double weight : weights) {
    if (!std::isfinite(weight) || !(weight > 0.0)) {
      throw std::invalid_argument(std::string("plant.refined.") + key +
                                  ": expected weights > 0, got " + std::to_string(weight));
    }
    sum += weight;
  }
  if (static_cast<int>(weights.size()) != pieces) {
    throw std::invalid_argument(std::string("plant.refined.") + key + ": expected " +
                                std::to_string(pieces) + " weights, one a piece, got " +
                                std::to_string(weights.size()));
  }
  std::vector<double> result = weights;
  for (double& part : result) part /= sum;
  return result;
}

}  // namespace

void RefinedSettings::describe(Keys& key) {
  key("pieces", pieces, from(1, kMaxSegments), "a segment");
  for (auto* weights : {&length_weights, &mass_weights, &rigidity_weights})
    weights->resize(static_cast<std::size_t>(pieces), 1.0);
  const Form weights = above(0, 1e6).one_or_each();
  key("length_weights", length_weights, weights,
      "of the pieces of a segment, base to tip; their ratios count");
  key("mass_weights", mass_weights, weights, "the same");
  key("rigidity_weights", rigidity_weights, weights,
      "of E I, and of damping alike; the segment's k and beta stay");
}

std::unique_ptr<PlantSystem> RefinedSettings::make(const PlantSettings& settings) const {
  const int most = settings.arm.extensible ? kMaxStretchingSegments : kMaxSegments;
  if (pieces < 1 || pieces * settings.arm.size() > most) {
    throw std::invalid_argument("plant.refined.pieces: expected 1 to " + std::to_string(most) +
                                " pieces in the whole arm of " +
                                std::to_string(settings.arm.size()) + " segments, got " +
                                std::to_string(pieces) + " a segment");
  }
  const auto length = parts(length_weights, pieces, "length_weights");
  const auto mass = parts(mass_weights, pieces, "mass_weights");
  const auto rigidity = parts(rigidity_weights, pieces, "rigidity_weights");
  double compliance = 0.0;  // of the whole, in units in which E I / L is one where all are alike
  for (std::size_t j = 0; j < length.size(); ++j) compliance += length[j] / rigidity[j];
  ArmParameters arm = settings.arm;
  arm.segments.clear();
  for (const SegmentParameters& segment : settings.arm.segments) {
    for (std::size_t j = 0; j < length.size(); ++j) {
      const double stiffer = compliance * rigidity[j] / length[j];
      arm.segments.push_back({.length_m = segment.length_m * length[j],
                              .mass_kg = segment.mass_kg * mass[j],
                              .stiffness_nm_per_rad = segment.stiffness_nm_per_rad * stiffer,
                              .damping_nms_per_rad = segment.damping_nms_per_rad * stiffer,
                              .radius_m = segment.radius_m,
                              .axial_stiffness_n_per_m = segment.axial_stiffness_n_per_m * stiffer,
                              .axial_damping_ns_per_m = segment.axial_damping_ns_per_m * stiffer,
                              .constant_length = segment.constant_length});
    }
  }
  return std::make_unique<PccSystem>(settings, arm, pieces);
}

}  // namespace softarm
