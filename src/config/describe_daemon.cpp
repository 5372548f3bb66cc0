// The declarations of references and of softarmd.
#include <numeric>

#include "config/describe.hpp"

namespace softarm {

void describe_reference(Keys& key, ReferenceSettings& it) {
  const auto names = reference_kinds().names();
  const Key list = {"reference", "phases one after the other; time starts at ACTIVE", kRequired};
  key.list(list, it.phases, [&](ReferencePhase& phase) {
    std::size_t kind = reference_kinds().index(phase.kind.name());
    key("kind", kind, one_of(names),
        "set_point: hold; paper: (24); way_points; live: what comes over LCM; live_tip: targets of "
        "the tip over LCM, by (21); table: a CSV file; tip_...: a path of the tip by (21), "
        "tip_lemniscate: (22)",
        kRequired);
    if (key.reading()) phase.kind = reference_kinds().all()[kind];
    key.when(&phase != &it.phases.back(), [&] {
      key("duration_s", phase.duration_s, above(0, kMany),
          "of the phase; the last one has none and does not end", kRequired);
    });
    phase.kind.describe(key);
  });
}

static void describe(Keys& key, SafetySettings& it) {
  KEY(arming, one_of({"automatic", "explicit"}),
      "automatic: ACTIVE on good frames; explicit: on an operator's arm, the default where valves "
      "is not a terminal on this machine");
  KEY(frame_period_s, above(0, 0.2),
      "nominal, of the motion capture; where frames come three times as fast the arm stays vented");
  KEY(frame_latency_s, from(0, 0.5), "declared, from capture to arrival");
  KEY(hold_after_s, from(0, 1),
      "age of the last frame: HOLD; 0: max(3 T, 3 frame_period_s + frame_latency_s), T = "
      "1/rate_hz");
  KEY(vent_after_s, from(0, 2),
      "the same: VENT; 0: max(0.1 s, 10 frame_period_s, 3 T); above hold_after_s");
  KEY(good_frames, from(1, 10000), "in a row, before HOLD or VENT is left");
  KEY(most_activations, from(1, 20),
      "from vented, in a minute and without an operator's arm; then it stays vented until armed");
  KEY(max_latency_s, above(0, 0.5), "later frames count as stale");
  KEY(frozen_frames, from(0, 1000),
      "identical poses in a row while the command changes: HOLD; 0: not checked");
  KEY(hold_overruns, from(1, 20000), "ticks missed in a row: HOLD; only with SCHED_FIFO");
  KEY(vent_overruns, from(1, 20000), "the same: VENT; above hold_overruns, at most 1 s of ticks");
  KEY(valve_readback, "valves publish measured pressures");
  KEY(valve_silence_s, above(0, 2), "without any measured pressure: FAULT");
  KEY(pressure_tolerance_bar, from(0, 100),
      "measured pressures further outside the range lately commanded: FAULT (burst, leak); 0: not "
      "checked");
  KEY(pressure_settling_s, above(0, 2),
      "how far back that range goes, to twice that: longer than valves and tubes take");
  KEY(curvature_residual_nm, from(0, 1e4),
      "|K u + G - A tau_A| of a segment above it: FAULT; 0: not checked");
  KEY(curvature_settling_s, above(0, 5), "for so long without interruption");
  KEY(oscillation_rad, from(0, 1),
      "amplitude of a coordinate's error that oscillates and does not fade: VENT; 0: not checked");
  KEY(oscillation_periods, from(1, 20), "for so many periods");
  KEY(oscillation_lowest_hz, above(0, 1e3), "slower ones do not count");
  KEY(oscillation_part, from(0, 100),
      "of what the reference itself does meanwhile: a smaller error follows the reference");
  KEY(length_warning, from(0, 1),
      "a segment's measured length off arm.length_m by more, over that: the status reports it; 0: "
      "not checked");
  KEY(length_fault, from(0, 1), "the same: FAULT; 0: not checked");
  KEY(length_settling_s, above(0, 5), "for so long without interruption");
  KEY(deadman_timeout_s, above(0, 2), "without a go on lcm.deadman_channel: VENT");
  KEY(law_validity_s, above(0, 0.5),
      "of control.law: external; an answer counts no longer than that after the state that it "
      "answers: then HOLD");
  KEY(law_vent_after_s, above(0, 0.5), "after that without an answer: VENT");
}

static void describe_mocap(Keys& key, TransportSettings& transport) {
  const std::vector<double> z_up = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  const std::vector<double> y_up = {1, 0, 0, 0, 0, -1, 0, 1, 0};
  MocapSourceSettings& it = transport.mocap;
  const auto names = mocap_sources().names();
  std::size_t source = mocap_sources().index(it.source.name());
  key("source", source, one_of(names),
      "softarm: mocap_frame_t; optitrack: optitrack_frame_t; rigid_transform: rigid_transform_t "
      "(Vicon), one channel a body");
  if (key.reading()) {
    it.source = mocap_sources().all()[source];
    it.quaternion = it.source.quaternion;
    transport.lcm.mocap_channel = it.source.channel;
  }
  KEY(unit, one_of({"m", "mm"}), "of the positions sent");
  KEY(quaternion, one_of({"xyzw", "wxyz"}), "order; left out: xyzw for optitrack, else wxyz");
  KEY(axes, from(-1, 1).or_word("z_up", z_up).or_word("y_up", y_up),
      "of the sender's world: z_up; y_up (x, -z, y become our x, y, z); or the rotation to ours");
}

static void describe_frame(Keys& key, MarkerFrameSettings& it, bool named) {
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
  if (it.segment_marker_frames.empty()) {
    it.segment_marker_frames.resize(n);
    if (named) it.base_marker_frame.name = "base";
    for (std::size_t i = 0; i < n && named; ++i)
      it.segment_marker_frames[i].name = "segment_" + std::to_string(i + 1);
  }
  KEY(base_id, id.or_word("fixed", -1), "body of the base, or fixed: arm.base holds");
  KEY(segment_ids, id.each(),
      "bodies of the segments' ends, base to tip (rigid_transform: names instead); left out: 1, 2, "
      "...");
  key.section({"base_plate", "S_0 on the body of the base; softarm calibrate finds it"},
              [&] { describe_frame(key, it.base_marker_frame, named); });
  key.one_or_each({"segment_plates", "S_i on the segments' bodies, of all or a list; likewise"},
                  it.segment_marker_frames,
                  [&](auto& frame) { describe_frame(key, frame, named); });
}

static void describe(Keys& key, RealtimeSettings& it) {
  KEY(fifo, "SCHED_FIFO for the tick");
  KEY(priority, from(1, 99), "of SCHED_FIFO");
  KEY(cpu, from(0, 1023).or_word("any", -1), "the tick's own CPU, or any");
  KEY(lock_memory, "mlockall");
}

constinit const std::array<ChannelKey, 14> kChannelKeys = {{
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
    {"tip_channel", &LcmSettings::tip_channel, 1, "live targets of the tip"},
    {"law_state_channel", &LcmSettings::law_state_channel, 1, "what an external law is to answer"},
    {"law_channel", &LcmSettings::law_channel, 1, "answers of an external law"},
}};

static void describe_lcm(Keys& key, LcmSettings& it, SafetySettings& safety) {
  KEY(url, from(1, 200), "LCM provider; the time to live keeps messages on this machine");
  for (const auto& [name, channel, fewest, doc] : kChannelKeys)
    key(name, it.*channel, from(fewest, 63), doc);
  key("command_validity_s", safety.command_validity_s, above(0, 0.5),
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
  const bool named = transport.mocap.source.channel_per_body;
  key.section({"bodies", "which bodies of a frame carry the base and the segments' ends"},
              [&] { describe_bodies(key, transport.bodies, named); });
  KEY(realtime, "scheduling and memory of the daemon");
  key.section({"lcm", "channels, distinct where two arms share a machine"},
              [&] { describe_lcm(key, transport.lcm, it.safety); });
}

}  // namespace softarm
