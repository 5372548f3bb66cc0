#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "dev/bench/loop_bench.hpp"

namespace softarm {
namespace {

using Json = nlohmann::ordered_json;

Json json_of(const Durations& durations) {
  return {{"count", durations.count},
          {"p50_us", durations.p50_us},
          {"p99_us", durations.p99_us},
          {"largest_us", durations.largest_us}};
}

Json json_of(const LoopScene& scene) {
  Json json{{"name", scene.name}, {"fifo", scene.fifo}, {"busy_processes", scene.busy_processes}};
  if (!scene.skipped.empty()) {
    json["skipped"] = scene.skipped;
    return json;
  }
  json.update({{"echo", json_of(scene.echo)},
               {"command", json_of(scene.command)},
               {"wait", json_of(scene.wait)},
               {"whole", json_of(scene.whole)},
               {"law", json_of(scene.law)},
               {"bare_lateness", json_of(scene.bare_lateness)},
               {"lateness", json_of(scene.lateness)},
               {"round_trip_p50_ratio", scene.round_trip_p50_ratio()},
               {"round_trip_p99_ratio", scene.round_trip_p99_ratio()},
               {"lateness_p99_ratio", scene.lateness_p99_ratio()},
               {"bare_missed", scene.bare_missed},
               {"missed", scene.missed},
               {"missed_asleep", scene.missed_asleep},
               {"stolen_s", scene.stolen_s},
               {"unanswered", scene.unanswered}});
  return json;
}

std::string row(const char* what, const Durations& durations) {
  return fmt::format("  {:<46}{:>9.1f}{:>10.1f}{:>11.1f}{:>8}\n", what, durations.p50_us,
                     durations.p99_us, durations.largest_us, durations.count);
}

std::string table(const LoopScene& scene, double period_ms) {
  std::string title = scene.name;
  if (scene.busy_processes > 0) title += fmt::format(" ({} busy processes)", scene.busy_processes);
  if (!scene.skipped.empty()) return fmt::format("\n{}: not measured. {}\n", title, scene.skipped);
  std::string text =
      fmt::format("\n{:<48}{:>9}{:>10}{:>11}{:>8}\n", title, "p50 us", "p99 us", "largest us", "n");
  text += row("round trip, bare echo", scene.echo);
  text += row("round trip, frame to command without the wait", scene.command);
  text += row("  the wait until the tick is due", scene.wait);
  text += row("  with the wait", scene.whole);
  if (scene.law.count > 0) text += row("state to the answer of a law in a process", scene.law);
  text += row("lateness, bare clock_nanosleep", scene.bare_lateness);
  text += row("lateness, softarmd's tick", scene.lateness);
  text += fmt::format(
      "  round trip over the echo's: p50 {:.2f} (aim 1.15), p99 {:.2f} (aim 1.3); lateness p99 "
      "{:.2f} (aim 1.5)\n  missed periods of {:g} ms: bare {}, softarmd {} ({} before it woke); "
      "without an answer: {}; stolen by the host: {:.1f} s\n",
      scene.round_trip_p50_ratio(), scene.round_trip_p99_ratio(), scene.lateness_p99_ratio(),
      period_ms, scene.bare_missed, scene.missed, scene.missed_asleep, scene.unanswered,
      scene.stolen_s);
  return text;
}

}  // namespace

std::string table(const LoopReport& report) {
  std::string text = fmt::format(
      "{} · {} · load {}\nsoftarmd at {:g} Hz, {:g} s a scene; frames of {} bytes, commands of "
      "{}\n",
      report.build.processor, report.build.instruction_set, report.build.load, report.rate_hz,
      report.seconds, report.frame_bytes, report.command_bytes);
  for (const LoopScene& scene : report.scenes) text += table(scene, 1e3 / report.rate_hz);
  return text;
}

std::string json(const LoopReport& report) {
  Json json = json_of(report.build);
  json.update({{"rate_hz", report.rate_hz},
               {"seconds", report.seconds},
               {"frame_bytes", report.frame_bytes},
               {"command_bytes", report.command_bytes},
               {"scenes", Json::array()}});
  for (const LoopScene& scene : report.scenes) json["scenes"].push_back(json_of(scene));
  return json.dump() + "\n";
}

}  // namespace softarm
