// The description of references, the daemon and the simulated arm.
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <string>

#include "config/schema.hpp"
#include "softarm/base/realtime.hpp"
#include "softarm/runtime/settings.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {
namespace {

constexpr auto kRequired = Presence::required;
constexpr double kTwoPi = 6.283185307179586;
constexpr double kMany = 1e6;

void describe_paper(SchemaVisitor& visitor, PaperReference& paper) {
  visitor.number(
      {"theta_rad", "rad", "theta of every segment after the rise", from_to(0.0, kTwoPi)},
      paper.theta_rad);
  visitor.number({"rise_s", "s", "time of the rise from theta = 0", above_to(0.0, 1e3)},
                 paper.rise_s);
  visitor.number({"phi_centre_rad", "rad", "phi_i = centre + amplitude cos(rate t + (i - 1) step)",
                  from_to(-kTwoPi, kTwoPi)},
                 paper.phi_centre_rad);
  visitor.number({"phi_amplitude_rad", "rad", "amplitude of phi", from_to(0.0, 100.0)},
                 paper.phi_amplitude_rad);
  visitor.number({"rate_radps", "rad/s", "rate of phi", from_to(0.0, 1e3)}, paper.rate_radps);
  visitor.number(
      {"phase_step_rad", "rad", "phase from segment to segment", from_to(-kTwoPi, kTwoPi)},
      paper.phase_step_rad);
}

void describe_way_points(SchemaVisitor& visitor, WayPointReference& reference, int segments) {
  visitor.flag({"repeat", "", "start again after the last point, which then equals the first"},
               reference.repeat);
  visitor.list(
      {"points", "", "at rest in each, minimum jerk between them", {}, kRequired},
      static_cast<int>(reference.points.size()),
      [&](int size) { reference.points.resize(static_cast<std::size_t>(size)); },
      [&](int i) {
        WayPoint& point = reference.points[static_cast<std::size_t>(i)];
        visitor.number({"time_s", "s", "since the start of the phase, increasing",
                        from_to(0.0, kMany), kRequired},
                       point.time_s);
        describe_pose(visitor, point.u_rad, segments, kRequired);
      });
}

void describe_tip_path(SchemaVisitor& visitor, TipPathReference& path) {
  const auto vector = [&](const char* key, const char* doc, Eigen::Vector3d& value) {
    std::vector<double> values(value.data(), value.data() + 3);
    visitor.numbers({key, "m", doc, from_to(-1e3, 1e3)}, {Shape::Kind::list, 3}, values);
    value = Eigen::Map<const Eigen::Vector3d>(values.data());
  };
  vector("centre_m", "of the path, or the point, in the world", path.centre_m);
  if (path.shape == TipPathShape::point) return;
  vector("first_axis_m", "times cos(rate t)", path.first_axis_m);
  vector("second_axis_m", "times sin(rate t), in a lemniscate sin(2 rate t)", path.second_axis_m);
  visitor.number({"rate_radps", "rad/s", "of the path", from_to(0.0, 1e3)}, path.rate_radps);
}

/// Declares the keys of a kind, if the phase is of that kind.
template <class K, class Describe>
void keys_of(ReferencePhase& phase, const Describe& describe_kind) {
  const K* kind = phase.kind.get_if<K>();
  if (kind == nullptr) return;
  K settings = *kind;
  describe_kind(settings);
  phase.kind = settings;
}

void describe_phase(SchemaVisitor& visitor, ReferencePhase& phase, bool last, int segments) {
  const std::vector<ReferenceKind>& kinds = reference_kinds().all();
  std::vector<const char*> names;
  for (const ReferenceKind& kind : kinds) names.push_back(kind.name());
  const std::string before = phase.kind.name();
  int index = static_cast<int>(std::find(names.begin(), names.end(), before) - names.begin());
  visitor.choice(
      {"kind",
       "",
       "set_point: hold; paper: (24); way_points; live: what comes over LCM; tip_...: a path of "
       "the tip by (21), tip_lemniscate: (22)",
       {},
       kRequired},
      names, index);
  const ReferenceKind& chosen = kinds[static_cast<std::size_t>(index)];
  if (before != chosen.name()) phase.kind = chosen;
  if (!last) {
    visitor.number({"duration_s", "s", "of the phase; the last one lasts for ever and has none",
                    above_to(0.0, kMany), kRequired},
                   phase.duration_s);
  }
  keys_of<SetPointReference>(phase, [&](SetPointReference& hold) {
    describe_pose(visitor, hold.u_rad, segments, kRequired);
  });
  keys_of<PaperReference>(phase, [&](PaperReference& paper) { describe_paper(visitor, paper); });
  keys_of<WayPointReference>(
      phase, [&](WayPointReference& way) { describe_way_points(visitor, way, segments); });
  keys_of<LiveReference>(phase, [&](LiveReference& live) {
    visitor.number(
        {"timeout_s", "s", "silence after which the last u is held at rest", above_to(0.0, 1e3)},
        live.timeout_s);
  });
  keys_of<TipPathReference>(phase,
                            [&](TipPathReference& path) { describe_tip_path(visitor, path); });
}

void describe_safety(SchemaVisitor& visitor, SafetySettings& safety) {
  static const std::array<const char*, 2> kArming = {"automatic", "explicit"};
  visitor.choice({"arming", "", "automatic: ACTIVE on good frames; explicit: on an operator's arm"},
                 kArming, safety.arming);
  visitor.number({"frame_period_s", "s", "nominal, of the motion capture", above_to(0.0, 10.0)},
                 safety.frame_period_s);
  visitor.number({"frame_latency_s", "s", "declared, from capture to arrival", from_to(0.0, 10.0)},
                 safety.frame_latency_s);
  visitor.number({"hold_after_s", "s",
                  "age of the last frame; 0: max(3 T, 3 frame periods + declared latency)",
                  from_to(0.0, 100.0)},
                 safety.hold_after_s);
  visitor.number({"vent_after_s", "s", "age of the last frame; 0: max(100 ms, 10 frame periods)",
                  from_to(0.0, 100.0)},
                 safety.vent_after_s);
  visitor.integer({"good_frames", "", "in a row, before HOLD or VENT is left", from_to(1, 100000)},
                  safety.good_frames);
  visitor.number({"max_latency_s", "s", "later frames count as stale", above_to(0.0, 10.0)},
                 safety.max_latency_s);
  visitor.integer({"frozen_frames", "",
                   "identical poses in a row while the command changes: HOLD; 0: not checked",
                   from_to(0, 1000000)},
                  safety.frozen_frames);
  visitor.integer({"hold_overruns", "", "ticks missed in a row: HOLD; judged only with SCHED_FIFO",
                   from_to(1, 1000000)},
                  safety.hold_overruns);
  visitor.integer({"vent_overruns", "", "the same: VENT", from_to(1, 1000000)},
                  safety.vent_overruns);
  visitor.flag({"valve_readback", "", "valves publish measured pressures"}, safety.valve_readback);
  visitor.number(
      {"valve_silence_s", "s", "without any measured pressure: FAULT", above_to(0.0, 10.0)},
      safety.valve_silence_s);
  visitor.number({"pressure_tolerance_bar", "bar",
                  "measured pressures further outside the range lately commanded: FAULT (burst, "
                  "leak); 0: not checked",
                  from_to(0.0, 100.0)},
                 safety.pressure_tolerance_bar);
  visitor.number({"pressure_settling_s", "s",
                  "how far back, at least, that range goes: longer than valves and tubes take",
                  above_to(0.0, 10.0)},
                 safety.pressure_settling_s);
  visitor.number(
      {"curvature_residual_nm", "N m",
       "|K u + G - A tau_A| of a segment above it: FAULT; 0: not checked", from_to(0.0, 1e4)},
      safety.curvature_residual_nm);
  visitor.number(
      {"curvature_settling_s", "s", "for so long without interruption", above_to(0.0, 100.0)},
      safety.curvature_settling_s);
  visitor.number(
      {"deadman_timeout_s", "s", "without a go on lcm.deadman_channel: VENT", above_to(0.0, 10.0)},
      safety.deadman_timeout_s);
}

void describe_lcm(SchemaVisitor& visitor, LcmSettings& lcm, double& command_validity_s) {
  const auto channel = [&](const char* key, const char* doc, std::string& value) {
    visitor.text({key, "", doc, from_to(1, 63)}, value);
  };
  visitor.text(
      {"url", "", "LCM provider; the time to live keeps messages on this machine", from_to(1, 200)},
      lcm.url);
  channel("mocap_channel",
          "motion-capture frames; left out: OPTITRACK_FRAMES for optitrack, VICON for "
          "rigid_transform, where it is what the bodies' channels begin with",
          lcm.mocap_channel);
  channel("command_channel", "pressure commands", lcm.command_channel);
  channel("measurement_channel", "measured pressures", lcm.measurement_channel);
  channel("reference_channel", "live references", lcm.reference_channel);
  channel("operator_channel", "operator's commands", lcm.operator_channel);
  channel("status_channel", "controller status", lcm.status_channel);
  channel("timing_channel", "timing histograms", lcm.timing_channel);
  visitor.text(
      {"tick_channel", "", "what every tick was given, for softarm replay; empty: not published",
       from_to(0, 63)},
      lcm.tick_channel);
  channel("valves_channel", "status of the valves' driver", lcm.valves_channel);
  channel("plant_channel", "a simulated arm's true state", lcm.plant_channel);
  visitor.text(
      {"deadman_channel", "", "go of a dead-man input; \"\": there is none", from_to(0, 63)},
      lcm.deadman_channel);
  visitor.number({"command_validity_s", "s", "after which the valve side vents by itself",
                  above_to(0.0, 10.0)},
                 command_validity_s);
}

void describe_realtime(SchemaVisitor& visitor, RealtimeSettings& realtime) {
  visitor.flag({"fifo", "", "SCHED_FIFO for the tick"}, realtime.fifo);
  visitor.integer({"priority", "", "of SCHED_FIFO", from_to(1, 99)}, realtime.priority);
  std::int64_t cpu = realtime.cpu;
  visitor.integer_or_word({"cpu", "", "the tick's own CPU, or any", from_to(0, 1023)}, "any", cpu);
  realtime.cpu = static_cast<int>(cpu);
  visitor.flag({"lock_memory", "", "mlockall"}, realtime.lock_memory);
}

void describe_mocap(SchemaVisitor& visitor, TransportSettings& transport) {
  static const std::array<const char*, 2> kUnits = {"m", "mm"};
  static const std::array<const char*, 2> kOrders = {"xyzw", "wxyz"};
  static const std::array<const char*, 2> kAxes = {"z_up", "y_up"};
  static const std::array<Eigen::Matrix3d, 2> kRotations = {
      Eigen::Matrix3d::Identity(),
      (Eigen::Matrix3d() << 1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0).finished()};
  MocapSourceSettings& mocap = transport.mocap;
  const std::vector<MocapSourceKind>& sources = mocap_sources().all();
  std::vector<const char*> names;
  for (const MocapSourceKind& source : sources) names.push_back(source.name());
  int index =
      static_cast<int>(std::find(sources.begin(), sources.end(), mocap.source) - sources.begin());
  visitor.choice({"source", "",
                  "softarm: mocap_frame_t; optitrack: optitrack_frame_t; rigid_transform: "
                  "rigid_transform_t (Vicon), one channel a body"},
                 names, index);
  if (visitor.reading()) {
    mocap.source = sources[static_cast<std::size_t>(index)];
    mocap.quaternion = mocap.source.quaternion;
    transport.lcm.mocap_channel = mocap.source.channel;
  }
  visitor.choice({"unit", "", "of the positions sent"}, kUnits, mocap.unit);
  visitor.choice({"quaternion", "", "order sent; left out: xyzw for optitrack, wxyz otherwise"},
                 kOrders, mocap.quaternion);
  visitor.matrix_or_word({"axes", "",
                          "of the sender's world: z_up; y_up (x, -z, y become our x, y, z); or the "
                          "rotation from it to ours, a 3 x 3 matrix",
                          from_to(-1.0, 1.0)},
                         kAxes, kRotations, mocap.axes);
}

void describe_plate(SchemaVisitor& visitor, PlateSettings& plate, bool named) {
  if (named)
    visitor.text(
        {"name", "", "of the body; its channel is lcm.mocap_channel, _, name", from_to(1, 40)},
        plate.name);
  visitor.vector3({"position_m", "m", "of S_i in the body's own frame", from_to(-10.0, 10.0)},
                  plate.position_m);
  visitor.vector3({"rotation_rad", "rad", "rotation vector of S_i in the body's own frame",
                   from_to(-kTwoPi, kTwoPi)},
                  plate.rotation_rad);
}

void describe_bodies(SchemaVisitor& visitor, BodySettings& bodies, int segments, bool named) {
  std::int64_t base = bodies.base_id;
  visitor.integer_or_word(
      {"base_id", "", "body of the base, or fixed: arm.base holds", from_to(0, 2147483647.0)},
      "fixed", base);
  bodies.base_id = static_cast<int>(base);
  if (bodies.segment_ids.empty()) {
    bodies.segment_ids.resize(static_cast<std::size_t>(segments));
    std::iota(bodies.segment_ids.begin(), bodies.segment_ids.end(), 1);
  }
  visitor.integers({"segment_ids", "",
                    "bodies of the segments' ends, base to tip (rigid_transform: names instead)",
                    from_to(0, 2147483647.0)},
                   segments, bodies.segment_ids);
  if (bodies.segment_plates.empty()) {
    bodies.segment_plates.resize(static_cast<std::size_t>(segments));
    if (named) {
      bodies.base_plate.name = "base";
      for (std::size_t i = 0; i < bodies.segment_plates.size(); ++i)
        bodies.segment_plates[i].name = "segment_" + std::to_string(i + 1);
    }
  }
  auto& plates = bodies.segment_plates;
  visitor.section({"base_plate", "", "S_0 on the body of the base; softarm calibrate"},
                  SectionKind::plain, [&] { describe_plate(visitor, bodies.base_plate, named); });
  const bool all_equal = std::all_of(plates.begin(), plates.end(),
                                     [&](const auto& other) { return other == plates.front(); });
  visitor.shared_or_list(
      {"segment_plates", "",
       "S_i on the bodies of the segments' ends, of all or a list; softarm calibrate finds them"},
      segments, all_equal,
      [&](int i) { describe_plate(visitor, plates[static_cast<std::size_t>(i)], named); });
}

}  // namespace

