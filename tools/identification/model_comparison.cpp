#include "identification/model_comparison.hpp"

#include <fmt/format.h>

namespace softarm {
namespace {

constexpr double kLead_s = 5.0;  ///< of simulation before what is compared

struct Named {
  const char* name;
  FitChoice choice;
};

std::vector<Named> variants(const FitChoice& asked) {
  FitChoice plain = asked;
  plain.lag = plain.delay = plain.rest = plain.cubic = plain.directions = false;
  std::vector<Named> out = {{"k, beta, gains", plain}};
  const auto with = [&](const char* name, bool FitChoice::*term) {
    FitChoice choice = plain;
    choice.*term = true;
    out.push_back({name, choice});
  };
  with("+ rest offset", &FitChoice::rest);
  with("+ lag", &FitChoice::lag);
  with("+ delay", &FitChoice::delay);
  with("+ cubic stiffness", &FitChoice::cubic);
  with("+ directions", &FitChoice::directions);
  FitChoice all = plain;
  all.rest = all.lag = all.delay = all.directions = true;
  out.push_back({"+ rest, lag, delay, directions", all});
  all.cubic = true;
  out.push_back({"+ all of them", all});
  out.push_back({"as asked", asked});
  return out;
}

}  // namespace

ModelComparison compare_models(const Experiment& experiment, const MotionRecord& record,
                               const FitChoice& choice, const IdentifyOptions& options,
                               const std::function<void(const std::string&)>& progress) {
  const double begin_s = std::max(record.scored_from_s, record.time_s[0]);
  const double end_s = record.time_s[record.time_s.size() - 1] + 1e-6;
  const double middle_s = 0.5 * (begin_s + end_s);
  // The first half begins as the record does, so that it starts from the same rest.
  const MotionRecord first = record.part(begin_s, middle_s, begin_s - record.time_s[0]);
  const MotionRecord second = record.part(middle_s, end_s, kLead_s);
  ModelComparison out;
  for (const Named& variant : variants(choice)) {
    if (progress) progress(variant.name);
    const ParameterSet set(believed(experiment), experiment.actuation.kind, variant.choice);
    ModelTrial trial;
    trial.name = variant.name;
    trial.parameters = set.size();
    const Refinement fit = identify(set, record, options);
    trial.all_rad = fit.rms_rad;
    out.motion_rad = fit.motion_rms_rad;
    trial.second_by_first_rad = predict(set, second, identify(set, first, options).x).rms_rad;
    trial.first_by_second_rad = predict(set, first, identify(set, second, options).x).rms_rad;
    out.trials.push_back(trial);
  }
  return out;
}

std::string comparison_text(const ModelComparison& comparison) {
  std::string text = fmt::format(
      "rms of a component of u in mrad; the motion's own about its mean: {:.1f}\n"
      "{:<34}{:>10}{:>12}{:>18}{:>18}\n",
      1e3 * comparison.motion_rad, "model", "unknowns", "whole", "second by first",
      "first by second");
  for (const ModelTrial& trial : comparison.trials)
    text += fmt::format("{:<34}{:>10}{:>12.2f}{:>18.2f}{:>18.2f}\n", trial.name, trial.parameters,
                        1e3 * trial.all_rad, 1e3 * trial.second_by_first_rad,
                        1e3 * trial.first_by_second_rad);
  return text;
}

}  // namespace softarm
