#include "config/checks.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <memory>
#include <set>
#include <stdexcept>

#include "config/describe.hpp"
#include "softarm/actuation/pressure_allocator.hpp"
#include "softarm/base/time.hpp"
#include "softarm/control/control_laws.hpp"
#include "softarm/control/reference.hpp"
#include "softarm/control/reference_kinds.hpp"
#include "softarm/control/repetition.hpp"
#include "softarm/runtime/elongation_reference.hpp"
#include "softarm/runtime/safety_monitor.hpp"
#include "softarm/valves/register_map.hpp"

namespace softarm {
namespace {

/// A stop vents within this time, whatever the pressures were, with all that comes before and after
/// the ramp.
constexpr double kLongestStop_s = 1.0;
constexpr int kTicksOfAStop = 4;  ///< one until it is noticed, three zero commands at the end
/// With real valves, whatever the derived thresholds would be.
constexpr double kLongestHold_s = 0.25;
constexpr double kLongestVentDelay_s = 0.5;
constexpr int kFramesATick = 64;  ///< that the daemon takes
constexpr double kMostGravity_mps2 = 20.0;
constexpr double kMostBend_rad = 20.0;  ///< of one chamber at full pressure against the spring
constexpr double kRotationTolerance = 1e-6;
constexpr double kInPlane_rad = 1e-6;
/// Work of the inverse in the tick grows with their square.
constexpr std::size_t kMaxPlays = 16;

std::string in_quotes(const std::string& text) { return "\"" + text + "\""; }

/// For messages.
std::string size_of(const auto& list) { return fmt::format("{}", list.size()); }

std::string with_unit(const std::string& key, double value) {
  const std::string_view unit = Key{key.c_str(), ""}.unit();
  return fmt::format("{:.6g}{}{}", value, unit.empty() ? "" : " ", unit);
}

class Checks {
 public:
  Checks(const Experiment& experiment, const ConfigKeys& keys)
      : experiment_(experiment), keys_(keys) {}

  void run() const {
    check_rotation("arm.base.rotation", arm_.base_rotation);
    check_rotation("plant.arm.base.rotation", experiment_.plant.arm.base_rotation);
    check_rotation("daemon.mocap.axes", transport_.mocap.axes);
    check_radius("arm", arm_, false);
    check_radius("plant.arm", experiment_.plant.arm,
                 experiment_.plant.kind.get_if<LinkSettings>() != nullptr);
    if (arm_.extensible) check_stretching_control();
    check_plant();
    check_actuation("actuation", actuation_);
    check_actuation("plant.actuation", experiment_.plant.actuation);
    check_same_chambers();
    check_bodies();
    check_safety();
    check_lcm();
    check_mocap_server();
    check_valves();
    check_loads();
    check_contact();
    check_module("control", "settings the controller can use", [&] {
      control_.law.make({arm_, control_, chamber_count(actuation_)});
    });
    check_inverse();
    check_identified();
    check_reference();
    if (control_.repetition.lead_s > 0.0) check_repetition();
    // What the form of each key allows, but cannot be meant: mostly slips of units.
    check_slips_of_the_arm();
    check_marker_frames();
    check_tick();
    if (drives_real_valves(experiment_)) check_times();
  }

 private:
  void require(bool holds, const std::string& key, const std::string& expected,
               const std::string& got) const {
    if (!holds) throw keys_.error_at(key, expected, got);
  }
  /// Of a number in the unit of the key.
  void require(bool holds, const std::string& key, const std::string& expected, double got) const {
    require(holds, key, expected, with_unit(key, got));
  }

  /// Compares a key's value with a bound; `what` names the bound, `why` gives the reason.
  void compare(bool holds, const char* relation, const std::string& key, double value, double bound,
               const char* what, const char* why) const {
    require(holds, key, fmt::format("{} {} ({}){}", relation, what, with_unit(key, bound), why),
            value);
  }
  void at_least(const std::string& key, double value, double bound, const char* what) const {
    compare(value >= bound, "at least", key, value, bound, what, "");
  }
  void above(const std::string& key, double value, double bound, const char* what,
             const char* why = "") const {
    compare(value > bound, "more than", key, value, bound, what, why);
  }
  void below(const std::string& key, double value, double bound, const char* what,
             const char* why = "") const {
    compare(value < bound, "less than", key, value, bound, what, why);
  }