void describe_pose(SchemaVisitor& visitor, std::vector<double>& u_rad, int segments,
                   Presence presence) {
  const auto n = static_cast<std::size_t>(segments);
  u_rad.resize(2 * n, 0.0);
  if (visitor.prefers("u_rad", "theta_rad")) {
    visitor.numbers({"u_rad", "rad", "[x, y] of every segment, u = theta [cos phi, sin phi]",
                     from_to(-kTwoPi, kTwoPi), presence},
                    {Shape::Kind::scalar_or_pairs, segments}, u_rad);
    return;
  }
  std::vector<double> theta(n), phi(n);
  for (std::size_t i = 0; i < n; ++i) {
    theta[i] = std::hypot(u_rad[2 * i], u_rad[2 * i + 1]);
    phi[i] = theta[i] > 0.0 ? std::atan2(u_rad[2 * i + 1], u_rad[2 * i]) : 0.0;
  }
  const Shape shape = {Shape::Kind::scalar_or_list, segments};
  visitor.numbers({"theta_rad", "rad", "bend of all segments, or a list (or u_rad: [[x, y], ...])",
                   from_to(-kTwoPi, kTwoPi), presence},
                  shape, theta);
  visitor.numbers({"phi_rad", "rad", "direction of the bend of all segments, or a list",
                   from_to(-100.0, 100.0)},
                  shape, phi);
  for (std::size_t i = 0; i < n && visitor.reading(); ++i) {
    // Adding zero makes a negative zero positive, so that what is printed reads back the same.
    u_rad[2 * i] = theta[i] * std::cos(phi[i]) + 0.0;
    u_rad[2 * i + 1] = theta[i] * std::sin(phi[i]) + 0.0;
  }
}

