// What each term beyond (16) buys on one record.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "identification/identify.hpp"

namespace softarm {

/// One choice of unknowns: RMS errors of the predicted u, a component, in rad.
struct ModelTrial {
  std::string name;
  Eigen::Index parameters = 0;
  double all_rad = 0.0;              ///< identified and compared on the whole record
  double second_by_first_rad = 0.0;  ///< identified on the first half, compared on the second
  double first_by_second_rad = 0.0;
};

struct ModelComparison {
  std::vector<ModelTrial> trials;
  double motion_rad = 0.0;  ///< of the motion about its mean
};

/// The model of the controller, then with one term more at a time, then with all of them, then with
/// the terms of `choice`.
ModelComparison compare_models(const Experiment& experiment, const MotionRecord& record,
                               const FitChoice& choice, const IdentifyOptions& options,
                               const std::function<void(const std::string&)>& progress);

std::string comparison_text(const ModelComparison& comparison);

}  // namespace softarm
