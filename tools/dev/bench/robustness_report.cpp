// The table and the JSON of softarm-dev bench robustness.
#include <fmt/format.h>

#include "dev/bench/robustness_scenes.hpp"
#include "softarm/base/json_writer.hpp"

namespace softarm {
namespace {

std::string cell_text(const RobustnessTrial& trial) {
  return trial.stayed_active ? fmt::format("{:.3g}", 1e3 * trial.u_rms_rad) : "left ACTIVE";
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
  const RobustnessLaw last = rows.front().cells.back().law;
  text += fmt::format("\n{}:\n{:<36}{:>10}{:>10}{:>10}{:>10}{:>10}{:>8}{:>10}\n", name(last), "",
                      "largest", "tip", "pressure", "tick", "frame", "NIS", "surprised");
  text += fmt::format("{:<36}{:>10}{:>10}{:>10}{:>10}{:>10}{:>8}{:>10}\n", "", "[mrad]", "[mm]",
                      "[bar/s]", "[us]", "[us]", "", "[%]");
  for (const RobustnessRow& row : rows) {
    const RobustnessTrial& trial = row.cells.back().worst;
    text += fmt::format("{:<36}{:>10.3g}{:>10.3g}{:>10.3g}{:>10.1f}{:>10.1f}{:>8.3f}{:>10.2g}\n",
                        row.scene, 1e3 * trial.u_largest_rad, 1e3 * trial.tip_rms_m,
                        trial.pressure_rate_bar_per_s, trial.tick_us, trial.frame_tick_us,
                        trial.nis, 100.0 * trial.surprised);
  }
  text += fmt::format("\n{:<36}{:>10}{:>10}\n", "the observer alone, segments", "tick [us]",
                      "frame [us]");
  for (const ObserverCost& cost : costs)
    text += fmt::format("{:<36}{:>10.1f}{:>10.1f}\n", cost.segments, cost.tick_us, cost.frame_us);
  return text;
}

std::string json(const std::vector<RobustnessRow>& rows, const std::vector<ObserverCost>& costs) {
  JsonWriter json;
  json.open_object();
  json.key("scenes");
  json.open_array();
  for (const RobustnessRow& row : rows) {
    json.open_object();
    json.member("scene", row.scene);
    json.member("bound_mrad", row.bound_mrad);
    json.key("laws");
    json.open_array();
    for (const RobustnessCell& cell : row.cells) {
      const RobustnessTrial& trial = cell.worst;
      json.open_object();
      json.member("law", name(cell.law));
      json.member("u_rms_rad", trial.u_rms_rad);
      json.member("u_largest_rad", trial.u_largest_rad);
      json.member("tip_rms_m", trial.tip_rms_m);
      json.member("pressure_rate_bar_per_s", trial.pressure_rate_bar_per_s);
      json.member("tick_us", trial.tick_us);
      json.member("frame_tick_us", trial.frame_tick_us);
      json.member("nis", trial.nis);
      json.member("surprised", trial.surprised);
      json.member("stayed_active", trial.stayed_active);
      json.close_object();
    }
    json.close_array();
    json.close_object();
  }
  json.close_array();
  json.key("observer_costs");
  json.open_array();
  for (const ObserverCost& cost : costs) {
    json.open_object();
    json.member("segments", cost.segments);
    json.member("tick_us", cost.tick_us);
    json.member("frame_us", cost.frame_us);
    json.close_object();
  }
  json.close_array();
  json.close_object();
  return json.text() + "\n";
}

}  // namespace softarm
