// From a YAML file to a checked experiment, and back to text.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "softarm/config/config_error.hpp"
#include "softarm/config/experiment.hpp"

namespace softarm {

/// Reads and checks an experiment, with the files it includes. Every value of the result is finite,
/// in its range and consistent with the others.
/// @throws ConfigError, no other exception
Experiment load_experiment(const std::filesystem::path& file);

/// Writes an experiment, which replaces the file's only if it loads. @throws ConfigError, OutputError
Experiment write_experiment(OutputFile& file, const std::string& text);

/// The whole configuration as YAML, every default written out, units in comments. Loads again to
/// the same experiment.
std::string resolved_text(const Experiment& experiment);

/// Every key with its meaning, type, unit, range and default, as a configuration that loads
/// (config/template.yaml).
std::string template_text();

/// The JSON Schema (draft 7) by which editors complete and check an experiment
/// (config/experiment.schema.json). It accepts what load_experiment accepts, and more: conditions
/// across several keys, or across including files, are not checked.
std::string schema_text();

/// Warnings about settings that are allowed but probably not intended, one sentence each: gains
/// that the declared delay does not allow, motion capture too slow for the safety thresholds. Empty
/// if all is well.
std::vector<std::string> experiment_warnings(const Experiment& experiment);

/// What the thresholds come to, in words and seconds, one line each: when the daemon holds, vents and
/// faults, and when the valves vent by themselves.
std::vector<std::string> reaction_times(const Experiment& experiment);

/// Sixteen hexadecimal digits, the form of Experiment::hash in logs and in the status message.
std::string hash_text(std::uint64_t hash);

}  // namespace softarm
