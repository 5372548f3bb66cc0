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

#include "softarm/actuation/pressure_allocator.hpp"
#include "softarm/control/curvature_controller.hpp"
#include "softarm/control/reference.hpp"
#include "softarm/runtime/settings.hpp"
#include "softarm/transport/settings.hpp"
#include "softarm/valves/register_map.hpp"

namespace softarm {
namespace {

/// A stop vents within this time, whatever the pressures were.
constexpr double kLongestVent_s = 1.0;
constexpr double kRotationTolerance = 1e-6;
constexpr double kInPlane_rad = 1e-6;

class Checks {
 public:
  Checks(const Experiment& experiment, const ExperimentReader& reader)
      : experiment_(experiment), reader_(reader) {}

  void run() const {
    check_rotation("arm.base.rotation", experiment_.arm.base_rotation);
    check_rotation("plant.arm.base.rotation", experiment_.plant.arm.base_rotation);
    check_rotation("daemon.mocap.axes", experiment_.transport.mocap.axes);
    check_radius("arm", experiment_.arm, false);
    check_radius("plant.arm", experiment_.plant.arm,
                 experiment_.plant.kind.get_if<LinkSettings>() != nullptr);
    check_actuation("actuation", experiment_.actuation);
    check_actuation("plant.actuation", experiment_.plant.actuation);
    check_same_chambers();
    check_reference();
    check_bodies();
    check_safety();
    check_lcm();
    check_valves();
    check_rooms();
  }

 private:
  void require(bool holds, const std::string& key, const std::string& expected,
               const std::string& got) const {
    if (!holds) throw reader_.error_at(key, expected, got);
  }

