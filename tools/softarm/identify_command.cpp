// softarm identify: stiffness, damping and gain of the PCC model from a step response, by linear
// least squares, as in the paper's section VI.
#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "experiment_log.hpp"
#include "identification/parameter_fit.hpp"
#include "program.hpp"
#include "softarm/commands.hpp"
#include "softarm/config/load.hpp"

namespace softarm {
namespace {

struct IdentifyOptions {
  std::string config;
  std::string output;
  bool per_segment = false;
  StepPlan plan;
  double window_s = 0.2;
  std::uint64_t seed = 0;
  bool has_seed = false;
};

void print_line(const char* name, const std::vector<Estimated>& values, const char* unit) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::string which = values.size() > 1 ? fmt::format(", segment {}", i + 1) : "";
    fmt::print("{:<28}{:>12.6g} +- {:.2g} {}\n", name + which, values[i].value,
               values[i].standard_error, unit);
  }
}

/// One number for all segments, or a list.
template <class Value>
std::string yaml_list(int segments, bool per_segment, const Value& value) {
  if (!per_segment) return fmt::format("{:.6g}", value(0));
  std::string text = "[";
  for (int i = 0; i < segments; ++i) text += fmt::format("{}{:.6g}", i > 0 ? ", " : "", value(i));
  return text + "]";
}

std::string chambers_yaml(const ActuationSettings& actuation, const ParameterFit* fit) {
  std::string text;
  for (std::size_t i = 0; i < actuation.segments.size(); ++i) {
    const std::size_t set = fit != nullptr && fit->gain_factor.size() > 1 ? i : 0;
    const double factor = fit != nullptr ? fit->gain_factor[set].value : 1.0;
    std::string angles, gains;
    for (const Chamber& chamber : actuation.segments[i]) {
      const char* comma = angles.empty() ? "" : ", ";
      angles += fmt::format("{}{:.17g}", comma, chamber.angle_rad);
      gains += fmt::format("{}{:.6g}", comma, factor * chamber.gain_nm_per_bar);
    }
    text += fmt::format("    - {{angle_rad: [{}], gain_nm_per_bar: [{}]}}\n", angles, gains);
  }
  return text;
}

/// The experiment with what was found in place of what was believed; its plant stays as it is.
std::string identified_yaml(const Experiment& experiment, const ParameterFit& fit,
                            const IdentifyOptions& options) {
  namespace fs = std::filesystem;
  const int n = experiment.arm.size();
  const auto& plant = experiment.plant.arm.segments;
  const auto at = [&](const std::vector<Estimated>& values) {
    return [&values](int i) { return values[static_cast<std::size_t>(i)].value; };
  };
  const auto of_plant = [&](double SegmentParameters::*member) {
    return [&plant, member](int i) { return plant[static_cast<std::size_t>(i)].*member; };
  };
  const fs::path folder = fs::absolute(options.output).parent_path();
  std::string text = fmt::format(
      "# Identified from a step response: residual {:.3g} N m rms, of moments of {:.3g} N m rms.\n"
      "include: {}\n\narm:\n  stiffness_nm_per_rad: {}\n  damping_nms_per_rad: {}\n",
      fit.residual_rms_nm, fit.moment_rms_nm,
      fs::proximate(fs::absolute(options.config), folder).string(),
      yaml_list(n, options.per_segment, at(fit.stiffness_nm_per_rad)),
      yaml_list(n, options.per_segment, at(fit.damping_nms_per_rad)));
  const bool gain = !fit.gain_factor.empty();
  if (gain) text += "\nactuation:\n  chambers:\n" + chambers_yaml(experiment.actuation, &fit);
  text += fmt::format(
      "\n# The simulated arm is what it was.\nplant:\n  arm:\n    stiffness_nm_per_rad: {}\n"
      "    damping_nms_per_rad: {}\n",
      yaml_list(n, true, of_plant(&SegmentParameters::stiffness_nm_per_rad)),
      yaml_list(n, true, of_plant(&SegmentParameters::damping_nms_per_rad)));
  if (gain) {
    std::string chambers = chambers_yaml(experiment.plant.actuation, nullptr);
    for (std::size_t at_line = 0; at_line < chambers.size();
         at_line = chambers.find('\n', at_line) + 1)
      chambers.insert(at_line, "  ");
    text += "  actuation:\n    chambers:\n" + chambers;
  }
  return text;
}

int identify(const IdentifyOptions& options) {
  Experiment experiment = load_experiment(options.config);
  if (options.has_seed) experiment.seed = experiment.plant.seed = options.seed;
  const StepResponse response = record_step_response(experiment, options.plan);
  const ParameterFit fit =
      fit_parameters(experiment, response, options.per_segment, options.window_s);
  print_line("stiffness k", fit.stiffness_nm_per_rad, "N m/rad");
  print_line("damping beta", fit.damping_nms_per_rad, "N m s/rad");
  print_line("gain over the configured", fit.gain_factor, "");
  fmt::print("residual {:.3g} N m rms, of moments of {:.3g} N m rms; bends up to {:.3g} rad\n",
             fit.residual_rms_nm, fit.moment_rms_nm, response.u_rad.cwiseAbs().maxCoeff());
  if (!options.output.empty()) {
    write_text(options.output, identified_yaml(experiment, fit, options));
    load_experiment(options.output);
    fmt::print("{} has them: softarm run {}\n", options.output, options.output);
  }
  return kExitOk;
}

}  // namespace

void add_identify_command(CLI::App& app) {
  auto options = std::make_shared<IdentifyOptions>();
  CLI::App* command = app.add_subcommand(
      "identify", "Stiffness, damping and gain from a step response of the simulated arm");
  command->add_option("CONFIG", options->config, "experiment in YAML")->required();
  command->add_option("--output", options->output,
                      "write an experiment that includes CONFIG and has the values found");
  command->add_flag("--per-segment", options->per_segment,
                    "values for every segment instead of one for all");
  command
      ->add_option("--bend", options->plan.bend_rad,
                   "largest step, as the bend in rad that the configured stiffness would allow")
      ->check(CLI::Range(0.01, 3.0))
      ->capture_default_str();
  command->add_option("--hold", options->plan.hold_s, "time between steps in s")
      ->check(CLI::Range(0.1, 100.0))
      ->capture_default_str();
  command->add_option("--window", options->window_s, "width of the smoothing window in s")
      ->check(CLI::Range(0.005, 10.0))
      ->capture_default_str();
  auto* seed = command->add_option("--seed", options->seed,
                                   "seed of noise and dropouts (default: the configuration's)");
  command->callback([options, seed] {
    options->has_seed = seed->count() > 0;
    if (const int code = identify(*options); code != kExitOk) throw CLI::RuntimeError(code);
  });
}

}  // namespace softarm
