#include <fmt/format.h>

#include <cmath>

#include "dev/bench/loop_bench.hpp"
#include "softarm/base/json_writer.hpp"

namespace softarm {
namespace {

void write(JsonWriter& json, const char* key, const Durations& durations) {
  json.key(key);
  json.open_object();
  json.member("count", durations.count);
  json.member("p50_us", durations.p50_us);
  json.member("p99_us", durations.p99_us);
  json.member("largest_us", durations.largest_us);
  json.close_object();
}

void write(JsonWriter& json, const LoopScene& scene) {
  json.open_object();
  json.member("name", scene.name);
  json.member("fifo", scene.fifo);
  json.member("busy_processes", scene.busy_processes);
  if (scene.skipped.empty()) {
    write(json, "echo", scene.echo);
    write(json, "command", scene.command);
    write(json, "wait", scene.wait);
    write(json, "whole", scene.whole);
    write(json, "bare_lateness", scene.bare_lateness);
    write(json, "lateness", scene.lateness);
    json.member("round_trip_p50_ratio", scene.round_trip_p50_ratio());
    json.member("round_trip_p99_ratio", scene.round_trip_p99_ratio());
    json.member("lateness_p99_ratio", scene.lateness_p99_ratio());
    json.member("bare_missed", scene.bare_missed);
    json.member("missed", scene.missed);
    json.member("missed_asleep", scene.missed_asleep);
    json.member("stolen_s", scene.stolen_s);
    json.member("unanswered", scene.unanswered);
  } else {
    json.member("skipped", scene.skipped);
  }
  json.close_object();
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
  JsonWriter json;
  json.open_object();
  write_build(json, report.build);
  json.member("rate_hz", report.rate_hz);
  json.member("seconds", report.seconds);
  json.member("frame_bytes", report.frame_bytes);
  json.member("command_bytes", report.command_bytes);
  json.key("scenes");
  json.open_array();
  for (const LoopScene& scene : report.scenes) write(json, scene);
  json.close_array();
  json.close_object();
  return json.text() + "\n";
}

}  // namespace softarm
