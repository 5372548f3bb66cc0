#include "softarm/commissioning/first_day.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>

#include "softarm/base/output_file.hpp"
#include "softarm/config/load.hpp"

namespace softarm {
namespace {

constexpr double kMove_s = 2.0, kHold_s = 1.0;  ///< of a first bend

std::filesystem::path journal_file(const std::filesystem::path& folder) {
  return folder / "journal.txt";
}

}  // namespace

bool Journal::is_in(const std::filesystem::path& folder) {
  return std::filesystem::exists(journal_file(folder));
}

Journal::Journal(const std::filesystem::path& folder) : file_(journal_file(folder)) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw OutputError(fmt::format("{}: {}", folder.string(), error.message()));
  std::ifstream input(file_);
  for (std::string line; std::getline(input, line);) {
    const std::size_t first = line.find(' '), second = line.find(' ', first + 1);
    if (first == std::string::npos || second == std::string::npos) continue;
    entries_.push_back({line.substr(0, first), std::strtoull(line.c_str() + first + 1, nullptr, 16),
                        line.substr(second + 1)});
  }
}

const Journal::Entry* Journal::find(std::string_view step, std::uint64_t experiment) const {
  const auto found = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& entry) {
    return entry.step == step && entry.experiment == experiment;
  });
  return found == entries_.end() ? nullptr : &*found;
}

void Journal::note(const Entry& entry) {
  entries_.erase(std::find_if(entries_.begin(), entries_.end(),
                              [&](const Entry& known) { return known.step == entry.step; }),
                 entries_.end());
  entries_.push_back(entry);
  std::string text;
  for (const Entry& each : entries_)
    text += fmt::format("{} {} {}\n", each.step, hash_text(each.experiment), each.found);
  write_text(file_, text, {});
}

double first_bend_rad(const Experiment& experiment) {
  return std::min(0.2, 0.25 * experiment.control.max_theta_rad);
}

double first_track_rad(const Experiment& experiment) {
  return std::min(0.3, 0.375 * experiment.control.max_theta_rad);
}

double first_bend_s(const Experiment& experiment) {
  return experiment.arm.size() * (2.0 * kMove_s + 2.0 * kHold_s);
}

std::string first_bend_yaml(const Experiment& experiment, const std::string& config) {
  const int n = experiment.arm.size();
  std::vector<double> phi_rad;
  for (const auto& chambers : experiment.actuation.segments)
    phi_rad.push_back(chambers.front().angle_rad);
  std::string text = fmt::format(
      "include: {}\nname: first_bend\nreference:\n  - kind: way_points\n    duration_s: {:g}\n"
      "    points:\n      - {{time_s: 0, theta_rad: 0}}\n",
      config, first_bend_s(experiment));
  for (int i = 0; i < n; ++i) {
    std::vector<double> theta_rad(static_cast<std::size_t>(n), 0.0);
    theta_rad[static_cast<std::size_t>(i)] = first_bend_rad(experiment);
    const double begin_s = i * (2.0 * kMove_s + 2.0 * kHold_s);
    for (const double time_s : {begin_s + kMove_s, begin_s + kMove_s + kHold_s})
      text += fmt::format("      - {{time_s: {:g}, theta_rad: [{:g}], phi_rad: [{:.9g}]}}\n",
                          time_s, fmt::join(theta_rad, ", "), fmt::join(phi_rad, ", "));
    for (const double time_s : {2.0 * kMove_s + kHold_s, 2.0 * kMove_s + 2.0 * kHold_s})
      text += fmt::format("      - {{time_s: {:g}, theta_rad: 0}}\n", begin_s + time_s);
  }
  return text + "  - {kind: set_point, theta_rad: 0}\n";
}

std::string first_track_yaml(const Experiment& experiment, const std::string& config) {
  return fmt::format(
      "include: {}\nname: first_track\nreference:\n  - {{kind: paper, theta_rad: {:g}}}\n", config,
      first_track_rad(experiment));
}

}  // namespace softarm
