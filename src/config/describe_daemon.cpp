// The declarations of references and of softarmd.
#include <cmath>
#include <numeric>

#include "config/describe.hpp"

namespace softarm {

void describe_pose(Keys& key, std::vector<double>& u_rad, Presence presence) {
  const auto n = static_cast<std::size_t>(key.segments);
  u_rad.resize(2 * n, 0.0);
  const auto as_u = [&] {
    key("u_rad", u_rad, from(-kTwoPi, kTwoPi).one_or_pairs(),
        "[x, y] of every segment, u = theta [cos phi, sin phi]", presence);
  };
  key.either("u_rad", as_u, "theta_rad", [&] {
    std::vector<double> theta(n), phi(n);
    for (std::size_t i = 0; i < n; ++i) {
      theta[i] = std::hypot(u_rad[2 * i], u_rad[2 * i + 1]);
      phi[i] = theta[i] > 0.0 ? std::atan2(u_rad[2 * i + 1], u_rad[2 * i]) : 0.0;
    }
    key("theta_rad", theta, from(-kTwoPi, kTwoPi).one_or_each(),
        "bend of all segments, or a list (or u_rad: [[x, y], ...])", presence);
    key("phi_rad", phi, from(-100, 100).one_or_each(),
        "direction of the bend of all segments, or a list");
    for (std::size_t i = 0; i < n && key.reading(); ++i) {
      // Adding zero makes a negative zero positive, so that what is printed reads back the same.
      u_rad[2 * i] = theta[i] * std::cos(phi[i]) + 0.0;
      u_rad[2 * i + 1] = theta[i] * std::sin(phi[i]) + 0.0;
    }
  });
}

static void describe(Keys& key, SetPointReference& it) { describe_pose(key, it.u_rad, kRequired); }

static void describe(Keys& key, PaperReference& it) {
  KEY(theta_rad, from(0, kTwoPi), "theta of every segment after the rise");
  KEY(rise_s, above(0, 1e3), "time of the rise from theta = 0");
  KEY(phi_centre_rad, from(-kTwoPi, kTwoPi),
      "phi_i = centre + amplitude cos(rate t + (i - 1) step)");
  KEY(phi_amplitude_rad, from(0, 100), "amplitude of phi");
  KEY(rate_radps, from(0, 1e3), "rate of phi");
  KEY(phase_step_rad, from(-kTwoPi, kTwoPi), "phase from segment to segment");
}

static void describe(Keys& key, WayPointReference& it) {
  KEY(repeat, "start again after the last point, which then equals the first; left out: false");
  const Key points = {"points", "at rest in each, minimum jerk between them", kRequired};
  key.list(points, it.points, [&](WayPoint& point) {
    key("time_s", point.time_s, from(0, kMany), "since the phase began, increasing", kRequired);
    describe_pose(key, point.u_rad, kRequired);
  });
}

static void describe(Keys& key, LiveReference& it) {
  KEY(timeout_s, above(0, 1e3), "silence after which the last u is held at rest");
}

static void describe(Keys& key, TipPathReference& it) {
  const Form place = from(-1e3, 1e3);
  KEY(centre_m, place, "of the path, in the world; left out, this and what follows are (22)");
  if (it.shape == TipPathShape::point) return;
  KEY(first_axis_m, place, "times cos(rate t)");
  KEY(second_axis_m, place, "times sin(rate t), in a lemniscate sin(2 rate t)");
  KEY(rate_radps, from(0, 1e3), "of the path");
}

const std::array<PhaseKind, 7>& phase_kinds() {
  static const std::array<PhaseKind, 7> kinds = {{
      {"set_point", SetPointReference{}},
      {"paper", PaperReference{}},
      {"way_points", WayPointReference{}},
      {"live", LiveReference{}},
      {"tip_point", TipPathReference{.shape = TipPathShape::point}},
      {"tip_circle", TipPathReference{.shape = TipPathShape::circle}},
      {"tip_lemniscate", TipPathReference{.shape = TipPathShape::lemniscate}},
  }};
  return kinds;
}

/// Index of the kind of a phase.
static int kind_of(const ReferenceKind& kind) {
  const auto* path = std::get_if<TipPathReference>(&kind);
  return static_cast<int>(kind.index()) + (path ? static_cast<int>(path->shape) : 0);
}

void describe_reference(Keys& key, ReferenceSettings& it) {
  const auto& kinds = phase_kinds();
  std::vector<const char*> names(kinds.size());
  for (std::size_t i = 0; i < names.size(); ++i) names[i] = kinds[i].name;
  const Key list = {"reference", "phases one after the other; time starts at ACTIVE", kRequired};
  key.list(list, it.phases, [&](ReferencePhase& phase) {
    int kind = kind_of(phase.kind);
    key("kind", kind, one_of(names),
        "set_point: hold; paper: (24); way_points; live: what comes over LCM; tip_...: a path of "
        "the tip by (21), tip_lemniscate: (22)",
        kRequired);
    if (key.reading()) phase.kind = kinds[static_cast<std::size_t>(kind)].empty;
    key.when(&phase != &it.phases.back(), [&] {
      key("duration_s", phase.duration_s, above(0, kMany),
          "of the phase; the last one has none and does not end", kRequired);
    });
    std::visit([&](auto& reference) { describe(key, reference); }, phase.kind);
  });
}

static void describe(Keys& key, SafetySettings& it) {
  KEY(arming, one_of({"automatic", "explicit"}),
      "automatic: ACTIVE on good frames; explicit: on an operator's arm");
  KEY(frame_period_s, above(0, 10), "nominal, of the motion capture");
  KEY(frame_latency_s, from(0, 10), "declared, from capture to arrival");
  KEY(hold_after_s, from(0, 100),
      "age of the last frame: HOLD; 0: max(3 T, 3 frame_period_s + frame_latency_s), T = "
      "1/rate_hz");
  KEY(vent_after_s, from(0, 100),
      "the same: VENT; 0: max(0.1 s, 10 frame_period_s, 3 T); above hold_after_s");
  KEY(good_frames, from(1, 100000), "in a row, before HOLD or VENT is left");
  KEY(max_latency_s, above(0, 10), "later frames count as stale");
  KEY(frozen_frames, from(0, 1000000),
      "identical poses in a row while the command changes: HOLD; 0: not checked");
  KEY(hold_overruns, from(1, 1000000), "ticks missed in a row: HOLD; only with SCHED_FIFO");
  KEY(vent_overruns, from(1, 1000000), "the same: VENT; above hold_overruns");
  KEY(valve_readback, "valves publish measured pressures");
  KEY(valve_silence_s, above(0, 10), "without any measured pressure: FAULT");
  KEY(pressure_tolerance_bar, from(0, 100),
      "measured pressures further outside the range lately commanded: FAULT (burst, leak); 0: not "
      "checked");
  KEY(pressure_settling_s, above(0, 10),
      "how far back that range goes, to twice that: longer than valves and tubes take");
  KEY(curvature_residual_nm, from(0, 1e4),
      "|K u + G - A tau_A| of a segment above it: FAULT; 0: not checked");
  KEY(curvature_settling_s, above(0, 100), "for so long without interruption");
  KEY(deadman_timeout_s, above(0, 10), "without a go on lcm.deadman_channel: VENT");
}

static void describe_mocap(Keys& key, TransportSettings& transport) {
  const std::vector<double> z_up = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  const std::vector<double> y_up = {1, 0, 0, 0, 0, -1, 0, 1, 0};
  MocapSourceSettings& it = transport.mocap;
  KEY(source, one_of({"softarm", "optitrack", "rigid_transform"}),
      "softarm: mocap_frame_t; optitrack: optitrack_frame_t; rigid_transform: rigid_transform_t "
      "(Vicon), one channel a body");
  if (key.reading()) {
    const bool optitrack = it.source == MocapSourceKind::optitrack;
    it.quaternion = optitrack ? QuaternionOrder::xyzw : QuaternionOrder::wxyz;
    if (optitrack) transport.lcm.mocap_channel = "OPTITRACK_FRAMES";
    if (it.source == MocapSourceKind::rigid_transform) transport.lcm.mocap_channel = "VICON";
  }
  KEY(unit, one_of({"m", "mm"}), "of the positions sent");
  KEY(quaternion, one_of({"xyzw", "wxyz"}), "order; left out: xyzw for optitrack, else wxyz");
  KEY(axes, from(-1, 1).or_word("z_up", z_up).or_word("y_up", y_up),
      "of the sender's world: z_up; y_up (x, -z, y become our x, y, z); or the rotation to ours");
}

static void describe_frame(Keys& key, PlateSettings& it, bool named) {
  key.when(named, [&] {
    KEY(name, from(1, 40), "of the body, whose channel is lcm.mocap_channel, _, name");
  });
  KEY(position_m, from(-10, 10), "of S_i in the body's own frame");
  KEY(rotation_rad, from(-kTwoPi, kTwoPi), "rotation vector of S_i in the body's own frame");
}

static void describe_bodies(Keys& key, BodySettings& it, bool named) {
  const Form id = from(0, 2147483647.0);
  const auto n = static_cast<std::size_t>(key.segments);
  if (it.segment_ids.empty()) {
    it.segment_ids.resize(n);
    std::iota(it.segment_ids.begin(), it.segment_ids.end(), 1);
  }
  if (it.segment_plates.empty()) {
    it.segment_plates.resize(n);
    if (named) it.base_plate.name = "base";
    for (std::size_t i = 0; i < n && named; ++i)
      it.segment_plates[i].name = "segment_" + std::to_string(i + 1);
  }
  KEY(base_id, id.or_word("fixed", -1), "body of the base, or fixed: arm.base holds");
  KEY(segment_ids, id.each(),
      "bodies of the segments' ends, base to tip (rigid_transform: names instead); left out: 1, 2, "
      "...");
  key.section({"base_plate", "S_0 on the body of the base; softarm calibrate finds it"},
              [&] { describe_frame(key, it.base_plate, named); });
  key.one_or_each({"segment_plates", "S_i on the segments' bodies, of all or a list; likewise"},
                  it.segment_plates, [&](auto& frame) { describe_frame(key, frame, named); });
}

static void describe(Keys& key, RealtimeSettings& it) {
  KEY(fifo, "SCHED_FIFO for the tick");
  KEY(priority, from(1, 99), "of SCHED_FIFO");
  KEY(cpu, from(0, 1023).or_word("any", -1), "the tick's own CPU, or any");
  KEY(lock_memory, "mlockall");
}

constinit const std::array<ChannelKey, 11> kChannelKeys = {{
    {"mocap_channel", &LcmSettings::mocap_channel, 1,
     "frames; left out: OPTITRACK_FRAMES for optitrack; VICON for rigid_transform, where it is "
     "what "
     "the bodies' channels begin with"},
    {"command_channel", &LcmSettings::command_channel, 1, "pressure commands"},
    {"measurement_channel", &LcmSettings::measurement_channel, 1, "measured pressures"},
    {"reference_channel", &LcmSettings::reference_channel, 1, "live references"},
    {"operator_channel", &LcmSettings::operator_channel, 1, "operator's commands"},
    {"status_channel", &LcmSettings::status_channel, 1, "controller status"},
    {"timing_channel", &LcmSettings::timing_channel, 1, "timing histograms"},
    {"tick_channel", &LcmSettings::tick_channel, 0,
     "what every tick was given, for softarm replay; empty: not published"},
    {"valves_channel", &LcmSettings::valves_channel, 1, "status of the valves' driver"},
    {"plant_channel", &LcmSettings::plant_channel, 1, "a simulated arm's true state"},
    {"deadman_channel", &LcmSettings::deadman_channel, 0, "go of a dead-man input; empty: none"},
}};

static void describe_lcm(Keys& key, LcmSettings& it, SafetySettings& safety) {
  KEY(url, from(1, 200), "LCM provider; the time to live keeps messages on this machine");
  for (const auto& [name, channel, fewest, doc] : kChannelKeys)
    key(name, it.*channel, from(fewest, 63), doc);
  key("command_validity_s", safety.command_validity_s, above(0, 10),
      "after which the valve side vents by itself");
}

void describe_daemon(Keys& key, Experiment& it) {
  TransportSettings& transport = it.transport;
  KEY(rate_hz, from(1, 20000), "of the tick");
  key("capture_time", transport.capture_time, one_of({"sender", "latency"}),
      "sender: its clock, related to ours; latency: arrival minus frame_latency_s");
  KEY(safety, "thresholds of the safety monitor");
  key.section({"mocap", "the sender of frames, and its conventions"},
              [&] { describe_mocap(key, transport); });
  const bool named = transport.mocap.source == MocapSourceKind::rigid_transform;
  key.section({"bodies", "which bodies of a frame carry the base and the segments' ends"},
              [&] { describe_bodies(key, transport.bodies, named); });
  KEY(realtime, "scheduling and memory of the daemon");
  key.section({"lcm", "channels, distinct where two arms share a machine"},
              [&] { describe_lcm(key, transport.lcm, it.safety); });
}

}  // namespace softarm
