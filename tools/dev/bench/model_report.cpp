#include "dev/bench/model_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace softarm {
namespace {

std::string label(const Method& method) {
  return fmt::format("{:<24} {:<5} {:<15}", name(method.route), coordinates(method),
                     name(method.mass));
}

std::string cell(const CallTime& time) {
  if (time.rounds == 0) return "-";
  const double spread = 50.0 * (time.upper_ns - time.lower_ns) / time.median_ns;
  return fmt::format("{:.0f} ±{:.0f}%", time.median_ns, spread);
}

/// Right-aligned in `width` columns of a terminal, where ± is one.
std::string right(const std::string& text, std::size_t width) {
  const auto columns = static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
  return std::string(columns < width ? width - columns : 0, ' ') + text;
}

std::string error_cell(const LargestError& error) {
  return error.states == 0 ? "-" : fmt::format("{:.1e}", error.relative);
}

std::string times_table(const ModelReport& report) {
  constexpr std::size_t kTime = 13, kError = 9;
  std::string text = fmt::format("{:<46}", "processor time of a call in ns, median ± half");
  for (std::size_t k = 0; k < report.segments.size(); ++k) text += right("", kTime);
  text += right("exponent", 10) + right("error", kError) + right("error", kError);
  text += fmt::format("\n{:<46}", "the distance of the quartiles in %");
  for (const int n : report.segments) text += right(fmt::format("n = {}", n), kTime);
  text += right("n 6..100", 10) + right("golden", kError) + right("sweep", kError) + "\n";
  for (const MethodReport& method : report.methods) {
    text += label(method.method);
    for (const CallTime& time : method.times) text += right(cell(time), kTime);
    text +=
        right(std::isfinite(method.exponent) ? fmt::format("{:.2f}", method.exponent) : "-", 10);
    text += right(error_cell(method.golden), kError) + right(error_cell(method.sweep), kError);
    text += "\n";
  }
  return text;
}

std::string ratios_table(const ModelReport& report) {
  constexpr std::size_t kRatio = 8;
  std::string text = fmt::format("{:<95}", "times as long, median of the rounds' ratios");
  for (const int n : report.segments) text += right(fmt::format("n = {}", n), kRatio);
  text += "\n";
  for (const RatioReport& ratio : report.ratios) {
    text += label(ratio.slow) + " / " + label(ratio.fast);
    for (const double x : ratio.ratios) {
      text += right(std::isfinite(x) ? fmt::format("{:.{}f}", x, x < 10.0 ? 2 : 1) : "-", kRatio);
    }
    text += "\n";
  }
  return text;
}

using Json = nlohmann::ordered_json;

Json json_of(const Method& method) {
  return {{"route", name(method.route)},
          {"coordinates", coordinates(method)},
          {"mass", name(method.mass)}};
}

Json json_of(const LargestError& error) {
  return {{"largest_relative_error", error.states > 0 ? error.relative : std::nan("")},
          {"states", error.states}};
}

Json json_of(const MethodReport& method, const std::vector<int>& segments) {
  Json times = Json::array();
  for (std::size_t k = 0; k < method.times.size(); ++k) {
    const CallTime& time = method.times[k];
    if (time.rounds == 0) continue;
    times.push_back({{"segments", segments[k]},
                     {"median_ns", time.median_ns},
                     {"lower_quartile_ns", time.lower_ns},
                     {"upper_quartile_ns", time.upper_ns},
                     {"rounds", time.rounds}});
  }
  return {{"method", json_of(method.method)},
          {"times", std::move(times)},
          {"exponent_6_to_100", method.exponent},
          {"golden", json_of(method.golden)},
          {"sweep", json_of(method.sweep)}};
}

Json json_of(const RatioReport& ratio, const std::vector<int>& segments) {
  Json ratios = Json::array();
  for (std::size_t k = 0; k < ratio.ratios.size(); ++k)
    if (std::isfinite(ratio.ratios[k]))
      ratios.push_back(Json{{"segments", segments[k]}, {"ratio", ratio.ratios[k]}});
  return {
      {"slow", json_of(ratio.slow)}, {"fast", json_of(ratio.fast)}, {"ratios", std::move(ratios)}};
}

}  // namespace

std::string table(const ModelReport& report) {
  const BenchBuild& b = report.build;
  return fmt::format(
      "compiler         {}, {}\ninstruction set  {}\nprocessor        {}, load {} in the last "
      "minute\n\n{}\n{}\n"
      "errors: over the size that the entries of a term can have, the largest of all terms;\n"
      "  golden: tests/golden/golden.json; sweep: three segments, theta from 1e-12 to 7 rad, "
      "against long double;\n"
      "  polar controller and KDL: from theta = 0.05 rad. KDL: {}\n",
      b.compiler, b.flags, b.instruction_set, b.processor, b.load, times_table(report),
      ratios_table(report),
      b.has_kdl ? "Debian's library, on the chain of Table I, maps (6), (11) included"
                : "not in this build (liborocos-kdl-dev)");
}

Json json_of(const BenchBuild& build) {
  return {{"compiler", build.compiler},
          {"flags", build.flags},
          {"instruction_set", build.instruction_set},
          {"processor", build.processor},
          {"load", build.load}};
}

std::string json(const ModelReport& report) {
  Json json = json_of(report.build);
  json["kdl"] = report.build.has_kdl;
  json["methods"] = Json::array();
  for (const MethodReport& method : report.methods)
    json["methods"].push_back(json_of(method, report.segments));
  json["ratios"] = Json::array();
  for (const RatioReport& ratio : report.ratios)
    json["ratios"].push_back(json_of(ratio, report.segments));
  return json.dump() + "\n";
}

}  // namespace softarm
