#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "commissioning/preflight/valve_map.hpp"
#include "softarm/commissioning/preflight/checks.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {
namespace {

constexpr double kAtRest_bar = 0.05;  ///< of a vented chamber
constexpr double kShort = 0.15;       ///< of the pressure commanded
constexpr double kShort_bar = 0.01;   ///< at least: valves count in mbar
constexpr std::int64_t kSettled_ns = 300'000'000;

std::string valve_name(const Experiment& experiment, int valve) {
  int left = valve;
  for (std::size_t i = 0; i < experiment.actuation.segments.size(); ++i) {
    const int count = static_cast<int>(experiment.actuation.segments[i].size());
    if (left < count) return fmt::format("chamber {} of segment {}", left + 1, i + 1);
    left -= count;
  }
  return fmt::format("valve {}", valve);
}

/// Mean of every chamber over [from, to); empty if there is no measurement.
std::vector<double> mean_bar(const Observation& seen, std::int64_t from_ns, std::int64_t to_ns,
                             int chambers) {
  std::vector<double> mean(static_cast<std::size_t>(chambers), 0.0);
  double count = 0.0;
  for (const SeenPressures& each : seen.pressures) {
    if (each.arrival_ns < from_ns || each.arrival_ns >= to_ns || each.bar.size() != mean.size())
      continue;
    for (std::size_t j = 0; j < mean.size(); ++j) mean[j] += each.bar[j];
    count += 1.0;
  }
  if (count == 0.0) return {};
  for (double& each : mean) each /= count;
  return mean;
}

Finding check_pressures(const Experiment& experiment, const Observation& seen) {
  const char* check = "pressures";
  if (seen.pressures.empty()) {
    const std::string text =
        fmt::format("no measured pressures on {}", experiment.transport.lcm.measurement_channel);
    if (!experiment.safety.valve_readback) return Finding::not_checked(check, text);
    return Finding::failed(check, text,
                           "start softarm-valves; the daemon goes to FAULT without them "
                           "(daemon.safety.valve_readback)");
  }
  const int chambers = chamber_count(experiment.actuation);
  for (const SeenPressures& each : seen.pressures)
    if (each.bar.size() != static_cast<std::size_t>(chambers))
      return Finding::failed(
          check,
          fmt::format("{} pressures are measured, {} chambers configured", each.bar.size(),
                      chambers),
          "actuation.chambers of this arm, and the configuration softarm-valves was given");
  // Pressure from before must vent first.
  const std::vector<double> rest =
      mean_bar(seen, seen.start_ns + kSettled_ns, seen.rest_end_ns, chambers);
  if (rest.empty()) return Finding::not_checked(check, "none measured while the arm rested");
  if (seen.commanded_by_others)
    return Finding::not_checked(check, "another program commands pressures");
  const auto most = std::max_element(rest.begin(), rest.end(),
                                     [](double a, double b) { return std::abs(a) < std::abs(b); });
  if (std::abs(*most) <= kAtRest_bar)
    return Finding::passed(
        check, fmt::format("{} chambers, vented they show {:.3f} bar at most", chambers, *most));
  return Finding::failed(
      check,
      fmt::format("{} shows {:.3f} bar, expected 0 bar: nothing is commanded",
                  valve_name(experiment, static_cast<int>(most - rest.begin())), *most),
      "a valve that does not close, or a sensor's zero");
}

/// What is wrong with the pressures of one pulse; empty if nothing is. Sets `measured` to false if
/// there is no measurement.
std::vector<std::string> leaks_of(const Experiment& experiment, const Observation& seen,
                                  const Pulse& pulse, bool& measured) {
  std::vector<std::string> out;
  const int chambers = chamber_count(experiment.actuation);
  const std::int64_t middle_ns = pulse.held_ns + (pulse.end_ns - pulse.held_ns) / 2;
  const std::vector<double> early = mean_bar(seen, pulse.held_ns, middle_ns, chambers);
  const std::vector<double> late = mean_bar(seen, middle_ns, pulse.end_ns, chambers);
  measured = !early.empty() && !late.empty();
  if (!measured) return out;
  const auto own = static_cast<std::size_t>(pulse.valve);
  const double allowed_bar = std::max(kShort_bar, kShort * pulse.pressure_bar);
  const std::string name = valve_name(experiment, pulse.valve);
  if (early[own] - late[own] > allowed_bar)
    out.push_back(fmt::format("{} falls from {:.3f} to {:.3f} bar while {:.3f} bar is held", name,
                              early[own], late[own], pulse.pressure_bar));
  else if (late[own] < pulse.pressure_bar - allowed_bar)
    out.push_back(
        fmt::format("{} reaches {:.3f} bar of {:.3f} bar", name, late[own], pulse.pressure_bar));
  else if (late[own] > pulse.pressure_bar + allowed_bar)
    out.push_back(
        fmt::format("{} shows {:.3f} bar at {:.3f} bar", name, late[own], pulse.pressure_bar));
  for (std::size_t j = 0; j < late.size(); ++j)
    if (j != own && late[j] > experiment.actuation.min_pressure_bar + kAtRest_bar)
      out.push_back(fmt::format("{} shows {:.3f} bar when {} is filled",
                                valve_name(experiment, static_cast<int>(j)), late[j], name));
  return out;
}

Finding check_leaks(const Experiment& experiment, const Observation& seen) {
  std::vector<std::string> problems;
  std::size_t looked_at = 0;
  for (const Pulse& pulse : seen.pulses) {
    bool measured = false;
    for (std::string& problem : leaks_of(experiment, seen, pulse, measured))
      problems.push_back(std::move(problem));
    looked_at += measured ? 1 : 0;
  }
  if (looked_at == 0)
    return Finding::not_checked(
        "leaks", seen.pulses.empty() ? "no chamber was filled; --pulse does, and moves the arm"
                                     : "no pressures are measured");
  if (!problems.empty())
    return Finding::failed("leaks", fmt::format("{}", fmt::join(problems, "; ")),
                           "look for a leak, a burst or pinched tube, a weak supply; or sensors on "
                           "other tubes than their valves");
  const auto chambers = static_cast<std::size_t>(chamber_count(experiment.actuation));
  const std::string text = fmt::format("{} of {} chambers hold what is commanded within {:.0f} %",
                                       looked_at, chambers, 100.0 * kShort);
  return looked_at == chambers ? Finding::passed("leaks", text)
                               : Finding::not_checked("leaks", text);
}

}  // namespace