void describe_reference(SchemaVisitor& visitor, ReferenceSettings& reference, int segments) {
  auto& phases = reference.phases;
  visitor.list(
      {"reference",
       "",
       "phases that follow each other; time starts when ACTIVE does",
       {},
       kRequired},
      static_cast<int>(phases.size()),
      [&](int size) { phases.resize(static_cast<std::size_t>(size)); },
      [&](int i) {
        const auto index = static_cast<std::size_t>(i);
        describe_phase(visitor, phases[index], index + 1 == phases.size(), segments);
      });
}

void describe_daemon(SchemaVisitor& visitor, Experiment& experiment, int segments) {
  TransportSettings& transport = experiment.transport;
  static const std::array<const char*, 2> kCaptureTimes = {"sender", "latency"};
  visitor.number({"rate_hz", "Hz", "of the tick", from_to(1.0, 20000.0)}, experiment.rate_hz);
  visitor.choice({"capture_time", "",
                  "sender: its clock, related to ours; latency: arrival minus frame_latency_s"},
                 kCaptureTimes, transport.capture_time);
  visitor.section({"safety", "", "thresholds of the safety monitor"}, SectionKind::plain,
                  [&] { describe_safety(visitor, experiment.safety); });
  visitor.section({"mocap", "", "who sends motion-capture frames, and what the numbers mean"},
                  SectionKind::plain, [&] { describe_mocap(visitor, transport); });
  const bool named = transport.mocap.source.channel_per_body;
  visitor.section({"bodies", "", "which bodies of a frame carry the base and the segments' ends"},
                  SectionKind::plain,
                  [&] { describe_bodies(visitor, transport.bodies, segments, named); });
  visitor.section({"realtime", "", "the daemon's place on the machine"}, SectionKind::plain,
                  [&] { describe_realtime(visitor, experiment.realtime); });
  visitor.section(
      {"lcm", "", "channels, distinct where two arms share a machine"}, SectionKind::plain,
      [&] { describe_lcm(visitor, transport.lcm, experiment.safety.command_validity_s); });
}

}  // namespace softarm
