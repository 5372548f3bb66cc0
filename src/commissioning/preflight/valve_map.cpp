#include "commissioning/preflight/valve_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "commissioning/preflight/geometry.hpp"
#include "softarm/model/coordinates.hpp"
#include "softarm/model/statics.hpp"

namespace softarm {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kDirection_rad = 0.35;
constexpr double kWeakest = 0.5, kStrongest = 2.0;  ///< of the configured gain

double wrapped(double angle_rad) { return std::remainder(angle_rad, 2.0 * kPi); }

std::string chamber_name(int segment, int chamber) {
  return fmt::format("chamber {} of segment {}", chamber + 1, segment + 1);
}

/// The chamber, of the segment it acts on, whose angle fits the measurement; -1 if there is none.
int acts_like(const Experiment& experiment, const PulseResponse& response) {
  const auto& chambers = experiment.actuation.segments[static_cast<std::size_t>(response.segment)];
  for (std::size_t j = 0; j < chambers.size(); ++j)
    if (std::abs(wrapped(response.measured_rad - chambers[j].angle_rad)) < kDirection_rad)
      return static_cast<int>(j);
  return -1;
}

using Responses = std::vector<PulseResponse>;

/// The single mistake that explains all chambers; empty if there is none.
std::string common_cause(const Responses& responses, std::string& fix) {
  const auto all = [&](auto&& holds) {
    return std::all_of(responses.begin(), responses.end(), holds);
  };
  if (all([](const PulseResponse& each) { return each.silent(); })) {
    fix = "open the air supply; is the valve driver running, and not DEGRADED?";
    return "no chamber moves the arm";
  }
  if (!all([](const PulseResponse& each) { return !each.silent() && !each.astray(); })) return "";
  const double turned_rad = responses.front().turned_rad();
  if (std::abs(turned_rad) > kDirection_rad && all([&](const PulseResponse& each) {
        return std::abs(wrapped(each.turned_rad() - turned_rad)) < kDirection_rad;
      })) {
    const bool half = std::abs(std::abs(turned_rad) - kPi) < kDirection_rad;
    fix = fmt::format("{}actuation.chambers.angle_rad, or turn the bodies' x axes",
                      half ? "the arm bends away from a chamber at angle_rad: add pi to " : "");
    return fmt::format("all chambers are turned by {:.2f} rad about the arm", turned_rad);
  }
  const double sum_rad = responses.front().measured_rad + responses.front().configured_rad;
  if (all([&](const PulseResponse& each) {
        return std::abs(wrapped(each.measured_rad + each.configured_rad - sum_rad)) <
               kDirection_rad;
      })) {
    fix =
        "make the world of the motion capture right-handed; or, if it is, count the chambers the "
        "other way round in actuation.chambers.angle_rad";
    return "every segment bends as in a mirror";
  }
  return "";
}

std::string one_problem(const Experiment& experiment, const PulseResponse& response) {
  const std::string name = chamber_name(response.pulse.segment, response.pulse.chamber);
  if (response.silent())
    return fmt::format("{} moves nothing: {:.4f} N m of {:.4f} N m", name, response.measured_nm,
                       response.configured_nm);
  const int like = acts_like(experiment, response);
  if (response.astray())
    return like >= 0 ? fmt::format("{} acts as {}", name, chamber_name(response.segment, like))
                     : fmt::format("{} bends segment {}", name, response.segment + 1);
  if (std::abs(response.turned_rad()) > kDirection_rad)
    return like >= 0 ? fmt::format("{} acts as {}", name, chamber_name(response.segment, like))
                     : fmt::format("{} acts at {:.2f} rad, {:.2f} rad configured", name,
                                   response.measured_rad, response.configured_rad);
  const double ratio = response.measured_nm / response.configured_nm;
  if (ratio < kWeakest || ratio > kStrongest)
    return fmt::format("{} pushes with {:.2f} of the configured gain", name, ratio);
  return "";
}

/// The valves.order with which every chamber acts as configured; empty if that is not a
/// permutation.
std::vector<int> corrected_order(const Experiment& experiment, const Responses& responses) {
  std::vector<int> first(1, 0);
  for (const auto& chambers : experiment.actuation.segments)
    first.push_back(first.back() + static_cast<int>(chambers.size()));
  const std::vector<int>& order = experiment.valves.order;
  std::vector<int> corrected(static_cast<std::size_t>(first.back()), -1);
  if (responses.size() != corrected.size() || order.size() != corrected.size()) return {};
  for (const PulseResponse& each : responses) {
    const int like = each.silent() ? -1 : acts_like(experiment, each);
    if (like < 0) return {};
    int& slot =
        corrected[static_cast<std::size_t>(first[static_cast<std::size_t>(each.segment)] + like)];
    if (slot >= 0) return {};
    slot = order[static_cast<std::size_t>(each.pulse.valve)];
  }
  return corrected;
}

std::string strength_text(const Responses& responses) {
  double weakest = 1e300, strongest = 0.0;
  for (const PulseResponse& each : responses) {
    weakest = std::min(weakest, each.measured_nm / each.configured_nm);
    strongest = std::max(strongest, each.measured_nm / each.configured_nm);
  }
  return fmt::format(
      "{} chambers bend their segments the right way, with {:.2f} to {:.2f} of the configured gain",
      responses.size(), weakest, strongest);
}

}  // namespace

