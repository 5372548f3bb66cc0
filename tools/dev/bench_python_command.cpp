// softarm-dev bench python: the Python package beside C++ and SoRoMoX. C++ is timed here, the rest
// in bench/python_bench.py.
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "apps/program.hpp"
#include "apps/python.hpp"
#include "dev/bench/python_peers.hpp"
#include "dev/bench_report.hpp"
#include "dev/commands.hpp"
#include "softarm/config/load.hpp"

namespace softarm {
namespace {

struct PythonBenchOptions {
  std::string config, soromox;
  double seconds = 30.0;
  bool json = false;
};

std::string as_json(const PythonPeers& peers, const std::vector<DerivativeCost>& costs) {
  nlohmann::ordered_json json{{"controller_us", peers.controller_us},
                              {"tick_us", peers.tick_us},
                              {"forward_us", peers.forward_us},
                              {"derivatives_us", peers.derivatives_us},
                              {"derivatives", nlohmann::ordered_json::array()}};
  for (const DerivativeCost& cost : costs)
    json["derivatives"].push_back({{"stretching", cost.stretching},
                                   {"segments", cost.segments},
                                   {"forward_us", cost.forward_us},
                                   {"derivatives_us", cost.derivatives_us},
                                   {"forward_ratio", cost.forward_ratio},
                                   {"static_ratio", cost.static_ratio}});
  return json.dump();
}

int bench(const PythonBenchOptions& options) {
  const PythonPeers cpp = time_python_peers(load_experiment(options.config));
  std::vector<std::string> words = {shared_file("python_bench.py", SOFTARM_PYTHON_BENCH),
                                    options.config, std::to_string(options.seconds),
                                    as_json(cpp, time_derivatives()),
                                    options.json ? "json" : "table"};
  if (!options.soromox.empty()) words.push_back(options.soromox);
  return become_python("softarm-dev", std::move(words));
}

}  // namespace

void add_bench_python_command(CLI::App& group) {
  auto options = std::make_shared<PythonBenchOptions>();
  options->config = shipped_config("paper_arm.yaml");
  CLI::App* command = group.add_subcommand(
      "python", "The Python package beside C++ and SoRoMoX; plants on two cores");
  command->add_option("CONFIG", options->config, "experiment in YAML")->capture_default_str();
  command->add_option("--seconds", options->seconds, "time to measure for, in s")
      ->check(positive_seconds())
      ->capture_default_str();
  command->add_option("--soromox", options->soromox, "a Python that has soromox (PyPI)")
      ->check(CLI::ExistingFile);
  command->add_flag("--json", options->json, "print JSON instead of a table");
  run_where_given(*command, [options] { return bench(*options); });
}

}  // namespace softarm
