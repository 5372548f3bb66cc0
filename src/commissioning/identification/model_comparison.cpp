#include "softarm/commissioning/identification/model_comparison.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <utility>

namespace softarm {
namespace {

constexpr double kLead_s = 10.0;      ///< of simulation before the second half
constexpr int kMostRounds = 120;      ///< some terms nearly replace each other
constexpr double kUndamped_s = 0.02;  ///< beta / k of an arm without inertia that follows at once

struct Named {
  const char* name;
  FitChoice choice;
};

std::vector<Named> variants(const FitChoice& asked) {
  FitChoice plain = asked;
  plain.lag = plain.delay = plain.rest = plain.cubic = false;
  FitChoice still = plain;
  still.damping = false;
  const bool inertia = asked.inertia;
  std::vector<Named> out = {{inertia ? "gains; beta as configured" : "gains; no damping", still}};
  still.lag = true;
  out.push_back({inertia ? "gains, lag; beta as configured" : "gains, lag; no damping", still});
  plain.damping = true;
  out.push_back({"(16): gains, beta", plain});
  const auto with = [&](const char* name, bool FitChoice::*term) {
    FitChoice choice = plain;
    choice.*term = true;
    out.push_back({name, choice});
  };
  with("(16) + rest offset", &FitChoice::rest);
  with("(16) + lag", &FitChoice::lag);
  with("(16) + delay", &FitChoice::delay);
  with("(16) + cubic stiffness", &FitChoice::cubic);
  FitChoice all = plain;
  all.rest = all.lag = all.delay = all.cubic = true;
  out.push_back({"(16) + all four", all});
  out.push_back({"as asked", asked});
  return out;
}

/// Of `record`, by what the other half gives.
double predicted_rad(const ParameterSet& set, const MotionRecord& record,
                     const Eigen::VectorXd& x) {
  try {
    return predict(set, record, x).rms_rad;
  } catch (const std::runtime_error&) {
    return std::numeric_limits<double>::quiet_NaN();
  }
}

}  // namespace

CrossValidation cross_validate(const ParameterSet& set, const MotionRecord& record,
                               const IdentifyOptions& options, const CrossValidation* simpler) {
  const double begin_s = std::max(record.scored_from_s, record.time_s[0]);
  const double end_s = record.time_s[record.time_s.size() - 1] + 1e-6;
  const double middle_s = 0.5 * (begin_s + end_s);
  // The first half begins as the record does, so that it starts from the same rest.
  const MotionRecord first = record.part(begin_s, middle_s, begin_s - record.time_s[0]);
  const MotionRecord second = record.part(middle_s, end_s, kLead_s);
  CrossValidation out;
  const auto find = [&](const MotionRecord& part, std::size_t i) {
    IdentifyOptions from = options;
    if (simpler != nullptr) from.near.push_back(simpler->found[i]);
    const Refinement fit = identify(set, part, from);
    out.found.push_back(set.arm(fit.x));
    return fit;
  };
  out.whole = find(record, 0);
  const Refinement by_first = find(first, 1);
  const Refinement by_second = find(second, 2);
  out.second_by_first_rad = predicted_rad(set, second, by_first.x);
  out.first_by_second_rad = predicted_rad(set, first, by_second.x);
  out.converged = out.whole.converged && by_first.converged && by_second.converged;
  return out;
}

ModelComparison compare_models(const Experiment& experiment, const MotionRecord& record,
                               const FitChoice& choice, const IdentifyOptions& options,
                               const std::function<void(const std::string&)>& progress) {
  ModelComparison out;
  IdentifyOptions unweighted = options;
  unweighted.refinement.weighted = false;
  unweighted.refinement.most_rounds = kMostRounds;
  for (const Named& variant : variants(choice)) {
    if (progress) {
      progress(variant.name);
      unweighted.refinement.progress = [&](const std::string& text) {
        progress(fmt::format("{}: {}", variant.name, text));
      };
    }
    ArmHypothesis start = configured(experiment);
    if (!variant.choice.damping && !variant.choice.inertia)
      for (SegmentParameters& segment : start.arm.segments)
        segment.damping_nms_per_rad = kUndamped_s * segment.stiffness_nm_per_rad;
    const ParameterSet set(start, experiment.actuation.kind, variant.choice);
    // A model with more terms starts from the simplest of its kind, so that it is never worse.
    const CrossValidation* simpler = nullptr;
    for (const ModelTrial& trial : out.trials)
      if (trial.damping == variant.choice.damping) {
        simpler = &trial.result;
        break;
      }
    CrossValidation result = cross_validate(set, record, unweighted, simpler);
    out.trials.push_back({variant.name, variant.choice.damping, set.size(), std::move(result)});
    out.motion_rad = out.trials.back().result.whole.motion_rms_rad;
  }
  return out;
}

std::string comparison_text(const ModelComparison& comparison) {
  std::string text = fmt::format(
      "rms error of the u predicted from the recorded input alone, a component, in mrad; the "
      "motion's own about its mean: {:.1f} mrad\n{:<34}{:>10}{:>10}{:>17}{:>17}\n",
      1e3 * comparison.motion_rad, "model", "unknowns", "whole", "second by first",
      "first by second");
  for (const ModelTrial& trial : comparison.trials)
    text += fmt::format("{:<34}{:>10}{:>10.2f}{:>17.2f}{:>17.2f}{}\n", trial.name, trial.parameters,
                        1e3 * trial.result.whole.rms_rad, 1e3 * trial.result.second_by_first_rad,
                        1e3 * trial.result.first_by_second_rad,
                        trial.result.converged ? "" : "  NOT CONVERGED");
  return text;
}

}  // namespace softarm
