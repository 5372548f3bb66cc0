// Configurations: what is accepted is written and read again as the same experiment, builds a
// pipeline, and lets that tick.
#include <cctype>
#include <set>

#include "fuzz/memory_file.hpp"
#include "fuzz/target.hpp"
#include "softarm/config/load.hpp"
#include "softarm/runtime/control_pipeline.hpp"
#include "unit/config/config_files.hpp"

namespace softarm::test {
namespace {

constexpr std::uint64_t kOneIn = 16;

void expect_the_same_again(const MemoryFile& file, const Experiment& experiment) {
  const std::string text = resolved_text(experiment);
  file.write(text);
  try {
    const Experiment again = load_experiment(file.path());
    require(resolved_text(again) == text, "what was accepted is written and read the same");
    require(again.hash == experiment.hash, "the same configuration has the same hash");
  } catch (const ConfigError& error) {
    throw BrokenProperty("what was accepted is accepted again: " + std::string(error.what()));
  }
}

}  // namespace

void run_yaml(std::span<const std::byte> input) {
  static const MemoryFile file;
  file.write(input);
  Experiment experiment;
  try {
    experiment = load_experiment(file.path());
  } catch (const ConfigError& error) {
    require(!error.expected.empty() && !error.got.empty(), "an error states what was expected");
    return;
  }
  expect_the_same_again(file, experiment);
  // Simulations, seconds of them under sanitizers: for some, chosen so that an input does it again.
  if (experiment.hash % kOneIn == 0) experiment_warnings(experiment);
  ControlPipeline pipeline(experiment);
  TickInput first;
  first.now_ns = 1'000'000'000;
  const TickOutput& output = pipeline.tick(first);
  require(output.pressure_bar.isZero(0.0), "no pressure without a frame");
}

std::vector<Bytes> yaml_seeds() {
  std::vector<Bytes> seeds = {to_bytes(std::string(kGoodExperiment))};
  for (const char* name :
       {"one_segment.yaml", "paper_arm.yaml", "planar_arm.yaml", "laboratory.yaml"})
    seeds.push_back(to_bytes(file_text(kConfigFolder / name)));
  return seeds;
}

/// Every key that there is, and what YAML makes of punctuation.
std::vector<std::string> yaml_words() {
  std::set<std::string> words = {
      "true", "false", "null", "~",   "pi",  "-pi/2", "3*pi/4", ".nan", ".inf", "-1e308", "1e-308",
      "- ",   ": ",    "{",    "}",   "[",   "]",     "? ",     "|\n",  ">\n",  "&a ",    "*a",
      "!!x ", "'",     "\"",   "---", "...", "\t",    "#",      "%",    "<<: ", "0",      "-1"};
  const std::string text = template_text();
  const auto of_key = [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; };
  for (std::size_t at = text.find(':'); at != std::string::npos; at = text.find(':', at + 1)) {
    std::size_t begin = at;
    while (begin > 0 && of_key(static_cast<unsigned char>(text[begin - 1]))) --begin;
    if (begin < at) words.insert(text.substr(begin, at - begin) + ": ");
  }
  return {words.begin(), words.end()};
}

}  // namespace softarm::test