double PulseResponse::turned_rad() const { return wrapped(measured_rad - configured_rad); }

std::optional<PulseResponse> response_to(const Experiment& experiment, const Observation& seen,
                                         const Pulse& pulse) {
  const int bodies = experiment.arm.size() + 1;
  Eigen::VectorXd before_rad, held_rad;
  if (!curvature_of(experiment, mean_poses(seen, pulse.before_ns, pulse.start_ns, bodies),
                    before_rad) ||
      !curvature_of(experiment, mean_poses(seen, pulse.held_ns, pulse.end_ns, bodies), held_rad))
    return std::nullopt;
  const ArmParameters arm = at_rest_length(experiment.arm);
  DynamicsWorkspace workspace(arm);
  Eigen::VectorXd moment_nm(arm.dof()), before_nm(arm.dof());
  static_moments(arm, workspace, held_rad, moment_nm);
  static_moments(arm, workspace, before_rad, before_nm);
  moment_nm -= before_nm;
  const Chamber& chamber = experiment.actuation.segments[static_cast<std::size_t>(pulse.segment)]
                                                        [static_cast<std::size_t>(pulse.chamber)];
  PulseResponse out{.pulse = pulse,
                    .configured_rad = chamber.angle_rad,
                    .configured_nm = chamber.gain_nm_per_bar *
                                     (pulse.pressure_bar - experiment.actuation.min_pressure_bar)};
  for (int i = 0; i < experiment.arm.size(); ++i) {
    const Eigen::Vector2d one = moment_nm.segment<2>(2 * i);
    if (one.norm() <= out.measured_nm) continue;
    out.segment = i;
    out.measured_nm = one.norm();
    out.measured_rad = std::atan2(-one.y(), -one.x());  // it bends away from the chamber
  }
  return out;
}

Finding check_valve_map(const Experiment& experiment, const Observation& seen) {
  const char* check = "valve map";
  if (seen.pulses.empty())
    return Finding::not_checked(check, "no chamber was filled; --pulse does, and moves the arm");
  Responses responses;
  std::vector<std::string> problems;
  for (const Pulse& pulse : seen.pulses) {
    const auto response = response_to(experiment, seen, pulse);
    if (response)
      responses.push_back(*response);
    else
      problems.push_back("not every segment was seen while " +
                         chamber_name(pulse.segment, pulse.chamber) + " was filled");
  }
  std::string fix;
  if (const std::string cause = problems.empty() ? common_cause(responses, fix) : "";
      !cause.empty())
    return Finding::failed(check, cause, fix);
  for (const PulseResponse& each : responses)
    if (std::string problem = one_problem(experiment, each); !problem.empty())
      problems.push_back(std::move(problem));
  if (!problems.empty()) {
    const std::vector<int> order = corrected_order(experiment, responses);
    return Finding::failed(
        check, fmt::format("{}", fmt::join(problems, "; ")),
        order.empty() || order == experiment.valves.order
            ? "tubes, valves.order and actuation.chambers (angle_rad, gain_nm_per_bar)"
            : fmt::format("exchange the tubes, or valves.order: [{}] for softarm-valves",
                          fmt::join(order, ", ")));
  }
  const auto chambers = static_cast<std::size_t>(chamber_count(experiment.actuation));
  const std::string text = strength_text(responses);
  if (responses.size() == chambers) return Finding::passed(check, text);
  return Finding::not_checked(
      check, fmt::format("{}; {} were not filled", text, chambers - responses.size()));
}

}  // namespace softarm
