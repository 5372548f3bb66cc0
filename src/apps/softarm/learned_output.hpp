// --learned FILE of softarm run, watch and report: what the model-based observer has learnt, as an
// experiment.
#pragma once

#include <optional>
#include <string>

#include "softarm/base/output_file.hpp"
#include "softarm/config/experiment.hpp"
#include "softarm/estimation/observer_report.hpp"

namespace CLI {
class App;
}

namespace softarm {

/// Declares the option.
void add_learned_option(CLI::App& command, std::string& file);

/// The file, opened before anything moves, so that a wrong name is refused before.
class LearnedOutput {
 public:
  /// @param file  empty: nothing will be written
  /// @param inputs  files that are read beside the experiment's
  /// @throws CLI::ValidationError where the experiment learns nothing; as OutputFile
  LearnedOutput(const std::string& file, const Experiment& experiment, const std::string& config,
                const Files& inputs = {});

  /// Writes what was learnt, checks that it loads, and prints that. @param source  what it was learnt
  /// from. @return why nothing was written; empty: it was, or nothing was asked for
  std::string write(const std::optional<ObserverReport>& learned, const std::string& source);

 private:
  const Experiment& experiment_;
  std::string file_, config_;
  std::optional<OutputFile> output_;
};

}  // namespace softarm
