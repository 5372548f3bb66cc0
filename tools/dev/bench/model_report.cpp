#include "dev/bench/model_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "softarm/base/json_writer.hpp"

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

void write_method(JsonWriter& json, const Method& method) {
  json.open_object();
  json.member("route", name(method.route));
  json.member("coordinates", coordinates(method));
  json.member("mass", name(method.mass));
  json.close_object();
}

void write_error(JsonWriter& json, const char* key, const LargestError& error) {
  json.key(key);
  json.open_object();
  json.member("largest_relative_error", error.states > 0 ? error.relative : std::nan(""));
  json.member("states", error.states);
  json.close_object();
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

void write_build(JsonWriter& json, const BenchBuild& build) {
  json.member("compiler", build.compiler);
  json.member("flags", build.flags);
  json.member("instruction_set", build.instruction_set);
  json.member("processor", build.processor);
  json.member("load", build.load);
}

std::string json(const ModelReport& report) {
  JsonWriter json;
  json.open_object();
  write_build(json, report.build);
  json.member("kdl", report.build.has_kdl);
  json.key("methods");
  json.open_array();
  for (const MethodReport& method : report.methods) {
    json.open_object();
    json.key("method");
    write_method(json, method.method);
    json.key("times");
    json.open_array();
    for (std::size_t k = 0; k < method.times.size(); ++k) {
      const CallTime& time = method.times[k];
      if (time.rounds == 0) continue;
      json.open_object();
      json.member("segments", report.segments[k]);
      json.member("median_ns", time.median_ns);
      json.member("lower_quartile_ns", time.lower_ns);
      json.member("upper_quartile_ns", time.upper_ns);
      json.member("rounds", static_cast<std::int64_t>(time.rounds));
      json.close_object();
    }
    json.close_array();
    json.member("exponent_6_to_100", method.exponent);
    write_error(json, "golden", method.golden);
    write_error(json, "sweep", method.sweep);
    json.close_object();
  }
  json.close_array();
  json.key("ratios");
  json.open_array();
  for (const RatioReport& ratio : report.ratios) {
    json.open_object();
    json.key("slow");
    write_method(json, ratio.slow);
    json.key("fast");
    write_method(json, ratio.fast);
    json.key("ratios");
    json.open_array();
    for (std::size_t k = 0; k < ratio.ratios.size(); ++k) {
      if (!std::isfinite(ratio.ratios[k])) continue;
      json.open_object();
      json.member("segments", report.segments[k]);
      json.member("ratio", ratio.ratios[k]);
      json.close_object();
    }
    json.close_array();
    json.close_object();
  }
  json.close_array();
  json.close_object();
  return json.text() + "\n";
}

}  // namespace softarm
