// softarm-dev bench python: the Python package beside C++ and SoRoMoX. C++ is timed here, the rest
// in bench/python_bench.py.
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "apps/program.hpp"
#include "dev/bench/python_peers.hpp"
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
  std::string rows;
  for (const DerivativeCost& cost : costs) {
    rows += fmt::format(
        R"({}{{"stretching":{},"segments":{},"forward_us":{},"derivatives_us":{},"forward_ratio":{},"static_ratio":{}}})",
        rows.empty() ? "" : ",", cost.stretching, cost.segments, cost.forward_us,
        cost.derivatives_us, cost.forward_ratio, cost.static_ratio);
  }
  return fmt::format(
      R"({{"controller_us":{},"tick_us":{},"forward_us":{},"derivatives_us":{},"derivatives":[{}]}})",
      peers.controller_us, peers.tick_us, peers.forward_us, peers.derivatives_us, rows);
}

/// Replaces this program; returns only where that fails.
int bench(const PythonBenchOptions& options) {
  const PythonPeers cpp = time_python_peers(load_experiment(options.config));
  const char* const chosen = std::getenv("SOFTARM_PYTHON");
  const std::string python = chosen ? chosen : SOFTARM_PYTHON_ENVIRONMENT "/bin/python";
  std::error_code error;
  const auto built =
      std::filesystem::read_symlink("/proc/self/exe", error).parent_path().parent_path() / "python";
  if (std::filesystem::exists(built / "softarm", error)) ::setenv("PYTHONPATH", built.c_str(), 1);
  std::vector<std::string> words = {python,
                                    shared_file("python_bench.py", SOFTARM_PYTHON_BENCH),
                                    options.config,
                                    std::to_string(options.seconds),
                                    as_json(cpp, time_derivatives()),
                                    options.json ? "json" : "table"};
  if (!options.soromox.empty()) words.push_back(options.soromox);
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  ::execv(pointers[0], pointers.data());
  print_error("softarm-dev", "cannot start " + python + ": " + std::strerror(errno) +
                                 "; tools/python_environment makes a Python for this");
  return kExitFailure;
}

}  // namespace

void add_bench_python_command(CLI::App& group) {
  auto options = std::make_shared<PythonBenchOptions>();
  options->config = shared_file("config/paper_arm.yaml", SOFTARM_CONFIG_FOLDER "/paper_arm.yaml");
  CLI::App* command = group.add_subcommand(
      "python", "The Python package beside C++ and SoRoMoX; plants on two cores");
  command->add_option("CONFIG", options->config, "experiment in YAML")->capture_default_str();
  command->add_option("--seconds", options->seconds, "time to measure for, in s")
      ->check(positive_seconds())
      ->capture_default_str();
  command->add_option("--soromox", options->soromox, "a Python that has soromox (PyPI)")
      ->check(CLI::ExistingFile);
  command->add_flag("--json", options->json, "print JSON instead of a table");
  command->callback([options] {
    if (const int code = bench(*options); code != kExitOk) throw CLI::RuntimeError(code);
  });
}

}  // namespace softarm
