#include "apps/softarm/learned_output.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>

#include "softarm/base/version.hpp"
#include "softarm/commissioning/identification/learned_arm.hpp"
#include "softarm/config/load.hpp"
#include "softarm/recording/experiment_log.hpp"

namespace softarm {

void add_learned_option(CLI::App& command, std::string& file) {
  command.add_option(
      "--learned", file,
      "experiment to write: CONFIG with the stiffness, damping, gains and horizontal "
      "load that the model-based observer found");
}

LearnedOutput::LearnedOutput(const std::string& file, const Experiment& experiment,
                             const std::string& config, const Files& inputs)
    : experiment_(experiment), file_(file), config_(config) {
  if (file.empty()) return;
  if (experiment.estimation.observer != ObserverKind::model ||
      !experiment.estimation.model_observer.learn_parameters)
    throw CLI::ValidationError("--learned",
                               config +
                                   " learns nothing: estimation.observer is not model, or its "
                                   "learn_parameters is false");
  const auto folder = (std::filesystem::path(".") / file).parent_path();
  if (!std::filesystem::is_directory(folder))
    throw CLI::ValidationError("--learned", "there is no folder " + folder.string());
  output_.emplace(file, inputs_of(experiment, inputs));
}

std::string LearnedOutput::write(const std::optional<ObserverReport>& learned,
                                 const std::string& source) {
  if (!output_) return "";
  if (!learned) return file_ + " was not written: the observer did not run in ACTIVE";
  const std::string note = fmt::format("Learnt by softarm {} from {}.", version_text(), source);
  write_experiment(*output_,
                   learned_yaml(experiment_, *learned, note, config_, output_->partial()));
  fmt::print("{} has what was learnt: softarm run {}\n", file_, file_);
  return "";
}

}  // namespace softarm