  void check_rotation(const std::string& key, const Eigen::Matrix3d& r) const {
    const double deviation =
        (r.transpose() * r - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
    const double determinant = r.determinant();
    require(
        deviation < kRotationTolerance && determinant > 0.0, key,
        "a rotation: orthonormal, determinant +1",
        fmt::format("R'R off the identity by {:.2g}, determinant {:.6g}", deviation, determinant));
  }

  /// Rotary inertia needs a cross-section that the model has.
  void check_radius(const std::string& key, const ArmParameters& arm, bool links) const {
    const auto thick = [](const SegmentParameters& segment) { return segment.radius_m > 0.0; };
    const bool asked = std::any_of(arm.segments.begin(), arm.segments.end(), thick);
    require(!asked || (arm.mass == MassModel::distributed && !links), key + ".radius_m",
            "0 where mass is in points or the arm is made of links: they have no cross-section",
            "a radius");
  }

  void check_actuation(const std::string& key, const ActuationSettings& actuation) const {
    const double low = actuation.min_pressure_bar;
    const double high = actuation.max_pressure_bar;
    const double bias = actuation.bias_pressure_bar;
    require(low < high, key + ".max_pressure_bar",
            fmt::format("more than min_pressure_bar ({} bar)", low), fmt::format("{} bar", high));
    require(low <= bias && bias <= high, key + ".bias_pressure_bar",
            fmt::format("between min and max_pressure_bar ([{}, {}] bar)", low, high),
            fmt::format("{} bar", bias));
    const bool torque = actuation.kind == ActuationKind::torque;
    const double vent_s = std::max(high, -low) / actuation.vent_bar_per_s;
    const char* unit = torque ? "N m/s" : "bar/s";
    require(vent_s < kLongestVent_s, key + (torque ? ".vent_nm_per_s" : ".vent_bar_per_s"),
            fmt::format("more than {} {}, so that venting takes less than {} s",
                        std::max(high, -low) / kLongestVent_s, unit, kLongestVent_s),
            fmt::format("{} {}", actuation.vent_bar_per_s, unit));
    if (torque) return;
    const std::size_t fewest = actuation.plane_rad ? 2 : 3;
    for (const auto& chambers : actuation.segments) {
      require(chambers.size() >= fewest, key + ".chambers",
              fmt::format("at least {} chambers a segment{}", fewest,
                          actuation.plane_rad ? " of a planar arm"
                                              : " (2 for a planar arm with plane_rad)"),
              fmt::format("{}", chambers.size()));
    }
  }

  void check_same_chambers() const {
    const bool torque = experiment_.actuation.kind == ActuationKind::torque;
    require(experiment_.plant.actuation.kind == experiment_.actuation.kind, "plant.actuation.kind",
            "the same as actuation.kind", torque ? "chambers" : "torque");
    require(!torque || !experiment_.safety.valve_readback, "daemon.safety.valve_readback",
            "false with actuation by torque: it is for simulated arms, which have no valves then",
            "true");
    for (std::size_t i = 0; i < experiment_.actuation.segments.size(); ++i) {
      const auto commanded = experiment_.actuation.segments[i].size();
      const auto there = experiment_.plant.actuation.segments[i].size();
      require(commanded == there, "plant.actuation.chambers",
              fmt::format("as many chambers as actuation.chambers ({}) in segment {}", commanded,
                          i + 1),
              fmt::format("{}", there));
    }
  }

  /// Distance (rad) of a segment's u from the plane of a planar arm.
  double out_of_plane(double x, double y) const {
    if (!experiment_.actuation.plane_rad) return 0.0;
    const double plane = *experiment_.actuation.plane_rad;
    return std::abs(y * std::cos(plane) - x * std::sin(plane));
  }

  void check_pose(const std::string& key, const std::vector<double>& u) const {
    for (std::size_t i = 0; i + 1 < u.size(); i += 2) {
      const double theta = std::hypot(u[i], u[i + 1]);
      const double outside = out_of_plane(u[i], u[i + 1]);
      require(outside < kInPlane_rad, key, "a bend in the plane of actuation.plane_rad",
              fmt::format("{:.3g} rad out of it in segment {}", outside, i / 2 + 1));
      require(theta <= experiment_.control.max_theta_rad, key,
              fmt::format("theta within control.max_theta_rad ({} rad)",
                          experiment_.control.max_theta_rad),
              fmt::format("{:.6g} rad in segment {}", theta, i / 2 + 1));
    }
  }

  void check_reference() const {
    const auto& phases = experiment_.reference.phases;
    for (std::size_t i = 0; i < phases.size(); ++i) {
      const std::string key = fmt::format("reference[{}]", i);
      if (const auto* hold = phases[i].kind.get_if<SetPointReference>()) {
        check_pose(key, hold->u_rad);
      } else if (const auto* paper = phases[i].kind.get_if<PaperReference>()) {
        require(paper->theta_rad <= experiment_.control.max_theta_rad, key + ".theta_rad",
                fmt::format("at most control.max_theta_rad ({} rad)",
                            experiment_.control.max_theta_rad),
                fmt::format("{} rad", paper->theta_rad));
        const double outside =
            out_of_plane(std::cos(paper->phi_centre_rad), std::sin(paper->phi_centre_rad));
        require(!experiment_.actuation.plane_rad ||
                    (outside < kInPlane_rad && paper->phi_amplitude_rad == 0.0),
                key, "a reference in the plane of actuation.plane_rad", "one that leaves it");
      } else if (const auto* way = phases[i].kind.get_if<WayPointReference>()) {
        check_way_points(key + ".points", *way);
      }
    }
  }

  void check_way_points(const std::string& key, const WayPointReference& way) const {
    for (std::size_t j = 0; j < way.points.size(); ++j) {
      const std::string at = fmt::format("{}[{}]", key, j);
      check_pose(at, way.points[j].u_rad);
      require(j == 0 || way.points[j].time_s > way.points[j - 1].time_s, at + ".time_s",
              "later than the point before", fmt::format("{} s", way.points[j].time_s));
    }
    require(!way.repeat || way.points.size() >= 2, key, "at least 2 points to repeat",
            fmt::format("{}", way.points.size()));
  }

  void check_bodies() const {
    const BodySettings& bodies = experiment_.transport.bodies;
    std::set<int> seen;
    for (const int id : bodies.segment_ids) {
      require(seen.insert(id).second, "daemon.bodies.segment_ids", "every body once",
              fmt::format("body {} twice", id));
    }
    require(bodies.base_id < 0 || seen.insert(bodies.base_id).second, "daemon.bodies.base_id",
            "a body that is no segment's end", fmt::format("{}", bodies.base_id));
  }

  /// Letters, digits and a few signs: names need no quoting in LCM's regular expressions, nor by
  /// people.
  void check_word(const std::string& key, const std::string& name) const {
    const bool word = std::all_of(name.begin(), name.end(), [](char c) {
      return std::isalnum(static_cast<unsigned char>(c)) || std::strchr("_-./", c) != nullptr;
    });
    require(word, key, "letters, digits, _ - . /", "\"" + name + "\"");
  }

  /// Where every body has a channel of its own.
  void check_body_channels(std::set<std::string>& seen) const {
    const TransportSettings& transport = experiment_.transport;
    if (!transport.mocap.source.channel_per_body) return;
    const auto check = [&](const std::string& key, const PlateSettings& plate) {
      check_word(key, plate.name);
      const std::string channel = body_channel(transport.lcm, plate);
      require(channel.size() <= 63, key, "a channel of at most 63 characters", channel);
      require(seen.insert(channel).second, key, "a channel of its own",
              "\"" + channel + "\", which another key names too");
    };
    if (transport.bodies.base_id >= 0)
      check("daemon.bodies.base_plate.name", transport.bodies.base_plate);
    for (const PlateSettings& plate : transport.bodies.segment_plates)
      check("daemon.bodies.segment_plates", plate);
  }

  void check_safety() const {
    const SafetySettings& safety = experiment_.safety;
    require(safety.hold_after_s == 0.0 || safety.vent_after_s == 0.0 ||
                safety.hold_after_s <= safety.vent_after_s,
            "daemon.safety.vent_after_s",
            fmt::format("at least hold_after_s ({} s)", safety.hold_after_s),
            fmt::format("{} s", safety.vent_after_s));
    require(safety.hold_overruns <= safety.vent_overruns, "daemon.safety.vent_overruns",
            fmt::format("at least hold_overruns ({})", safety.hold_overruns),
            fmt::format("{}", safety.vent_overruns));
    require(safety.frame_latency_s <= safety.max_latency_s, "daemon.safety.max_latency_s",
            fmt::format("at least frame_latency_s ({} s)", safety.frame_latency_s),
            fmt::format("{} s", safety.max_latency_s));
    const double period_s = 1.0 / experiment_.rate_hz;
    for (const auto& [key, time_s] : {std::pair{"valve_silence_s", safety.valve_silence_s},
                                      std::pair{"deadman_timeout_s", safety.deadman_timeout_s}})
      require(time_s >= 2.0 * period_s, fmt::format("daemon.safety.{}", key),
              fmt::format("at least two ticks of daemon.rate_hz ({:.6g} s)", 2.0 * period_s),
              fmt::format("{} s", time_s));
    require(experiment_.safety.command_validity_s >= 2.0 * period_s,
            "daemon.lcm.command_validity_s",
            fmt::format("at least two ticks of daemon.rate_hz ({:.6g} s)", 2.0 * period_s),
            fmt::format("{} s", experiment_.safety.command_validity_s));
  }

  void check_lcm() const {
    const LcmSettings& lcm = experiment_.transport.lcm;
    const std::pair<const char*, const std::string&> channels[] = {
        {"mocap_channel", lcm.mocap_channel},
        {"command_channel", lcm.command_channel},
        {"measurement_channel", lcm.measurement_channel},
        {"reference_channel", lcm.reference_channel},
        {"operator_channel", lcm.operator_channel},
        {"status_channel", lcm.status_channel},
        {"timing_channel", lcm.timing_channel},
        {"tick_channel", lcm.tick_channel},
        {"valves_channel", lcm.valves_channel},
        {"plant_channel", lcm.plant_channel},
        {"deadman_channel", lcm.deadman_channel}};
    std::set<std::string> seen;
    for (const auto& [key, name] : channels) {
      if (name.empty()) continue;  // what may be left out
      check_word(fmt::format("daemon.lcm.{}", key), name);
      require(seen.insert(name).second, fmt::format("daemon.lcm.{}", key), "a channel of its own",
              "\"" + name + "\", which another key names too");
    }
    check_body_channels(seen);
    require(lcm.url.find("://") != std::string::npos, "daemon.lcm.url",
            "an LCM provider, such as udpm://239.255.76.67:7667?ttl=0", "\"" + lcm.url + "\"");
    // LCM takes a group without a port for port 0, where nobody hears another.
    const std::string network = lcm.url.substr(0, lcm.url.find('?'));
    require(!network.starts_with("udpm://") || network == "udpm://" ||
                network.find(':', 7) != std::string::npos,
            "daemon.lcm.url", "a port behind the group, such as udpm://239.255.76.67:7667?ttl=0",
            "\"" + lcm.url + "\"");
  }

  void check_valves() const {
    const ValveDriverSettings& valves = experiment_.valves;
    // Arms that have no terminal need not fit into one.
    if (experiment_.actuation.kind == ActuationKind::torque || !reader_.given("valves")) return;
    in_addr address{};
    require(inet_pton(AF_INET, valves.host.c_str(), &address) == 1, "valves.host",
            "an IPv4 address", "\"" + valves.host + "\"");
    std::set<int> seen;
    for (const int valve : valves.order) {
      require(seen.insert(valve).second, "valves.order", "every valve once",
              fmt::format("valve {} twice", valve));
    }
    const double period_s = 1.0 / valves.rate_hz;
    require(valves.response_timeout_s < period_s, "valves.response_timeout_s",
            fmt::format("less than one period of valves.rate_hz ({:.6g} s)", period_s),
            fmt::format("{} s", valves.response_timeout_s));
    require(valves.backoff_s <= valves.longest_backoff_s, "valves.longest_backoff_s",
            fmt::format("at least backoff_s ({} s)", valves.backoff_s),
            fmt::format("{} s", valves.longest_backoff_s));
    const double silent_s = (valves.tolerated_failures + 1) * period_s;
    const double least_s = std::max(valves.registers.timeout_least_s, silent_s);
    require(valves.failsafe_timeout_s >= least_s, "valves.failsafe_timeout_s",
            fmt::format("at least {:.6g} s (what the terminal takes, and tolerated_failures + 1 "
                        "periods)",
                        least_s),
            fmt::format("{} s", valves.failsafe_timeout_s));
    const double units = valves.failsafe_timeout_s / valves.registers.timeout_unit_s;
    require(units >= 0.5 && units < (valves.registers.timeout_words == 2 ? 4294967295.0 : 65535.0),
            "valves.failsafe_timeout_s", "a time-out that fits its register",
            fmt::format("{:.6g} units", units));
    const std::string fault =
        register_map_fault(valves.registers, valves.order, experiment_.actuation.max_pressure_bar);
    require(fault.empty(), "valves.registers", "registers that fit together", fault);
  }

  /// What the rooms themselves refuse: a map of chambers that cannot reach every direction, and the
  /// like.
  template <typename Build>
  void check_room(const std::string& key, const std::string& expected, const Build& build) const {
    try {
      build();
    } catch (const std::invalid_argument& error) {
      throw reader_.error_at(key, expected, error.what());
    }
  }

  void check_rooms() const {
    const std::string spanning = "chambers that reach a torque in every direction the arm needs";
    check_room("actuation.chambers", spanning,
               [&] { PressureAllocator allocator(experiment_.actuation); });
    check_room("plant.actuation.chambers", spanning,
               [&] { PressureAllocator allocator(experiment_.plant.actuation); });
    check_room("control", "settings the controller can use", [&] {
      std::make_unique<CurvatureController>(experiment_.arm, experiment_.control);
    });
    check_room("reference", "a reference that can be followed", [&] {
      Reference reference(experiment_.reference, experiment_.control, experiment_.arm);
    });
  }

  const Experiment& experiment_;
  const ExperimentReader& reader_;
};

}  // namespace

void check_consistency(const Experiment& experiment, const ExperimentReader& reader) {
  Checks(experiment, reader).run();
}

}  // namespace softarm
