// The words and the JSON of softarm-dev bench control, stability and softness.
#include <fmt/format.h>

#include <cmath>

#include "dev/bench/control_bench.hpp"
#include "softarm/base/json_writer.hpp"

namespace softarm {
namespace {

std::string error_cell(const ControlScene& scene, const TrackingTrial& trial) {
  const double error = 1e3 * (scene.follows_tip ? trial.tip_rms_m : trial.u_rms_rad);
  return fmt::format("{:>12}{}", std::isfinite(error) ? fmt::format("{:.3g}", error) : "-",
                     trial.stayed_active ? "" : "  left ACTIVE");
}

void write_row(JsonWriter& json, const ControlRow& row) {
  json.open_object();
  json.member("what", row.what);
  json.member("rate_hz", row.rate_hz);
  json.member("u_rms_rad", row.trial.u_rms_rad);
  json.member("tip_rms_m", row.trial.tip_rms_m);
  json.member("stayed_active", row.trial.stayed_active);
  json.member("controller_ns", row.controller_ns > 0.0 ? row.controller_ns : std::nan(""));
  json.close_object();
}

void write_list(JsonWriter& json, const char* key, const std::vector<double>& values) {
  json.key(key);
  json.open_array();
  for (const double value : values) json.value(value);
  json.close_array();
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
  JsonWriter json;
  json.open_object();
  json.key("scenes");
  json.open_array();
  for (const ControlScene& scene : scenes) {
    json.open_object();
    json.member("name", scene.name);
    json.member("follows_tip", scene.follows_tip);
    for (const auto& [key, rows] : {std::pair{"rates", &scene.rates}, {"terms", &scene.terms}}) {
      json.key(key);
      json.open_array();
      for (const ControlRow& row : *rows) write_row(json, row);
      json.close_array();
    }
    json.close_object();
  }
  json.close_array();
  json.close_object();
  return json.text() + "\n";
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
  JsonWriter json;
  json.open_object();
  json.key("maps");
  json.open_array();
  for (const StabilityMap& map : maps) {
    json.open_object();
    json.member("axis", map.axis);
    write_list(json, "values", map.values);
    write_list(json, "kp_nm_per_rad", map.kp_nm_per_rad);
    write_list(json, "simulated_limit_nm_per_rad", map.simulated_limit);
    write_list(json, "predicted_limit_nm_per_rad", map.predicted_limit);
    json.key("growth_1ps");
    json.open_array();
    for (const auto& column : map.simulated) {
      json.open_array();
      for (const KickedTrial& trial : column) json.value(trial.growth_1ps);
      json.close_array();
    }
    json.close_array();
    json.key("stable");
    json.open_array();
    for (const auto& column : map.simulated) {
      json.open_array();
      for (const KickedTrial& trial : column) json.value(trial.stable);
      json.close_array();
    }
    json.close_array();
    json.close_object();
  }
  json.close_array();
  json.close_object();
  return json.text() + "\n";
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
  JsonWriter json;
  json.open_object();
  json.key("rows");
  json.open_array();
  for (const SoftnessRow& row : rows) {
    json.open_object();
    json.member("law", row.law);
    json.member("kp_nm_per_rad", row.kp_nm_per_rad);
    json.member("predicted_n_per_m", row.predicted_n_per_m);
    json.member("simulated_n_per_m", row.simulated_n_per_m);
    json.member("tracking_rms_rad", row.tracking_rms_rad);
    json.close_object();
  }
  json.close_array();
  json.close_object();
  return json.text() + "\n";
}

}  // namespace softarm
