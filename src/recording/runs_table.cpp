#include "softarm/recording/runs_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <vector>

namespace softarm {
namespace {

using Json = nlohmann::json;
using Path = std::filesystem::path;
constexpr std::array kHead = {"run",          "duration [s]", "ACTIVE [s]",      "last mode",
                              "u rms [mrad]", "tip rms [mm]", "largest command", "saturated [%]"};
using Line = std::array<std::string, kHead.size()>;

/// A number of a summary, times `factor`; a dash where it is null or absent.
std::string number(const Json& summary, const char* pointer, double factor, int digits) {
  const Json::json_pointer at(pointer);
  if (!summary.contains(at) || !summary.at(at).is_number()) return "-";
  return fmt::format("{:.{}f}", factor * summary.at(at).get<double>(), digits);
}

/// Bar, or N m where commands are moments.
std::string command(const Json& summary) {
  const bool torques = summary.contains("torque_nm");
  const std::string value =
      number(summary, torques ? "/torque_nm/max" : "/pressure_bar/max", 1.0, 3);
  return value == "-" ? value : value + (torques ? " N m" : " bar");
}

Line line(const Path& folder, const Path& file, Files& unreadable) {
  Line out;
  out[0] = file.parent_path().lexically_relative(folder).string();
  const Json summary = Json::parse(std::ifstream(file), nullptr, false);
  if (!summary.is_object()) {
    out[1] = "unreadable summary.json";
    unreadable.push_back(file);
    return out;
  }
  const Json& transitions = summary.value("transitions", Json::array());
  const bool known =
      transitions.is_array() && !transitions.empty() && transitions.back().is_object();
  out[1] = number(summary, "/duration_s", 1.0, 1);
  out[2] = number(summary, "/modes/ACTIVE", 1.0, 1);
  out[3] = known ? transitions.back().value("mode", "-") : "-";
  out[4] = number(summary, "/tracking/u_rms_rad", 1e3, 2);
  out[5] = number(summary, "/tracking/tip_rms_m", 1e3, 2);
  out[6] = command(summary);
  out[7] = number(summary, "/saturated_fraction", 1e2, 2);
  return out;
}

}  // namespace

RunsTable runs_table(const Path& folder) {
  std::vector<Path> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.path().filename() == "summary.json") files.push_back(entry.path());
  }
  if (files.empty()) {
    throw std::runtime_error(fmt::format(
        "{}: expected folders of runs, with a summary.json each, found none", folder.string()));
  }
  std::sort(files.begin(), files.end());
  std::vector<Line> lines(1);
  std::copy(kHead.begin(), kHead.end(), lines[0].begin());
  RunsTable table;
  for (const Path& file : files) lines.push_back(line(folder, file, table.unreadable));

  for (const Line& each : lines) {
    for (std::size_t k = 0; k < each.size(); ++k) {
      std::size_t width = 0;
      for (const Line& other : lines) width = std::max(width, other[k].size());
      table.text +=
          k == 0 ? fmt::format("{:<{}}", each[k], width) : fmt::format("  {:>{}}", each[k], width);
    }
    table.text += '\n';
  }
  return table;
}

}  // namespace softarm
