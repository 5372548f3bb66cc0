#include "softarm/config/load.hpp"

namespace softarm {

Experiment load_experiment(const std::filesystem::path& file) {
  throw ConfigError(file.string(), 0, "", "a reader of configurations", "none yet");
}

}  // namespace softarm
