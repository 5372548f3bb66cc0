#include "dev/bench/plant_report.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace softarm {
namespace {

std::string number(double value, const char* unit = "") {
  return std::isfinite(value) ? fmt::format("{:.{}f}{}", value, value < 10.0 ? 1 : 0, unit) : "-";
}

using Json = nlohmann::ordered_json;

Json json_of(const TrialReport& report) {
  Json json{{"plant", report.plant},
            {"scene", name(report.scene)},
            {"method", report.trial.label},
            {"relative_tolerance", report.trial.tolerance},
            {"error_rad", report.error_rad},
            {"real_time_factor", report.factor},
            {"times_plain_cvode", report.rival_ratio},
            {"steps", report.counters.steps},
            {"residuals", report.counters.residual_evaluations},
            {"linearizations", report.counters.linearizations}};
  if (!report.failure.empty()) json["failure"] = report.failure;
  return json;
}

}  // namespace

std::string name(Scene scene) {
  constexpr const char* kNames[] = {"free", "smooth", "held"};
  return kNames[static_cast<std::size_t>(scene)];
}

std::string name(IntegratorMethod method) {
  constexpr const char* kNames[] = {"sdirk2", "cash4", "sdirk4", "erk", "cvode_bdf"};
  return kNames[static_cast<std::size_t>(method)];
}

std::string table(const PlantReport& report) {
  std::string text = fmt::format(
      "{} · {} · load {}\nreal-time factor: simulated over processor time, median of {} rounds; "
      "error: largest of any coordinate\n",
      report.build.processor, report.build.instruction_set, report.build.load, report.rounds);
  std::string title;
  for (const TrialReport& one : report.trials) {
    const std::string here = fmt::format("{}, {}", one.plant, name(one.scene));
    if (here != title) {
      title = here;
      text += fmt::format("\n{:<32}{:>9}{:>12}{:>9}{:>14}{:>9}{:>11}\n", title, "rtol", "error rad",
                          "factor", "x plain CVODE", "steps", "residuals");
    }
    text += fmt::format("  {:<30}{:>9.0e}{:>12}{:>9}{:>14}{:>9}{:>11}\n", one.trial.label,
                        one.trial.tolerance,
                        one.failure.empty() ? fmt::format("{:.1e}", one.error_rad) : one.failure,
                        number(one.factor), number(one.rival_ratio), one.counters.steps,
                        one.counters.residual_evaluations);
  }
  text +=
      fmt::format("\nrefined against {} pieces a segment, smooth drive\n{:>8}{:>14}{:>12}{:>9}\n",
                  kManyPieces, "pieces", "tip error mm", "error rad", "factor");
  for (const PiecesReport& one : report.pieces) {
    text += fmt::format("{:>8}{:>14.3g}{:>12.1e}{:>9}\n", one.pieces, 1e3 * one.tip_error_m,
                        one.error_rad, number(one.factor));
  }
  return text;
}

std::string json(const PlantReport& report) {
  Json json = json_of(report.build);
  json["rounds"] = report.rounds;
  json["duration_s"] = report.duration_s;
  json["trials"] = Json::array();
  for (const TrialReport& one : report.trials) json["trials"].push_back(json_of(one));
  json["pieces"] = Json::array();
  for (const PiecesReport& one : report.pieces)
    json["pieces"].push_back({{"pieces", one.pieces},
                              {"tip_error_m", one.tip_error_m},
                              {"error_rad", one.error_rad},
                              {"real_time_factor", one.factor}});
  return json.dump() + "\n";
}

}  // namespace softarm
