#include "softarm/config/load.hpp"

#include <fmt/format.h>

#include <exception>

#include "config/checks.hpp"
#include "config/reader.hpp"
#include "config/writer.hpp"
#include "config/yaml_tree.hpp"

namespace softarm {
namespace {

/// FNV-1a, 64 bits.
std::uint64_t fnv1a(const std::string& text) {
  std::uint64_t hash = 14695981039346656037ull;
  for (const char c : text) {
    hash ^= static_cast<unsigned char>(c);
    hash *= 1099511628211ull;
  }
  return hash;
}

std::string print(const Experiment& experiment, Documentation documentation) {
  ExperimentWriter writer(documentation);
  Experiment copy = experiment;  // one description reads and writes; printing changes nothing
  describe_experiment(writer, copy);
  return writer.text();
}

Experiment read(const std::filesystem::path& file) {
  const YamlNode root = read_yaml_file(file);
  ExperimentReader reader(root);
  Experiment experiment;
  reader.read([&] { describe_experiment(reader, experiment); });
  check_consistency(experiment, reader);
  experiment.hash = fnv1a(resolved_text(experiment));
  return experiment;
}

}  // namespace

Experiment load_experiment(const std::filesystem::path& file) {
  try {
    return read(file);
  } catch (const ConfigError&) {
    throw;
  } catch (const std::exception& error) {  // out of memory, a faulty file system
    throw ConfigError(file.string(), 0, "", "a file that can be read", error.what());
  }
}

std::string resolved_text(const Experiment& experiment) {
  return print(experiment, Documentation::units);
}

std::string hash_text(std::uint64_t hash) { return fmt::format("{:016x}", hash); }

}  // namespace softarm