  void check_address(const std::string& key, const std::string& text) const {
    in_addr address{};
    require(inet_pton(AF_INET, text.c_str(), &address) == 1, key,
            "an IPv4 address such as 192.168.1.20", in_quotes(text));
  }

  /// Calls check(key, frame) for every body.
  template <typename Check>
  void for_marker_frames(const Check& check) const {
    const BodySettings& bodies = transport_.bodies;
    if (bodies.base_id >= 0) check("daemon.bodies.base_plate", bodies.base_marker_frame);
    for (const MarkerFrameSettings& frame : bodies.segment_marker_frames)
      check("daemon.bodies.segment_plates", frame);
  }

  /// Errors thrown by the modules, such as a map of chambers that cannot reach every direction.
  template <typename Build>
  void check_module(const std::string& key, const char* expected, const Build& build) const {
    try {
      build();
    } catch (const std::invalid_argument& error) {
      throw keys_.error_at(key, expected, error.what());
    }
  }

  void check_rotation(const std::string& key, const Eigen::Matrix3d& r) const {
    const double deviation =
        (r.transpose() * r - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
    require(deviation < kRotationTolerance && r.determinant() > 0.0, key,
            "a rotation: orthonormal, determinant +1",
            fmt::format("R'R off the identity by {:.2g}, determinant {:.6g}", deviation,
                        r.determinant()));
  }

  /// Rotary inertia needs a cross-section that the model has.
  void check_radius(const std::string& key, const ArmParameters& arm, bool links) const {
    const bool asked = std::any_of(arm.segments.begin(), arm.segments.end(),
                                   [](const auto& segment) { return segment.radius_m > 0.0; });
    require(!asked || (arm.mass == MassModel::distributed && !links), key + ".radius_m",
            "0 where mass is in points or the arm is made of links: they have no cross-section",
            "a radius");
  }

  /// What the controller needs of an arm that stretches.
  void check_stretching_control() const {
    const char* key = "arm.extensible";
    const auto no = [&](bool holds, const char* with) {
      require(!holds, key, fmt::format("false with {}", with), "segments that stretch");
    };
    no(arm_.size() > kMaxStretchingSegments, "more than 85 segments");
    no(arm_.actuation == ActuationModel::couple,
       "actuation_model: couple, which has no axial force");
    no(actuation_.kind == ActuationKind::torque, "actuation by torque, which has no axial force");
    no(actuation_.plane_rad.has_value(), "actuation.plane_rad");
    no(control_.coordinates == ControlCoordinates::polar, "control.coordinates: polar");
    no(!control_.law.get_if<CurvatureLaw>() && !control_.law.get_if<StaticsPiLaw>() &&
           !control_.law.get_if<ExternalLaw>(),
       "a control.law that knows no axial force");
    for (const ReferencePhase& phase : experiment_.reference.phases)
      no(phase.kind.get_if<LiveTipReference>() != nullptr, "reference: live_tip");
    no(estimation_.method == CurvatureMethod::orientation,
       "estimation.method: orientation, which measures no lengths");
    const SegmentScalars natural_m =
        straight_elongation(arm_, actuation_, actuation_.bias_pressure_bar);
    for (int i = 0; i < arm_.size(); ++i) {
      const SegmentParameters& segment = arm_.segments[static_cast<std::size_t>(i)];
      const char* why = " where segments stretch";
      if (!segment.constant_length) {
        above("arm.axial_stiffness_n_per_m", segment.axial_stiffness_n_per_m, 0.0, "zero", why);
        above("arm.axial_damping_ns_per_m", segment.axial_damping_ns_per_m, 0.0, "zero", why);
      }
      above("estimation.length_tolerance", estimation_.length_tolerance,
            std::abs(natural_m[i]) / segment.length_m, "the elongation by the bias pressures",
            ": otherwise every frame is rejected");
    }
  }

  /// What the simulated arm asks of its kind and of its valves.
  void check_plant() const {
    const PlantSettings& plant = experiment_.plant;
    require(plant.valves.supply_sag_s == 0.0 ||
                (plant.valves.lag_s > 0.0 && plant.actuation.kind == ActuationKind::chambers),
            "plant.valves.supply_sag_s",
            "0 s where plant.valves.lag_s is 0 s or actuation is by torque",
            plant.valves.supply_sag_s);
    const auto make = [&] { plant.kind.make(plant); };
    if (plant.material.bends_otherwise())
      check_module("plant.material", "a kind of plant that has these terms, such as pcc", make);
    for (const auto& [key, part] :
         {std::pair("plant.material.axial_remanence", plant.material.axial_remanence),
          std::pair("plant.material.axial_remanence_2", plant.material.axial_remanence_2)})
      require(part == 0.0 || plant.arm.extensible, key, "0 where plant.arm.extensible is false",
              part);
    if (!plant.arm.extensible) return;
    require(plant.arm.actuation == ActuationModel::chamber, "plant.arm.extensible",
            "false with actuation_model: couple, which has no axial force",
            "segments that stretch");
    check_module("plant.arm.extensible", "a kind of plant whose segments can stretch", make);
  }

  void check_actuation(const std::string& key, const ActuationSettings& it) const {
    const double low = it.min_pressure_bar, high = it.max_pressure_bar, bias = it.bias_pressure_bar;
    const bool torque = it.kind == ActuationKind::torque;
    above(key + ".max_pressure_bar", high, low, "min_pressure_bar");
    require(low <= bias && bias <= high, key + ".bias_pressure_bar",
            fmt::format("between min and max_pressure_bar ([{}, {}] bar)", low, high), bias);
    above(key + (torque ? ".vent_nm_per_s" : ".vent_bar_per_s"), it.vent_bar_per_s,
          std::max(high, -low) / kLongestStop_s, "what it takes to vent in less than 1 s");
    const std::size_t fewest = it.plane_rad ? 2 : 3;
    const char* of = it.plane_rad ? " of a planar arm" : " (2 for a planar arm with plane_rad)";
    for (const auto& chambers : it.segments)
      require(torque || chambers.size() >= fewest, key + ".chambers",
              fmt::format("at least {} chambers a segment{}", fewest, of), size_of(chambers));
    check_module(key + ".chambers", "chambers that reach every direction the arm needs",
                 [&] { PressureAllocator allocator(it); });
  }

  void check_same_chambers() const {
    const ActuationSettings& plant = experiment_.plant.actuation;
    const bool torque = actuation_.kind == ActuationKind::torque;
    require(plant.kind == actuation_.kind, "plant.actuation.kind", "the same as actuation.kind",
            torque ? "chambers" : "torque");
    require(!torque || !safety_.valve_readback, "daemon.safety.valve_readback",
            "false with actuation by torque: it is for simulated arms, which have no valves then",
            "true");
    for (std::size_t i = 0; i < actuation_.segments.size(); ++i) {
      const auto expected = actuation_.segments[i].size();
      require(expected == plant.segments[i].size(), "plant.actuation.chambers",
              fmt::format("as many as actuation.chambers ({}) in segment {}", expected, i + 1),
              size_of(plant.segments[i]));
    }
  }

  void check_inverse() const {
    const ActuatorInverseSettings& inverse = experiment_.actuator_inverse;
    require(inverse.play_bar.size() <= kMaxPlays, "actuation.inverse.play_bar",
            fmt::format("at most {} half widths", kMaxPlays), size_of(inverse.play_bar));
    const auto springs = inverse.slip_radius_rad.size();
    require(springs == inverse.slip_stiffness_nm_per_rad.size() && springs <= kMaxPlays,
            "actuation.inverse.slip_stiffness_nm_per_rad",
            fmt::format("as many as slip_radius_rad ({}), at most {}", springs, kMaxPlays),
            size_of(inverse.slip_stiffness_nm_per_rad));
    require(!inverse.learn_hysteresis || estimation_.observer == ObserverKind::model,
            "actuation.inverse.learn_hysteresis",
            "false without estimation.observer: model, which sees what is left over", "true");
    if (inverse.lags())
      above("control.valve_lag_s", control_.valve_lag_s, 0.0, "zero",
            ", the lag that the inverse of the chambers' lags leaves");
  }

  void check_identified() const {
    const IdentificationSettings& it = experiment_.identification;
    const auto stretches = [](double gain) { return gain != 0.0; };
    require(it.stiffening_by_length == 0.0 ||
                std::any_of(it.stretch_m_per_bar.begin(), it.stretch_m_per_bar.end(), stretches),
            "identification.stiffening_by_length",
            "0 without identification.stretch_m_per_bar, which gives the lengths",
            it.stiffening_by_length);
  }

  void check_reference() const {
    try {
      Reference(experiment_.reference, control_, arm_);
    } catch (const ReferenceError& error) {
      throw keys_.error_at(error.key, error.expected, error.got);
    } catch (const std::invalid_argument& error) {
      throw keys_.error_at("reference", "a reference that can be followed", error.what());
    }
    if (!actuation_.plane_rad) return;
    const auto& phases = experiment_.reference.phases;
    for (std::size_t i = 0; i < phases.size(); ++i) {
      const std::string key = fmt::format("reference[{}]", i);
      if (const auto* hold = phases[i].kind.get_if<SetPointReference>()) {
        check_in_plane(key, hold->u_rad);
      } else if (const auto* paper = phases[i].kind.get_if<PaperReference>()) {
        check_in_plane(key, {std::cos(paper->phi_centre_rad), std::sin(paper->phi_centre_rad)});
        require(paper->phi_amplitude_rad == 0.0, key,
                "a reference in the plane of actuation.plane_rad", "one that leaves it");
      } else if (const auto* way = phases[i].kind.get_if<WayPointReference>()) {
        for (std::size_t j = 0; j < way->points.size(); ++j)
          check_in_plane(fmt::format("{}.points[{}]", key, j), way->points[j].u_rad);
      }
    }
  }

  /// Something must find the disturbance, something cancel it, and the reference must repeat.
  void check_repetition() const {
    const char* key = "control.repetition.lead_s";
    const char* period_key = "control.repetition.period_s";
    const RepetitionSettings& it = control_.repetition;
    const auto zero_unless = [&](bool holds, const char* what) {
      require(holds, key, fmt::format("0 s without {}", what), it.lead_s);
    };
    zero_unless(estimation_.observer == ObserverKind::model, "estimation.observer: model");
    zero_unless(control_.disturbance == DisturbanceRejection::cancel,
                "control.disturbance: cancel");
    zero_unless(control_.law.get_if<ExternalLaw>() == nullptr,
                "a control.law that cancels disturbances");
    bool repeats = false;
    for (const ReferencePhase& phase : experiment_.reference.phases) {
      const double own_s = period_s(phase), used_s = it.period_s.value_or(own_s);
      repeats |= used_s > 0.0;
      if (!(used_s > 0.0)) continue;
      require(own_s == 0.0 || whole_periods(used_s, own_s), period_key,
              fmt::format("a whole number of periods of the reference ({:.6g} s)", own_s), used_s);
      below(key, it.lead_s, 0.5 * used_s, "half of the period");
      const double shortest_s = RepetitiveCompensation::kNodes / experiment_.rate_hz;
      at_least(it.period_s ? period_key : key, used_s, shortest_s,
               "a tick for every part of the period that is learnt");
    }
    require(repeats, key,
            "0 s where no phase of the reference repeats (or else its control.repetition.period_s)",
            it.lead_s);
  }

  /// Of a planar arm.
  void check_in_plane(const std::string& key, const std::vector<double>& u) const {
    const double plane = *actuation_.plane_rad;
    for (std::size_t i = 0; i + 1 < u.size(); i += 2) {
      const double outside = std::abs(u[i + 1] * std::cos(plane) - u[i] * std::sin(plane));
      require(outside < kInPlane_rad, key, "a bend in the plane of actuation.plane_rad",
              fmt::format("{:.3g} rad out of it in segment {}", outside, i / 2 + 1));
    }
  }

  void check_bodies() const {
    const BodySettings& bodies = transport_.bodies;
    std::set<int> seen;
    for (const int id : bodies.segment_ids)
      require(seen.insert(id).second, "daemon.bodies.segment_ids", "every body once",
              fmt::format("body {} twice", id));
    require(bodies.base_id < 0 || !seen.contains(bodies.base_id), "daemon.bodies.base_id",
            "a body that is no segment's end", bodies.base_id);
  }

  /// A threshold that another one hides never takes effect, so it protects nothing.
  void check_safety() const {
    const SafetySettings& it = safety_;
    const double tick_s = 1.0 / experiment_.rate_hz;
    const SafetyThresholds resolved = resolve_thresholds(it, tick_s);
    const double hold_s = to_seconds(resolved.hold_after_ns);
    const double vent_s = to_seconds(resolved.vent_after_ns);
    if (it.vent_after_s == 0.0 && it.hold_after_s > 0.0)
      below("daemon.safety.hold_after_s", hold_s, vent_s, "vent_after_s, left out",
            ": otherwise HOLD is never reached; give both");
    above("daemon.safety.vent_after_s", vent_s, hold_s, "hold_after_s",
          ": otherwise HOLD is never reached; give both");
    above("daemon.safety.hold_after_s", hold_s, it.frame_period_s + it.frame_latency_s,
          "frame_period_s + frame_latency_s", ": otherwise HOLD is never left");
    above("daemon.safety.vent_overruns", it.vent_overruns, it.hold_overruns, "hold_overruns",
          ": otherwise they never cause HOLD");
    at_least("daemon.safety.max_latency_s", it.max_latency_s, it.frame_latency_s,
             "frame_latency_s");
    above("estimation.max_speed_radps", estimation_.max_speed_radps, control_.max_speed_radps,
          "control.max_speed_radps", ": otherwise frames are rejected before that limit is seen");
    if (it.valve_readback)
      below("daemon.safety.pressure_tolerance_bar", it.pressure_tolerance_bar,
            actuation_.max_pressure_bar, "actuation.max_pressure_bar",
            ": otherwise no leak is ever seen");
    for (const auto& [key, time_s] : {std::pair("safety.valve_silence_s", it.valve_silence_s),
                                      std::pair("safety.deadman_timeout_s", it.deadman_timeout_s),
                                      std::pair("lcm.command_validity_s", it.command_validity_s)})
      at_least(fmt::format("daemon.{}", key), time_s, 2.0 * tick_s, "two ticks of daemon.rate_hz");
  }

  /// Letters, digits and a few signs: names need no quoting in LCM's regular expressions or in a
  /// shell.
  void check_channel(std::set<std::string>& seen, const std::string& key, const std::string& word,
                     const std::string& channel) const {
    const bool plain = std::all_of(word.begin(), word.end(), [](unsigned char c) {
      return std::isalnum(c) != 0 || std::strchr("_-./", c) != nullptr;
    });
    require(plain, key, "letters, digits, _ - . /", in_quotes(word));
    require(channel.size() <= 63, key, "a channel of at most 63 characters", channel);
    require(seen.insert(channel).second, key, "a separate channel",
            in_quotes(channel) + ", which another key names too");
  }

  void check_lcm() const {
    std::set<std::string> seen;
    for (const ChannelKey& it : kChannelKeys) {
      const std::string& name = transport_.lcm.*it.channel;
      if (!name.empty()) check_channel(seen, fmt::format("daemon.lcm.{}", it.name), name, name);
    }
    if (transport_.mocap.source.channel_per_body)
      for_marker_frames([&](const std::string& key, const MarkerFrameSettings& frame) {
        check_channel(seen, key + ".name", frame.name, body_channel(transport_.lcm, frame));
      });
    const std::string& url = transport_.lcm.url;
    const std::string example = ", such as udpm://239.255.76.67:7667?ttl=0";
    require(url.find("://") != std::string::npos, "daemon.lcm.url", "an LCM provider" + example,
            in_quotes(url));
    // LCM takes a group without a port as port 0, where no process receives from another.
    const std::string network = url.substr(0, url.find('?'));
    require(!network.starts_with("udpm://") || network == "udpm://" ||
                network.find(':', 7) != std::string::npos,
            "daemon.lcm.url", "a port behind the group" + example, in_quotes(url));
  }

  void check_mocap_server() const {
    if (!transport_.mocap.source.network) return;
    const MocapNetworkSettings& it = transport_.mocap.network;
    check_address("daemon.mocap.host", it.host);
    check_address("daemon.mocap.local_address", it.local_address);
    if (!it.multicast.empty()) check_address("daemon.mocap.multicast", it.multicast);
    const std::size_t dot = it.version.find('.');
    const bool numbers = dot > 0 && dot + 1 < it.version.size() &&
                         std::all_of(it.version.begin(), it.version.end(), [](unsigned char c) {
                           return std::isdigit(c) != 0 || c == '.';
                         });
    require(numbers, "daemon.mocap.version", "two numbers such as 4.1", in_quotes(it.version));
    std::set<std::string> seen;
    for_marker_frames([&](const std::string& key, const MarkerFrameSettings& frame) {
      require(frame.name.empty() || seen.insert(frame.name).second, key + ".name",
              "every body once", in_quotes(frame.name) + " twice");
    });
  }

  void check_valves() const {
    const ValveDriverSettings& it = experiment_.valves;
    // Arms without a terminal need not fit one.
    if (actuation_.kind == ActuationKind::torque || !keys_.given("valves")) return;
    std::set<int> seen;
    for (const int valve : it.order)
      require(seen.insert(valve).second, "valves.order", "every valve once",
              fmt::format("valve {} twice", valve));
    const double period_s = 1.0 / it.rate_hz;
    const double silent_s = (it.tolerated_failures + 1) * period_s;
    below("valves.response_timeout_s", it.response_timeout_s, period_s,
          "one period of valves.rate_hz");
    at_least("valves.longest_backoff_s", it.longest_backoff_s, it.backoff_s, "backoff_s");
    below("valves.stuck_bar", it.stuck_bar, actuation_.max_pressure_bar,
          "actuation.max_pressure_bar", ": otherwise no valve ever counts as stuck");
    require(it.failsafe_timeout_s >= silent_s, "valves.failsafe_timeout_s",
            fmt::format("at least {:.6g} s (tolerated_failures + 1 periods)", silent_s),
            it.failsafe_timeout_s);
    if (it.backend == "modbus") check_terminal(it);
  }

  void check_terminal(const ValveDriverSettings& it) const {
    check_address("valves.host", it.host);
    require(it.failsafe_timeout_s >= it.registers.timeout_least_s, "valves.failsafe_timeout_s",
            fmt::format("at least {:.6g} s, what the terminal takes", it.registers.timeout_least_s),
            it.failsafe_timeout_s);
    const double units = it.failsafe_timeout_s / it.registers.timeout_unit_s;
    require(units >= 0.5 && units < (it.registers.timeout_words == 2 ? 4294967295.0 : 65535.0),
            "valves.failsafe_timeout_s", "a time-out that fits its register",
            fmt::format("{:.6g} units", units));
    const std::string fault =
        register_map_fault(it.registers, it.order, actuation_.max_pressure_bar);
    require(fault.empty(), "valves.registers", "registers that fit together", fault);
  }

  void check_contact() const {
    require(safety_.contact_segment <= arm_.size(), "daemon.safety.contact_segment",
            fmt::format("at most {}", arm_.size()), safety_.contact_segment);
    require(safety_.contact_force_n <= 0.0 || estimation_.observer == ObserverKind::model,
            "daemon.safety.contact_force_n", "0 without estimation.observer: model",
            safety_.contact_force_n);
  }

  void check_loads() const {
    const auto& loads = experiment_.plant.loads;
    for (std::size_t i = 0; i < loads.size(); ++i)
      require(loads[i].segment <= arm_.size(), fmt::format("plant.loads[{}].segment", i),
              fmt::format("a whole number in [0, {}]", arm_.size()), loads[i].segment);
  }

  void check_slips_of_the_arm() const {
    const Eigen::Vector3d& g = arm_.gravity_mps2;
    require(g.z() <= 0.0 && g.norm() <= kMostGravity_mps2, "arm.gravity_mps2",
            fmt::format("a vector that does not point up (z of the world is up), at most {} m/s^2",
                        kMostGravity_mps2),
            fmt::format("[{}, {}, {}] m/s^2", g.x(), g.y(), g.z()));
    if (actuation_.kind == ActuationKind::torque) return;
    for (std::size_t i = 0; i < arm_.segments.size(); ++i) {
      const double bend_rad = full_bend_rad(experiment_, i);
      require(bend_rad <= kMostBend_rad, "actuation.chambers",
              fmt::format("chambers that bend a segment by at most {} rad at max_pressure_bar "
                          "(gain in N m/bar, stiffness in N m/rad)",
                          kMostBend_rad),
              fmt::format("{:.4g} rad in segment {}", bend_rad, i + 1));
    }
  }

  /// Millimetres taken for metres.
  void check_marker_frames() const {
    const double most_m = std::max(1.0, arm_.length_m());
    for_marker_frames([&](const std::string& key, const MarkerFrameSettings& frame) {
      require(frame.position_m.norm() <= most_m, key + ".position_m",
              fmt::format("a marker frame at most {:.4g} m beside its body", most_m),
              frame.position_m.norm());
    });
  }

  /// A rate at which frames or the ramp cannot do their work.
  void check_tick() const {
    const double tick_s = 1.0 / experiment_.rate_hz;
    const double wait_s = safety_.max_latency_s - safety_.frame_latency_s;
    require(tick_s <= wait_s + 1e-9, "daemon.rate_hz",
            fmt::format("at least {:.6g} Hz: frames wait up to a tick and are then older than "
                        "daemon.safety.max_latency_s, so good_frames in a row never come",
                        wait_s > 0.0 ? 1.0 / wait_s : INFINITY),
            experiment_.rate_hz);
    require(tick_s <= kFramesATick * safety_.frame_period_s, "daemon.rate_hz",
            fmt::format("at least {:.6g} Hz: a tick takes {} frames, more of them would be lost",
                        1.0 / (kFramesATick * safety_.frame_period_s), kFramesATick),
            experiment_.rate_hz);
    const double ramp_ticks =
        std::ceil(actuation_.max_pressure_bar / (actuation_.vent_bar_per_s * tick_s) - 1e-9);
    require((ramp_ticks + kTicksOfAStop) * tick_s < kLongestStop_s, "daemon.rate_hz",
            fmt::format("a rate at which a stop takes less than {} s ({:.0f} ticks of the vent "
                        "ramp, {} around it)",
                        kLongestStop_s, ramp_ticks, kTicksOfAStop),
            experiment_.rate_hz);
    require(safety_.vent_overruns * tick_s <= kLongestStop_s, "daemon.safety.vent_overruns",
            fmt::format("at most {} s of ticks", kLongestStop_s),
            fmt::format("{:.4g} s", safety_.vent_overruns * tick_s));
  }

  void check_times() const {
    const SafetyThresholds resolved = resolve_thresholds(safety_, 1.0 / experiment_.rate_hz);
    const auto at_most = [&](const char* key, double value_s, double bound_s) {
      require(value_s <= bound_s, fmt::format("daemon.safety.{}", key),
              fmt::format("a time of at most {} s where real valves are driven, given or derived",
                          bound_s),
              value_s);
    };
    at_most("hold_after_s", to_seconds(resolved.hold_after_ns), kLongestHold_s);
    at_most("vent_after_s", to_seconds(resolved.vent_after_ns), kLongestVentDelay_s);
    at_most("deadman_timeout_s", safety_.deadman_timeout_s, kLongestVentDelay_s);
    if (safety_.valve_readback)
      at_most("valve_silence_s", safety_.valve_silence_s, kLongestVentDelay_s);
  }

  const Experiment& experiment_;
  const ConfigKeys& keys_;
  const ArmParameters& arm_ = experiment_.arm;
  const ActuationSettings& actuation_ = experiment_.actuation;
  const EstimationSettings& estimation_ = experiment_.estimation;
  const ControllerSettings& control_ = experiment_.control;
  const SafetySettings& safety_ = experiment_.safety;
  const TransportSettings& transport_ = experiment_.transport;
};

}  // namespace

bool drives_real_valves(const Experiment& experiment) {
  const ValveDriverSettings& valves = experiment.valves;
  return experiment.actuation.kind == ActuationKind::chambers &&
         (valves.backend != "modbus" || !valves.host.starts_with("127."));
}

double full_bend_rad(const Experiment& experiment, std::size_t segment) {
  double gain = 0.0;
  for (const Chamber& chamber : experiment.actuation.segments[segment])
    gain = std::max(gain, chamber.gain_nm_per_bar);
  return gain * experiment.actuation.max_pressure_bar /
         experiment.arm.segments[segment].stiffness_nm_per_rad;
}

void check_consistency(const Experiment& experiment, const ConfigKeys& keys) {
  Checks(experiment, keys).run();
}

}  // namespace softarm
