// The words and the JSON of softarm-dev bench control, stability and softness.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "dev/bench/control_bench.hpp"

namespace softarm {
namespace {

std::string error_cell(const ControlScene& scene, const TrackingTrial& trial) {
  const double error = 1e3 * (scene.follows_tip ? trial.tip_rms_m : trial.u_rms_rad);
  return fmt::format("{:>12}{}", std::isfinite(error) ? fmt::format("{:.3g}", error) : "-",
                     trial.stayed_active ? "" : "  left ACTIVE");
}

using Json = nlohmann::ordered_json;

Json json_of(const std::vector<ControlRow>& rows) {
  Json list = Json::array();
  for (const ControlRow& row : rows)
    list.push_back({{"what", row.what},
                    {"rate_hz", row.rate_hz},
                    {"u_rms_rad", row.trial.u_rms_rad},
                    {"tip_rms_m", row.trial.tip_rms_m},
                    {"stayed_active", row.trial.stayed_active},
                    {"controller_ns", row.controller_ns > 0.0 ? row.controller_ns : std::nan("")}});
  return list;
}

}  // namespace

std::string table(const std::vector<ControlScene>& scenes) {
  std::string text;
  for (const ControlScene& scene : scenes) {
    const char* what = scene.follows_tip ? "tip [mm rms]" : "u [mrad rms]";
    text += fmt::format("{:<22}{:>12}\n", scene.name, what);
    for (const ControlRow& row : scene.rates)
      text += fmt::format("  {:<20}{}\n", row.what, error_cell(scene, row.trial));
    text += fmt::format("{:<22}{:>12}{:>10}\n", fmt::format("  at {:g} Hz", scene.terms[0].rate_hz),
                        what, "[ns]");
    for (const ControlRow& row : scene.terms)
      text += fmt::format("  {:<20}{:>12.12}{:>10.0f}{}\n", row.what, error_cell(scene, row.trial),
                          row.controller_ns, row.trial.stayed_active ? "" : "  left ACTIVE");
    text += "\n";
  }
  return text + "ns: processor time of a call of the controller, median\n";
}

std::string json(const std::vector<ControlScene>& scenes) {
  Json list = Json::array();
  for (const ControlScene& scene : scenes)
    list.push_back({{"name", scene.name},
                    {"follows_tip", scene.follows_tip},
                    {"rates", json_of(scene.rates)},
                    {"terms", json_of(scene.terms)}});
  return Json{{"scenes", std::move(list)}}.dump() + "\n";
}

std::string table(const std::vector<StabilityMap>& maps) {
  std::string text = "largest stable K_P of the straight arm, N m/rad\n";
  for (const StabilityMap& map : maps) {
    text += fmt::format("{:<16}{:>12}{:>12}\n", map.axis, "simulated", "predicted");
    for (std::size_t i = 0; i < map.values.size(); ++i)
      text += fmt::format("{:<16.4f}{:>12.3f}{:>12.3f}\n", map.values[i], map.simulated_limit[i],
                          map.predicted_limit[i]);
  }
  return text;
}

std::string json(const std::vector<StabilityMap>& maps) {
  Json list = Json::array();
  for (const StabilityMap& map : maps) {
    Json growth = Json::array(), stable = Json::array();
    for (const auto& column : map.simulated) {
      Json& rates = growth.emplace_back(Json::array());
      Json& verdicts = stable.emplace_back(Json::array());
      for (const KickedTrial& trial : column) {
        rates.push_back(trial.growth_1ps);
        verdicts.push_back(trial.stable);
      }
    }
    list.push_back({{"axis", map.axis},
                    {"values", map.values},
                    {"kp_nm_per_rad", map.kp_nm_per_rad},
                    {"simulated_limit_nm_per_rad", map.simulated_limit},
                    {"predicted_limit_nm_per_rad", map.predicted_limit},
                    {"growth_1ps", std::move(growth)},
                    {"stable", std::move(stable)}});
  }
  return Json{{"maps", std::move(list)}}.dump() + "\n";
}

std::string table(const std::vector<SoftnessRow>& rows) {
  std::string text = fmt::format("{:<20}{:>14}{:>18}{:>18}{:>18}\n", "law", "K_P [N m/rad]",
                                 "predicted [N/m]", "simulated [N/m]", "u [mrad rms]");
  for (const SoftnessRow& row : rows)
    text += fmt::format("{:<20}{:>14g}{:>18.3f}{:>18.3f}{:>18.3f}\n", row.law, row.kp_nm_per_rad,
                        row.predicted_n_per_m, row.simulated_n_per_m, 1e3 * row.tracking_rms_rad);
  return text;
}

std::string json(const std::vector<SoftnessRow>& rows) {
  Json list = Json::array();
  for (const SoftnessRow& row : rows)
    list.push_back({{"law", row.law},
                    {"kp_nm_per_rad", row.kp_nm_per_rad},
                    {"predicted_n_per_m", row.predicted_n_per_m},
                    {"simulated_n_per_m", row.simulated_n_per_m},
                    {"tracking_rms_rad", row.tracking_rms_rad}});
  return Json{{"rows", std::move(list)}}.dump() + "\n";
}

}  // namespace softarm
