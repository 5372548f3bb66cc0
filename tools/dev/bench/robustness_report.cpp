// The table and the JSON of softarm-dev bench robustness.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "dev/bench/robustness_scenes.hpp"

namespace softarm {
namespace {

std::string cell_text(const RobustnessTrial& trial) {
  return trial.stayed_active ? fmt::format("{:.3g}", 1e3 * trial.u_rms_rad) : "left ACTIVE";
}

/// In ten columns; what is not measured is a dash.
std::string column(double value, int decimals) {
  if (std::isnan(value)) return fmt::format("{:>10}", "-");
  return decimals > 0 ? fmt::format("{:>10.{}f}", value, decimals)
                      : fmt::format("{:>10.3g}", value);
}

}  // namespace

std::string table(const std::vector<RobustnessRow>& rows, const std::vector<ObserverCost>& costs) {
  std::string text = fmt::format("{:<36}", "u [mrad rms], worst of the seeds");
  if (rows.empty()) return text + "\n";
  for (const RobustnessCell& cell : rows.front().cells)
    text += fmt::format("{:>23}", name(cell.law));
  text += fmt::format("{:>8}\n", "bound");
  for (const RobustnessRow& row : rows) {
    text += fmt::format("{:<36}", row.scene);
    for (const RobustnessCell& cell : row.cells)
      text += fmt::format("{:>23}", cell_text(cell.worst));
    text += row.bound_mrad > 0.0 ? fmt::format("{:>8.3g}\n", row.bound_mrad) : "\n";
  }
  // In detail: the observer with parameters where it was run, the last law otherwise.
  const auto& cells = rows.front().cells;
  auto at = std::find_if(cells.begin(), cells.end(), [](const RobustnessCell& cell) {
    return cell.law == RobustnessLaw::observer_parameters;
  });
  if (at == cells.end()) --at;
  const auto detailed = static_cast<std::size_t>(at - cells.begin());
  text +=
      fmt::format("\n{}:\n{:<36}{:>10}{:>10}{:>10}{:>10}{:>10}{:>10}{:>8}{:>10}\n", name(at->law),
                  "", "largest", "tip", "e", "pressure", "tick", "frame", "NIS", "surprised");
  text += fmt::format("{:<36}{:>10}{:>10}{:>10}{:>10}{:>10}{:>10}{:>8}{:>10}\n", "", "[mrad]",
                      "[mm]", "[mm]", "[bar/s]", "[us]", "[us]", "", "[%]");
  for (const RobustnessRow& row : rows) {
    const RobustnessTrial& trial = row.cells[detailed].worst;
    text += fmt::format("{:<36}{:>10.3g}{:>10.3g}{:>10.3g}{}{}{}{:>8.3f}{:>10.2g}\n", row.scene,
                        1e3 * trial.u_largest_rad, 1e3 * trial.tip_rms_m, 1e3 * trial.e_rms_m,
                        column(trial.pressure_rate_bar_per_s, 0), column(trial.tick_us, 1),
                        column(trial.frame_tick_us, 1), trial.nis, 100.0 * trial.surprised);
  }
  if (costs.empty()) return text;
  text += fmt::format("\n{:<36}{:>10}{:>10}\n", "the observer alone, segments", "tick [us]",
                      "frame [us]");
  for (const ObserverCost& cost : costs)
    text += fmt::format("{:<36}{:>10.1f}{:>10.1f}\n", cost.segments, cost.tick_us, cost.frame_us);
  return text;
}

std::string json(const std::vector<RobustnessRow>& rows, const std::vector<ObserverCost>& costs) {
  using Json = nlohmann::ordered_json;
  Json scenes = Json::array(), observer_costs = Json::array();
  for (const RobustnessRow& row : rows) {
    Json laws = Json::array();
    for (const RobustnessCell& cell : row.cells) {
      const RobustnessTrial& trial = cell.worst;
      Json& law = laws.emplace_back(Json{{"law", name(cell.law)}});
      for (const auto& [label, figure] : kRobustnessFigures) law[label] = trial.*figure;
      law["stayed_active"] = trial.stayed_active;
    }
    scenes.push_back(
        {{"scene", row.scene}, {"bound_mrad", row.bound_mrad}, {"laws", std::move(laws)}});
  }
  for (const ObserverCost& cost : costs)
    observer_costs.push_back(
        {{"segments", cost.segments}, {"tick_us", cost.tick_us}, {"frame_us", cost.frame_us}});
  const Json report{{"scenes", std::move(scenes)}, {"observer_costs", std::move(observer_costs)}};
  return report.dump() + "\n";
}

}  // namespace softarm
