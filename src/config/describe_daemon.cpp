// The declarations of references and of softarmd.
#include <numeric>

#include "config/describe.hpp"

namespace softarm {

static void describe_elongation(Keys& key, ReferencePhase& phase) {
  const bool curvatures =
      !phase.kind.is_tip_path() && phase.kind.get_if<LiveReference>() == nullptr;
  key.when(curvatures, [&] {
    ElongationPath& it = phase.elongation;
    key.section(
        {"elongation",
         "of every segment that stretches, mean + amplitude sin(rate t), as far as pressures can"},
        [&] {
          KEY(mean_m, from(-1, 1), "left out: that of the bias pressures");
          KEY(amplitude_m, from(-1, 1), "of every segment");
          KEY(rate_radps, from(0, 100), "t = 0 where the phase begins");
        });
  });
}

void describe_reference(Keys& key, ReferenceSettings& it) {
  const Key list = {"reference", "phases one after the other; time starts at ACTIVE", kRequired};
  key.list(list, it.phases, [&](ReferencePhase& phase) {
    describe_choice(key, "kind", reference_kinds(), phase.kind,
                    "set_point: hold; paper: (24); way_points; live: what comes over LCM; "
                    "live_tip: targets of the tip over LCM, by (21); table: a CSV file; tip_...: a "
                    "path of the tip by (21), tip_lemniscate: (22)",
                    kRequired);
    const bool last = &phase == &it.phases.back();
    key.when(!last, [&] {
      key("duration_s", phase.duration_s, above(0, kMany),
          "of the phase; the last one has none and does not end", kRequired);
    });
    if (last) key.refuse("duration_s", "the last phase does not end");
    phase.kind.describe(key);
    describe_elongation(key, phase);
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
  KEY(oscillation_lowest_hz, above(0, 1), "slower ones do not count");
  KEY(oscillation_part, from(0, 1),
      "of what the reference itself does meanwhile: a smaller error follows the reference");
  KEY(length_warning, from(0, 1),
      "a segment's measured length off arm.length_m by more, over that: the status reports it; 0: "
      "not checked");
  KEY(length_fault, from(0, 1), "the same: FAULT; 0: not checked");
  KEY(length_settling_s, above(0, 5), "for so long without interruption");
  KEY(wrong_model_settling_s, from(0, 60),
      "a parameter of the model observer at its limit for so long: FAULT; 0: not checked");
  KEY(contact_force_n, from(0, 1e3),
      "with estimation.observer: model, a sudden force on the arm above it is a contact; 0: not "
      "checked");
  KEY(contact_reaction, one_of({"hold", "vent", "yield"}),
      "to a contact: HOLD, VENT, or yield: ACTIVE without compensating it");
  KEY(contact_segment, from(0, kMaxSegments),
      "the force of the model observer acts on the end of this segment; 0: the tip");
  KEY(deadman_timeout_s, above(0, 2), "without a go on lcm.deadman_channel: VENT");
  KEY(law_validity_s, above(0, 0.5),
      "of control.law: external; an answer counts no longer than that after the state that it "
      "answers: then HOLD");
  KEY(law_vent_after_s, above(0, 0.5), "after that without an answer: VENT");
}

static void describe_network(Keys& key, MocapSourceSettings& mocap) {
  MocapNetworkSettings& it = mocap.network;
  const auto& kind = mocap.source.network;
  if (key.reading() && kind) {
    it.port = kind->port;
    it.version = kind->version;
  }
  key.when(kind.has_value(), [&] {
    KEY(host, from(7, 15), "IPv4 address of the server of natnet or qtm");
    KEY(port, from(1, 65535), "where it takes requests; left out: 1510 for natnet, 22223 for qtm");
    KEY(local_address, from(7, 15), "of the network card; 0.0.0.0: the system chooses");
    KEY(version, from(3, 8),
        "of the protocol: qtm is asked for it; of natnet the server decides (softarm-plant: this)");
  });
  key.when(kind && kind->multicast, [&] {
    KEY(multicast, from(0, 15), "group of the frames, in Motive 239.255.42.99; empty: unicast");
    KEY(data_port, from(1, 65535), "of the frames by multicast");
  });
}

static void describe_mocap(Keys& key, TransportSettings& transport) {
  const std::vector<double> z_up = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  const std::vector<double> y_up = {1, 0, 0, 0, 0, -1, 0, 1, 0};
  MocapSourceSettings& it = transport.mocap;
  describe_choice(
      key, "source", mocap_sources(), it.source,
      "softarm: mocap_frame_t; optitrack: optitrack_frame_t; rigid_transform: rigid_transform_t "
      "(Vicon), one channel a body; natnet: OptiTrack Motive; qtm: Qualisys");
  if (key.reading()) {
    it.quaternion = it.source.quaternion;
    it.unit = it.source.unit;
    transport.lcm.mocap_channel = it.source.channel;
  }
  KEY(unit, one_of({"m", "mm"}), "of the positions sent; left out: mm for qtm, else m");
  key.when(!it.source.network, [&] {
    KEY(quaternion, one_of({"xyzw", "wxyz"}), "order; left out: xyzw for optitrack, else wxyz");
  });
  KEY(axes, from(-1, 1).or_word("z_up", z_up).or_word("y_up", y_up),
      "of the sender's world: z_up; y_up (x, -z, y become our x, y, z); or the rotation to ours");
  describe_network(key, it);
}

static void describe_frame(Keys& key, MarkerFrameSettings& it, const MocapSourceKind& source) {
  key.when(source.named(), [&] {
    KEY(name, from(source.network ? 0 : 1, 40),
        "of the body: of rigid_transform's channel after lcm.mocap_channel and _; of natnet's or "
        "qtm's server (empty: the id counts)");
  });
  KEY(position_m, from(-10, 10), "of S_i in the body's own frame");
  KEY(rotation_rad, from(-kTwoPi, kTwoPi), "rotation vector of S_i in the body's own frame");
}

static void describe_bodies(Keys& key, BodySettings& it, const MocapSourceKind& source) {
  const Form id = from(0, 2147483647.0);
  const auto n = static_cast<std::size_t>(key.segments);
  if (it.segment_ids.empty()) {
    it.segment_ids.resize(n);
    std::iota(it.segment_ids.begin(), it.segment_ids.end(), 1);
  }
  if (it.segment_marker_frames.empty()) {
    it.segment_marker_frames.resize(n);
    if (source.channel_per_body) it.base_marker_frame.name = "base";
    for (std::size_t i = 0; i < n && source.channel_per_body; ++i)
      it.segment_marker_frames[i].name = "segment_" + std::to_string(i + 1);
  }
  KEY(base_id, id.or_word("fixed", -1), "body of the base, or fixed: arm.base holds");
  KEY(segment_ids, id.each(),
      "bodies of the segments' ends, base to tip (rigid_transform: names instead; qtm: the place "
      "in its list, from 1); left out: 1, 2, ...");
  key.section({"base_plate", "S_0 on the body of the base; softarm calibrate finds it"},
              [&] { describe_frame(key, it.base_marker_frame, source); });
  key.one_or_each({"segment_plates", "S_i on the segments' bodies, of all or a list; likewise"},
                  it.segment_marker_frames,
                  [&](auto& frame) { describe_frame(key, frame, source); });
}

static void describe(Keys& key, RealtimeSettings& it) {
  KEY(fifo, "SCHED_FIFO for the tick");
  KEY(priority, from(1, 99), "of SCHED_FIFO");
  KEY(cpu, from(0, 1023).or_word("any", -1), "the tick's own CPU, or any");
  KEY(lock_memory, "mlockall");
}

constinit const std::array<ChannelKey, 15> kChannelKeys = {{
    {"mocap_channel", &LcmSettings::mocap_channel, 1,
     "frames; left out: OPTITRACK_FRAMES for optitrack; VICON for rigid_transform, where it is "
     "what the bodies' channels begin with"},
    {"command_channel", &LcmSettings::command_channel, 1, "pressure commands"},
    {"measurement_channel", &LcmSettings::measurement_channel, 1, "measured pressures"},
    {"reference_channel", &LcmSettings::reference_channel, 1, "live references"},
    {"operator_channel", &LcmSettings::operator_channel, 1, "operator's commands"},
    {"status_channel", &LcmSettings::status_channel, 1, "controller status"},
    {"timing_channel", &LcmSettings::timing_channel, 1, "timing histograms"},
    {"observer_channel", &LcmSettings::observer_channel, 1,
     "what the model observer found, where there is one"},
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
  key.section({"bodies", "which bodies of a frame carry the base and the segments' ends"},
              [&] { describe_bodies(key, transport.bodies, transport.mocap.source); });
  KEY(realtime, "scheduling and memory of the daemon");
  key.section({"lcm", "channels, distinct where two arms share a machine"},
              [&] { describe_lcm(key, transport.lcm, it.safety); });
}

}  // namespace softarm
