#include "config/checks.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>

#include <cctype>
#include <cmath>
#include <cstring>
#include <memory>
#include <set>
#include <stdexcept>

#include "config/describe.hpp"
#include "config/plausibility.hpp"
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

/// A stop vents within this time, whatever the pressures were.
constexpr double kLongestVent_s = 1.0;
constexpr double kRotationTolerance = 1e-6;
constexpr double kInPlane_rad = 1e-6;
/// Work of the inverse in the tick grows with their square.
constexpr std::size_t kMaxPlays = 16;

std::string in_quotes(const std::string& text) { return "\"" + text + "\""; }

class Checks {
 public:
  Checks(const Experiment& experiment, const ConfigKeys& keys)
      : experiment_(experiment), keys_(keys) {}

  void run() const {
    check_rotation("arm.base.rotation", experiment_.arm.base_rotation);
    check_rotation("plant.arm.base.rotation", experiment_.plant.arm.base_rotation);
    check_rotation("daemon.mocap.axes", experiment_.transport.mocap.axes);
    check_radius("arm", experiment_.arm, false);
    check_radius("plant.arm", experiment_.plant.arm,
                 experiment_.plant.kind.get_if<LinkSettings>() != nullptr);
    if (experiment_.arm.extensible) check_stretching_control();
    check_plant();
    check_actuation("actuation", experiment_.actuation);
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
      experiment_.control.law.make(
          {experiment_.arm, experiment_.control, chamber_count(experiment_.actuation)});
    });
    check_inverse();
    check_reference();
    if (experiment_.control.repetition.lead_s > 0.0) check_repetition();
  }

 private:
  void require(bool holds, const std::string& key, const std::string& expected,
               const std::string& got) const {
    if (!holds) throw keys_.error_at(key, expected, got);
  }

  /// Compares a key's value with a bound; `what` names the bound, `why` gives the reason.
  void compare(bool holds, const char* relation, const std::string& key, double value, double bound,
               const char* what, const char* why) const {
    const std::string_view unit = Key{key.c_str(), ""}.unit();
    const std::string unit_behind = unit.empty() ? "" : fmt::format(" {}", unit);
    require(holds, key, fmt::format("{} {} ({:.6g}{}){}", relation, what, bound, unit_behind, why),
            fmt::format("{:.6g}{}", value, unit_behind));
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

  template <typename Set, typename Item>
  void once(Set& seen, const Item& item, const std::string& key, const std::string& expected,
            const std::string& got) const {
    require(seen.insert(item).second, key, expected, got);
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
    no(experiment_.arm.size() > kMaxStretchingSegments, "more than 85 segments");
    no(experiment_.arm.actuation == ActuationModel::couple,
       "actuation_model: couple, which has no axial force");
    no(experiment_.actuation.kind == ActuationKind::torque,
       "actuation by torque, which has no axial force");
    no(experiment_.actuation.plane_rad.has_value(), "actuation.plane_rad");
    no(experiment_.control.coordinates == ControlCoordinates::polar, "control.coordinates: polar");
    no(!experiment_.control.law.get_if<CurvatureLaw>() &&
           !experiment_.control.law.get_if<StaticsPiLaw>() &&
           !experiment_.control.law.get_if<ExternalLaw>(),
       "a control.law that knows no axial force");
    for (const ReferencePhase& phase : experiment_.reference.phases)
      no(phase.kind.get_if<LiveTipReference>() != nullptr, "reference: live_tip");
    no(experiment_.estimation.method == CurvatureMethod::orientation,
       "estimation.method: orientation, which measures no lengths");
    for (const SegmentParameters& segment : experiment_.arm.segments) {
      if (segment.constant_length) continue;
      above("arm.axial_stiffness_n_per_m", segment.axial_stiffness_n_per_m, 0.0, "zero",
            " where segments stretch");
      above("arm.axial_damping_ns_per_m", segment.axial_damping_ns_per_m, 0.0, "zero",
            " where segments stretch");
    }
    const SegmentScalars natural_m = straight_elongation(experiment_.arm, experiment_.actuation,
                                                         experiment_.actuation.bias_pressure_bar);
    for (int i = 0; i < experiment_.arm.size(); ++i) {
      const double length_m = experiment_.arm.segments[static_cast<std::size_t>(i)].length_m;
      above("estimation.length_tolerance", experiment_.estimation.length_tolerance,
            std::abs(natural_m[i]) / length_m, "the elongation by the bias pressures",
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
            fmt::format("{} s", plant.valves.supply_sag_s));
    const auto make = [&] { plant.kind.make(plant); };
    if (plant.material.bends_otherwise())
      check_module("plant.material", "a kind of plant that has these terms, such as pcc", make);
    for (const auto& [key, part] :
         {std::pair("plant.material.axial_remanence", plant.material.axial_remanence),
          std::pair("plant.material.axial_remanence_2", plant.material.axial_remanence_2)})
      require(part == 0.0 || plant.arm.extensible, key, "0 where plant.arm.extensible is false",
              fmt::format("{}", part));
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
            fmt::format("between min and max_pressure_bar ([{}, {}] bar)", low, high),
            fmt::format("{} bar", bias));
    above(key + (torque ? ".vent_nm_per_s" : ".vent_bar_per_s"), it.vent_bar_per_s,
          std::max(high, -low) / kLongestVent_s, "what it takes to vent in less than 1 s");
    const std::size_t fewest = it.plane_rad ? 2 : 3;
    for (const auto& chambers : it.segments) {
      require(
          torque || chambers.size() >= fewest, key + ".chambers",
          fmt::format("at least {} chambers a segment{}", fewest,
                      it.plane_rad ? " of a planar arm" : " (2 for a planar arm with plane_rad)"),
          fmt::format("{}", chambers.size()));
    }
    check_module(key + ".chambers", "chambers that reach every direction the arm needs",
                 [&] { PressureAllocator allocator(it); });
  }

  void check_same_chambers() const {
    const auto& model = experiment_.actuation;
    const auto& plant = experiment_.plant.actuation;
    const bool torque = model.kind == ActuationKind::torque;
    require(plant.kind == model.kind, "plant.actuation.kind", "the same as actuation.kind",
            torque ? "chambers" : "torque");
    require(!torque || !experiment_.safety.valve_readback, "daemon.safety.valve_readback",
            "false with actuation by torque: it is for simulated arms, which have no valves then",
            "true");
    for (std::size_t i = 0; i < model.segments.size(); ++i) {
      const auto expected = model.segments[i].size(), got = plant.segments[i].size();
      require(expected == got, "plant.actuation.chambers",
              fmt::format("as many as actuation.chambers ({}) in segment {}", expected, i + 1),
              fmt::format("{}", got));
    }
  }

  void check_inverse() const {
    const ActuatorInverseSettings& inverse = experiment_.actuator_inverse;
    require(inverse.play_bar.size() <= kMaxPlays, "actuation.inverse.play_bar",
            fmt::format("at most {} half widths", kMaxPlays),
            fmt::format("{}", inverse.play_bar.size()));
    const auto springs = inverse.slip_radius_rad.size();
    require(springs == inverse.slip_stiffness_nm_per_rad.size() && springs <= kMaxPlays,
            "actuation.inverse.slip_stiffness_nm_per_rad",
            fmt::format("as many as slip_radius_rad ({}), at most {}", springs, kMaxPlays),
            fmt::format("{}", inverse.slip_stiffness_nm_per_rad.size()));
    require(!inverse.learn_hysteresis || experiment_.estimation.observer == ObserverKind::model,
            "actuation.inverse.learn_hysteresis",
            "false without estimation.observer: model, which sees what is left over", "true");
    if (inverse.lags())
      above("control.valve_lag_s", experiment_.control.valve_lag_s, 0.0, "zero",
            ", the lag that the inverse of the chambers' lags leaves");
  }

  void check_reference() const {
    try {
      Reference(experiment_.reference, experiment_.control, experiment_.arm);
    } catch (const ReferenceError& error) {
      throw keys_.error_at(error.key, error.expected, error.got);
    } catch (const std::invalid_argument& error) {
      throw keys_.error_at("reference", "a reference that can be followed", error.what());
    }
    if (!experiment_.actuation.plane_rad) return;
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
    const RepetitionSettings& it = experiment_.control.repetition;
    const auto zero_unless = [&](bool holds, const char* what) {
      require(holds, key, fmt::format("0 s without {}", what), fmt::format("{} s", it.lead_s));
    };
    zero_unless(experiment_.estimation.observer == ObserverKind::model,
                "estimation.observer: model");
    zero_unless(experiment_.control.disturbance == DisturbanceRejection::cancel,
                "control.disturbance: cancel");
    zero_unless(experiment_.control.law.get_if<ExternalLaw>() == nullptr,
                "a control.law that cancels disturbances");
    bool repeats = false;
    for (const ReferencePhase& phase : experiment_.reference.phases) {
      const double own_s = period_s(phase), used_s = it.period_s.value_or(own_s);
      repeats |= used_s > 0.0;
      if (!(used_s > 0.0)) continue;
      require(own_s == 0.0 || whole_periods(used_s, own_s), period_key,
              fmt::format("a whole number of periods of the reference ({:.6g} s)", own_s),
              fmt::format("{:.6g} s", used_s));
      below(key, it.lead_s, 0.5 * used_s, "half of the period");
      const double shortest_s = RepetitiveCompensation::kNodes / experiment_.rate_hz;
      at_least(it.period_s ? period_key : key, used_s, shortest_s,
               "a tick for every part of the period that is learnt");
    }
    require(repeats, key,
            "0 s where no phase of the reference repeats (or else its control.repetition.period_s)",
            fmt::format("{} s", it.lead_s));
  }

  /// Of a planar arm.
  void check_in_plane(const std::string& key, const std::vector<double>& u) const {
    const double plane = *experiment_.actuation.plane_rad;
    for (std::size_t i = 0; i + 1 < u.size(); i += 2) {
      const double outside = std::abs(u[i + 1] * std::cos(plane) - u[i] * std::sin(plane));
      require(outside < kInPlane_rad, key, "a bend in the plane of actuation.plane_rad",
              fmt::format("{:.3g} rad out of it in segment {}", outside, i / 2 + 1));
    }
  }

  void check_bodies() const {
    const BodySettings& bodies = experiment_.transport.bodies;
    std::set<int> seen;
    for (const int id : bodies.segment_ids) {
      once(seen, id, "daemon.bodies.segment_ids", "every body once",
           fmt::format("body {} twice", id));
    }
    if (bodies.base_id < 0) return;
    once(seen, bodies.base_id, "daemon.bodies.base_id", "a body that is no segment's end",
         fmt::format("{}", bodies.base_id));
  }

  /// A threshold that another one hides never takes effect, so it protects nothing.
  void check_safety() const {
    const SafetySettings& it = experiment_.safety;
    const double tick_s = 1.0 / experiment_.rate_hz;
    const SafetyThresholds resolved = resolve_thresholds(it, tick_s);
    const double hold_s = to_seconds(resolved.hold_after_ns);
    const double vent_s = to_seconds(resolved.vent_after_ns);
    if (it.vent_after_s == 0.0 && it.hold_after_s > 0.0) {
      below("daemon.safety.hold_after_s", hold_s, vent_s, "vent_after_s, left out",
            ": otherwise HOLD is never reached; give both");
    }
    above("daemon.safety.vent_after_s", vent_s, hold_s, "hold_after_s",
          ": otherwise HOLD is never reached; give both");
    above("daemon.safety.hold_after_s", hold_s, it.frame_period_s + it.frame_latency_s,
          "frame_period_s + frame_latency_s", ": otherwise HOLD is never left");
    above("daemon.safety.vent_overruns", it.vent_overruns, it.hold_overruns, "hold_overruns",
          ": otherwise they never cause HOLD");
    at_least("daemon.safety.max_latency_s", it.max_latency_s, it.frame_latency_s,
             "frame_latency_s");
    above("estimation.max_speed_radps", experiment_.estimation.max_speed_radps,
          experiment_.control.max_speed_radps, "control.max_speed_radps",
          ": otherwise frames are rejected before that limit is seen");
    if (it.valve_readback) {
      below("daemon.safety.pressure_tolerance_bar", it.pressure_tolerance_bar,
            experiment_.actuation.max_pressure_bar, "actuation.max_pressure_bar",
            ": otherwise no leak is ever seen");
    }
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
    once(seen, channel, key, "a separate channel",
         in_quotes(channel) + ", which another key names too");
  }

  void check_lcm() const {
    const TransportSettings& transport = experiment_.transport;
    std::set<std::string> seen;
    for (const ChannelKey& it : kChannelKeys) {
      const std::string& name = transport.lcm.*it.channel;
      if (!name.empty()) check_channel(seen, fmt::format("daemon.lcm.{}", it.name), name, name);
    }
    if (transport.mocap.source.channel_per_body) {  // every body has its own
      const auto check = [&](const char* key, const MarkerFrameSettings& body) {
        check_channel(seen, key, body.name, body_channel(transport.lcm, body));
      };
      const BodySettings& bodies = transport.bodies;
      if (bodies.base_id >= 0) check("daemon.bodies.base_plate.name", bodies.base_marker_frame);
      for (const auto& body : bodies.segment_marker_frames)
        check("daemon.bodies.segment_plates", body);
    }
    const std::string& url = transport.lcm.url;
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
    const TransportSettings& transport = experiment_.transport;
    if (!transport.mocap.source.network) return;
    const MocapNetworkSettings& it = transport.mocap.network;
    const auto check_address = [&](const char* key, const std::string& text) {
      in_addr address{};
      require(inet_pton(AF_INET, text.c_str(), &address) == 1, key,
              "an IPv4 address such as 192.168.1.20", in_quotes(text));
    };
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
    const BodySettings& bodies = transport.bodies;
    const auto check_name = [&](const char* key, const std::string& name) {
      if (!name.empty()) once(seen, name, key, "every body once", in_quotes(name) + " twice");
    };
    if (bodies.base_id >= 0)
      check_name("daemon.bodies.base_plate.name", bodies.base_marker_frame.name);
    for (const MarkerFrameSettings& body : bodies.segment_marker_frames)
      check_name("daemon.bodies.segment_plates", body.name);
  }

  void check_valves() const {
    const ValveDriverSettings& it = experiment_.valves;
    const double max_bar = experiment_.actuation.max_pressure_bar;
    // Arms without a terminal need not fit one.
    if (experiment_.actuation.kind == ActuationKind::torque || !keys_.given("valves")) return;
    std::set<int> seen;
    for (const int valve : it.order)
      once(seen, valve, "valves.order", "every valve once", fmt::format("valve {} twice", valve));
    const double period_s = 1.0 / it.rate_hz;
    const double silent_s = (it.tolerated_failures + 1) * period_s;
    below("valves.response_timeout_s", it.response_timeout_s, period_s,
          "one period of valves.rate_hz");
    at_least("valves.longest_backoff_s", it.longest_backoff_s, it.backoff_s, "backoff_s");
    below("valves.stuck_bar", it.stuck_bar, max_bar, "actuation.max_pressure_bar",
          ": otherwise no valve ever counts as stuck");
    require(it.failsafe_timeout_s >= silent_s, "valves.failsafe_timeout_s",
            fmt::format("at least {:.6g} s (tolerated_failures + 1 periods)", silent_s),
            fmt::format("{} s", it.failsafe_timeout_s));
    if (it.backend == "modbus") check_terminal(it);
  }

  void check_terminal(const ValveDriverSettings& it) const {
    in_addr address{};
    require(inet_pton(AF_INET, it.host.c_str(), &address) == 1, "valves.host", "an IPv4 address",
            in_quotes(it.host));
    require(it.failsafe_timeout_s >= it.registers.timeout_least_s, "valves.failsafe_timeout_s",
            fmt::format("at least {:.6g} s, what the terminal takes", it.registers.timeout_least_s),
            fmt::format("{} s", it.failsafe_timeout_s));
    const double units = it.failsafe_timeout_s / it.registers.timeout_unit_s;
    require(units >= 0.5 && units < (it.registers.timeout_words == 2 ? 4294967295.0 : 65535.0),
            "valves.failsafe_timeout_s", "a time-out that fits its register",
            fmt::format("{:.6g} units", units));
    const std::string fault =
        register_map_fault(it.registers, it.order, experiment_.actuation.max_pressure_bar);
    require(fault.empty(), "valves.registers", "registers that fit together", fault);
  }

  void check_contact() const {
    require(experiment_.safety.contact_segment <= experiment_.arm.size(),
            "daemon.safety.contact_segment", fmt::format("at most {}", experiment_.arm.size()),
            fmt::format("{}", experiment_.safety.contact_segment));
    require(experiment_.safety.contact_force_n <= 0.0 ||
                experiment_.estimation.observer == ObserverKind::model,
            "daemon.safety.contact_force_n", "0 without estimation.observer: model",
            fmt::format("{}", experiment_.safety.contact_force_n));
  }

  void check_loads() const {
    const auto& loads = experiment_.plant.loads;
    const int n = experiment_.arm.size();
    for (std::size_t i = 0; i < loads.size(); ++i) {
      require(loads[i].segment <= n, fmt::format("plant.loads[{}].segment", i),
              fmt::format("a whole number in [0, {}]", n), fmt::format("{}", loads[i].segment));
    }
  }

  const Experiment& experiment_;
  const ConfigKeys& keys_;
};

}  // namespace

void check_consistency(const Experiment& experiment, const ConfigKeys& keys) {
  Checks(experiment, keys).run();
  check_plausibility(experiment, keys);
}

}  // namespace softarm