std::vector<Finding> check_valves(const Experiment& experiment, const Observation& seen,
                                  const std::vector<Finding>& geometry) {
  std::vector<Finding> out{check_pressures(experiment, seen)};
  // Even with a wrong handedness or length it is clear which chamber moves which segment.
  const bool readable = !failed(geometry, kUnits) && !failed(geometry, kOrder) &&
                        !failed(geometry, kQuaternions) && !failed(geometry, "handedness") &&
                        !failed(geometry, kStillCheck);
  out.push_back(readable ? check_valve_map(experiment, seen)
                         : Finding::not_checked("valve map", "fix what failed above first"));
  out.push_back(check_leaks(experiment, seen));
  return out;
}

std::vector<Finding> preflight(const Experiment& experiment, const Observation& seen) {
  std::vector<Finding> out = check_timing(experiment, seen);
  const std::vector<Finding> geometry = check_geometry(experiment, seen);
  const std::vector<Finding> valves = check_valves(experiment, seen, geometry);
  out.insert(out.end(), geometry.begin(), geometry.end());
  check_acceptance(experiment, seen, out);
  out.insert(out.end(), valves.begin(), valves.end());
  return out;
}

std::string obstacle_to_pulses(const std::vector<Finding>& at_rest) {
  std::vector<std::string> blocking;
  for (const char* check :
       {kBodies, kStillCheck, kUnits, kOrder, kWorldAxes, kQuaternions, kAccepted})
    if (failed(at_rest, check)) blocking.push_back(check);
  return blocking.empty() ? "" : fmt::format("{}", fmt::join(blocking, ", "));
}

double soft_pressure_bar(const Experiment& experiment, int segment, int chamber) {
  constexpr double kBend_rad = 0.15;
  const auto i = static_cast<std::size_t>(segment);
  const Chamber& which = experiment.actuation.segments[i][static_cast<std::size_t>(chamber)];
  return kBend_rad * experiment.arm.segments[i].stiffness_nm_per_rad / which.gain_nm_per_bar;
}

}  // namespace softarm
