#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "dev/bench/recordings_bench.hpp"

namespace softarm {
namespace {

/// Published of the laboratory's own MuJoCo twin of the four-column arm, mm.
constexpr double kTwinLateral_mm = 3.03, kTwinAxial_mm = 1.07;

std::string milli(double value) {
  return std::isfinite(value) ? fmt::format("{:.2f}", 1e3 * value) : "-";
}

}  // namespace

std::string table(const ArenaReport& report) {
  std::string text = fmt::format(
      "RMS of what is predicted from measured pressures alone: u a component in mrad; the tip in "
      "S_0 in mm, lateral (2-vector) and axial; cycle: mean over cycles of 10 s, its mean removed, "
      "one rotation (published twin: {} / {} mm)\n{:<14}{:<32}{:>4}  {:<18}{:>8}{:>8}{:>9}{:>8}"
      "{:>9}{:>8}{:>14}{:>8}\n",
      kTwinLateral_mm, kTwinAxial_mm, "recording", "model", "n", "predicted", "u", "motion",
      "lateral", "motion", "axial", "motion", "cycle", "time s");
  for (const ArenaRow& row : report.rows) {
    const ArenaScore& s = row.score;
    const std::string cycle =
        s.cycle_lateral_m > 0.0
            ? fmt::format("{} / {}", milli(s.cycle_lateral_m), milli(s.cycle_axial_m))
            : "";
    text += fmt::format("{:<14}{:<32}{:>4}  {:<18}{:>8}{:>8}{:>9}{:>8}{:>9}{:>8}{:>14}{:>8.1f}{}\n",
                        row.recording, row.model, row.parameters, row.what, milli(s.u_rad),
                        milli(s.motion_rad), milli(s.lateral_m), milli(s.motion_lateral_m),
                        milli(s.axial_m), milli(s.motion_axial_m), cycle, row.seconds,
                        row.converged ? "" : "  NOT CONVERGED");
  }
  for (const ArenaChoice& choice : report.choices)
    text +=
        fmt::format("\n{}, bend\n{}\n{}, length\n{}", choice.recording,
                    selection_text(choice.bend, choice.bend.whole.motion_rms_rad, 1e3, "mrad"),
                    choice.recording,
                    selection_text(choice.stretch, choice.stretch.whole.motion_rms_rad, 1e3, "mm"));
  return text;
}

std::string json(const ArenaReport& report) {
  using Json = nlohmann::ordered_json;
  Json out{{"twin_lateral_mm", kTwinLateral_mm}, {"twin_axial_mm", kTwinAxial_mm}};
  out["rows"] = Json::array();
  for (const ArenaRow& row : report.rows) {
    const ArenaScore& s = row.score;
    out["rows"].push_back({{"recording", row.recording},
                           {"model", row.model},
                           {"predicted", row.what},
                           {"unknowns", row.parameters},
                           {"u_rad", s.u_rad},
                           {"motion_rad", s.motion_rad},
                           {"lateral_m", s.lateral_m},
                           {"motion_lateral_m", s.motion_lateral_m},
                           {"axial_m", s.axial_m},
                           {"motion_axial_m", s.motion_axial_m},
                           {"cycle_lateral_m", s.cycle_lateral_m},
                           {"cycle_axial_m", s.cycle_axial_m},
                           {"seconds", row.seconds},
                           {"converged", row.converged}});
  }
  out["choices"] = Json::array();
  for (const ArenaChoice& choice : report.choices)
    for (const bool bend : {true, false})
      for (const TermTrial& trial : (bend ? choice.bend : choice.stretch).trials)
        out["choices"].push_back({{"recording", choice.recording},
                                  {"of", bend ? "bend" : "length"},
                                  {"term", trial.name},
                                  {"unknowns", trial.parameters},
                                  {"unseen", trial.unseen},
                                  {"unseen_of", trial.unseen_of},
                                  {"kept", trial.kept},
                                  {"seconds", trial.seconds}});
  out["skipped"] = report.skipped;
  return out.dump(2) + "\n";
}

}  // namespace softarm
