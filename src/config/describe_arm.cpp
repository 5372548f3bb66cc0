// The keys of the arm and its chambers, of sensing and control, and the experiment as a whole.
#include <algorithm>
#include <numeric>

#include "config/describe.hpp"
#include "softarm/control/control_laws.hpp"

namespace softarm {

/// Which segments stretch: one flag for all, or 1 or 0 for every segment.
static void describe_stretch(Keys& key, ArmParameters& it) {
  const auto n = static_cast<std::size_t>(it.size());
  std::vector<int> stretches;
  for (const auto& segment : it.segments) {
    stretches.push_back(it.extensible && !segment.constant_length ? 1 : 0);
  }
  const Form flags = from(0, 1)
                         .one_or_each()
                         .or_word("false", std::vector(n, 0.0))
                         .or_word("true", std::vector(n, 1.0));
  key("extensible", stretches, flags,
      "whether segments stretch: then a segment's state is [u_x, u_y, e]; or 1 or 0 for every "
      "segment");
  it.extensible = std::any_of(stretches.begin(), stretches.end(), [](int s) { return s == 1; });
  for (std::size_t i = 0; i < n; ++i) {
    it.segments[i].constant_length = it.extensible && stretches[i] == 0;
  }
}

void describe_arm(Keys& key, ArmParameters& it, Presence presence) {
  const auto each = [&](const char* name, double SegmentParameters::*member, const Form& range,
                        const char* doc, Presence needed) {
    std::vector<double> values;
    for (const auto& segment : it.segments) values.push_back(segment.*member);
    key(name, values, range.one_or_each(), doc, needed);
    for (std::size_t i = 0; i < values.size(); ++i) it.segments[i].*member = values[i];
  };
  using Segment = SegmentParameters;
  each("length_m", &Segment::length_m, above(0, 10), "of all segments, or a list", presence);
  each("mass_kg", &Segment::mass_kg, above(0, 100), "of all segments, or a list", presence);
  each("stiffness_nm_per_rad", &Segment::stiffness_nm_per_rad, above(0, 1e4),
       "bending stiffness k of (14)", presence);
  each("damping_nms_per_rad", &Segment::damping_nms_per_rad, from(0, 1e3),
       "bending damping beta of (14)", presence);
  each("radius_m", &Segment::radius_m, from(0, 1),
       "of the round cross-section, for its rotary inertia; 0: left out, as in the paper",
       Presence::optional);
  describe_stretch(key, it);
  each("axial_stiffness_n_per_m", &Segment::axial_stiffness_n_per_m, from(0, 1e7),
       "k_a of segments that stretch; of a solid rod 4 k over radius squared", Presence::optional);
  each("axial_damping_ns_per_m", &Segment::axial_damping_ns_per_m, from(0, 1e6),
       "beta_a of segments that stretch; beta_a / k_a = beta / k where the section is homogeneous",
       Presence::optional);
  key("mass_model", it.mass, one_of({"point", "distributed"}),
      "point: the paper's masses at the centres of mass; distributed: along the arc");
  key("actuation_model", it.actuation, one_of({"chamber", "couple"}),
      "chamber: body-following moments of chambers and tendons; couple: the paper's (15)");
  key.section({"base", "where the arm is mounted"}, [&] {
    key("position_m", it.base_position_m, from(-1e3, 1e3), "origin of frame S_0 in the world");
    key("rotation", it.base_rotation, base_rotation(),
        "of S_0 in the world, whose +z the straight arm points along: hanging diag(1, -1, -1), "
        "standing (identity), or a 3 x 3 matrix");
  });
  KEY(gravity_mps2, from(-100, 100), "in the world frame");
}

static void describe_chambers(Keys& key, std::vector<Chamber>& it, Presence presence) {
  std::vector<double> angles, gains, offsets;
  for (const Chamber& chamber : it) {
    angles.push_back(chamber.angle_rad);
    gains.push_back(chamber.gain_nm_per_bar);
    offsets.push_back(chamber.offset_m);
  }
  key("angle_rad", angles, from(-kTwoPi, kTwoPi).list(),
      "direction chi of every chamber about the segment's axis", presence);
  gains.resize(angles.size(), gains.empty() ? 0.0 : gains.front());
  key("gain_nm_per_bar", gains, above(0, kMany).one_or_each(),
      "bending moment a bar, of all or of every chamber", presence);
  offsets.resize(angles.size(), offsets.empty() ? Chamber{}.offset_m : offsets.front());
  key("offset_m", offsets, above(0, 1).one_or_each(),
      "of the chambers from the segment's axis; gain over offset is the effective area, which "
      "lengthens segments that stretch");
  it.resize(angles.size());
  for (std::size_t j = 0; j < angles.size(); ++j) it[j] = {angles[j], gains[j], offsets[j]};
}

/// What is named `_bar` counts N m.
static void describe_torque(Keys& key, ActuationSettings& it, bool chosen_before) {
  if (!chosen_before) {
    set_torque_actuation(it, key.segments, 100.0);
    it.slew_bar_per_s = 1e6;
    it.vent_bar_per_s = 200.0;
  }
  key("max_torque_nm", it.max_pressure_bar, above(0, 1e4), "about each axis of a segment");
  it.min_pressure_bar = -it.max_pressure_bar;
  key("slew_nm_per_s", it.slew_bar_per_s, above(0, 1e9), "largest rate of a commanded moment");
  key("vent_nm_per_s", it.vent_bar_per_s, above(0, 1e9), "rate of the ramp to zero, below 1 s");
}

void describe_actuation(Keys& key, ActuationSettings& it, Presence presence) {
  const bool torque_before = it.kind == ActuationKind::torque;
  KEY(kind, one_of({"chambers", "torque"}),
      "chambers: pressures; torque: tau_A itself, for simulated arms only, and all its keys are "
      "then max_torque_nm (left out: 100), slew_nm_per_s (1e6) and vent_nm_per_s (200)");
  const bool torque = it.kind == ActuationKind::torque;
  key.when(!torque, [&] {
    it.segments.resize(static_cast<std::size_t>(key.segments));
    key.one_or_each({"chambers", "of all segments, or a list of every segment's", presence},
                    it.segments, [&](auto& c) { describe_chambers(key, c, presence); });
    KEY(min_pressure_bar, from(0, 100), "lowest commanded pressure");
    KEY(max_pressure_bar, above(0, 100), "highest commanded pressure");
    KEY(bias_pressure_bar, from(0, 100), "where pressures rest that no torque asks to move");
    KEY(slew_bar_per_s, above(0, kMany), "largest rate of a commanded pressure");
    KEY(vent_bar_per_s, above(0, kMany), "rate of the ramp to zero, which takes less than 1 s");
    KEY(plane_rad, from(-kTwoPi, kTwoPi), "phi of the plane of a planar arm; left out: none");
  });
  key.when(torque, [&] { describe_torque(key, it, torque_before); });
}

static void describe(Keys& key, ModelObserverSettings& it) {
  KEY(learn_parameters, "stiffness, damping, gain and a horizontal load of every segment, on line");
  KEY(parameter_deviation, above(0, 1),
      "standard deviation of the parameters before anything was learnt, relative");
  KEY(payload_deviation, from(0, 10),
      "standard deviation of a mass at the tip before anything was learnt, over the arm's mass: "
      "stiffness, damping and gain of all segments are then likely to be wrong together");
  LIST(load, 2 * key.segments, from(-1, 1).one_or_pairs(),
       "horizontal load of every segment before anything was learnt, over its weight: [x, y] "
       "across gravity; --learned writes it");
  KEY(load_deviation, from(0, 1), "its standard deviation; left out: parameter_deviation");
  KEY(parameter_drift_per_sqrt_s, from(0, 1), "random walk of the parameters, relative");
  KEY(disturbance_drift_per_sqrt_s, above(0, 10),
      "random walk of the disturbance over the torque that bends a segment by 1 rad, at least");
  KEY(largest_disturbance_drift_per_sqrt_s, above(0, 10),
      "the same, at most: it grows while the disturbance is seen to move");
}

static void describe(Keys& key, EstimationSettings& it) {
  KEY(method, one_of({"pose", "orientation", "paper_eq20"}),
      "pose: position and orientation; orientation: inertial sensors; paper_eq20: the paper's "
      "(20), for comparison only");
  KEY(position_noise_m, above(0, 0.02), "standard deviation an axis of every measured body");
  KEY(orientation_noise_rad, above(0, 0.2), "the same, of its rotation vector");
  KEY(filter_bandwidth_radps, above(0, 1e5), "of the velocity filter on u");
  KEY(predicted_frames, from(0, 1000), "frames an occluded segment may be predicted for");
  KEY(observer, one_of({"kinematic", "model"}),
      "of u and u': kinematic (a filter on u alone) or model (a Kalman filter on (16), with a "
      "disturbance and parameters)");
  KEY(model_observer, "of observer: model");
  KEY(quaternion_tolerance, above(0, 0.1), "a frame with ||q| - 1| above it is rejected");
  KEY(length_tolerance, above(0, 1), "a frame with ||t| - chord| / L above it is rejected");
  KEY(torsion_tolerance_rad, above(0, 1.2),
      "a frame in which a segment is turned further about its own axis is rejected: a body "
      "recognised turned");
  KEY(max_speed_radps, above(0, 200), "a frame in which u jumps faster is rejected");
  KEY(stale_frames, from(0, 100),
      "a body that repeats its pose in so many frames while others move counts as not seen; 0: not "
      "checked");
}

static void describe(Keys& key, ControlTerms& it) {
  KEY(inertia, "B u''_ref");
  KEY(coriolis, "C(u, u') u'_ref");
  KEY(gravity, "G");
  KEY(stiffness, "K u_ref");
  KEY(damping, "D u'_ref");
}

static void describe(Keys& key, TaskSpaceSettings& it) {
  KEY(lambda_1ps, above(0, 1e3), "both poles of the tip's error are at -lambda");
  KEY(tip_bandwidth_radps, above(0, 1e4),
      "of the filter on measured tip minus reference: the only loop of the tip that is closed over "
      "the arm, so below its slowest mode");
  KEY(posture_rate_1ps, from(0, 100), "of drifting to less bend where the tip does not move");
  KEY(map_rate_1ps, from(0, 100),
      "of learning how that difference depends on the place; 0: not learnt");
}

static void describe(Keys& key, RepetitionSettings& it) {
  KEY(lead_s, from(0, 1),
      "what repeats is known so long before the observer has seen it: what it is late by, about "
      "0.1 s; 0: nothing is learnt, at no cost");
  KEY(period_s, above(0, 1e4), "left out: that of the reference");
}

static void describe(Keys& key, ControllerSettings& it) {
  describe_kind(key, "law", control_laws(), it.law,
                "curvature: (17); statics_pi: G and K u_ref with PI; external: another process "
                "answers law_state_t with law_command_t",
                "for the law of this name");
  const bool has_gains =
      it.law.get_if<CurvatureLaw>() != nullptr || it.law.get_if<StaticsPiLaw>() != nullptr;
  const Presence presence = has_gains ? kRequired : Presence::optional;
  for (auto* gains : {&it.kp, &it.kd, &it.ki})
    gains->resize(static_cast<std::size_t>(2 * key.segments), 0.0);
  const Form gains = from(0, 1e4).one_or_pairs();
  KEY(coordinates, one_of({"u", "polar"}), "of (17): u (smooth everywhere) or polar (the paper's)");
  KEY(terms, "of (17); one that is left out costs nothing");
  key("kp_nm_per_rad", it.kp, gains,
      "K_P: one for all, one a segment, or [x, y] a segment (polar: [phi, theta])", presence);
  key("kd_nms_per_rad", it.kd, from(0, 1e3).one_or_pairs(), "K_D, in the same forms");
  key("ki_nm_per_rad_s", it.ki, gains, "integral gain on u, in the same forms; not in the paper");
  for (auto* each : {&it.kp_axial, &it.kd_axial, &it.ki_axial})
    each->resize(static_cast<std::size_t>(key.segments), 0.0);
  key("kp_axial_n_per_m", it.kp_axial, from(0, 1e7).one_or_each(),
      "K_P along e of segments that stretch, of all or of every segment");
  key("kd_axial_ns_per_m", it.kd_axial, from(0, 1e6).one_or_each(), "K_D along e, likewise");
  key("ki_axial_n_per_m_s", it.ki_axial, from(0, 1e7).one_or_each(),
      "integral gain on e, likewise");
  KEY(disturbance, one_of({"cancel", "model_only", "none"}),
      "what the model observer found: cancel (parameters and disturbance), model_only (parameters; "
      "the arm stays soft), none");
  KEY(repetition,
      "of the disturbance along a periodic reference, learnt by its phase and cancelled ahead; "
      "with estimation.observer: model and disturbance: cancel");
  KEY(valve_lag_s, from(0, 2), "first-order lag inverted on what depends on the reference alone");
  key("delay_s", it.dead_time_s, from(0, 0.5),
      "dead time of valves and tubes, for the check of gains at load time");
  KEY(max_theta_rad, above(0, kTwoPi), "soft limit on theta of reference and arm");
  KEY(max_speed_radps, above(0, 100), "soft limit on |u'| of reference and arm, a segment");
  KEY(max_step_rad, above(0, kTwoPi), "a larger jump of a live reference is refused");
  KEY(blend_s, above(0, 1e3), "time in which a reference is joined from wherever the arm is");
  KEY(polar_theta_min_rad, above(0, 1), "bounds A^-1 and the phi error near theta = 0, if polar");
  KEY(task_space, "references of the tip, by (21)");
}

static void describe(Keys& key, RunSettings& it) {
  KEY(duration_s, above(0, kMany), "of `softarm run` and the demo, where none is asked for");
  KEY(tracking_from_s, from(0, kMany), "after ACTIVE; tracking errors count from here on");
  KEY(log_rate_hz, from(0, 1e4), "rows of log.csv, from which errors are taken; 0: every tick");
}

static void describe(Keys& key, ActuatorInverseSettings& it) {
  LIST(fill_lag_s, key.chambers, from(0, 100).one_or_each(),
       "of every chamber, where its pressure rises; what the inverse leaves is "
       "control.valve_lag_s; 0: that");
  LIST(vent_lag_s, key.chambers, from(0, 100).one_or_each(), "the same where it falls");
  KEY(hysteresis, from(0, 0.9),
      "part of every pressure that acts on the arm through play operators");
  KEY(play_bar, from(0, 100).list(), "half widths of these operators, in equal shares");
  KEY(learn_hysteresis,
      "their weights are learnt from what estimation.observer: model leaves over");
  KEY(stiffening_per_bar, from(0, 100),
      "k counts as k (1 + stiffening p), p the sum over the segment's chambers");
  KEY(slip_radius_rad, from(0, kTwoPi).list(),
      "bends at which springs beside k slip, as identification has them");
  KEY(slip_stiffness_nm_per_rad, from(0, 1e4).list(), "of these springs");
}

/// Terms that `softarm identify` writes for arms that lag, stretch and remember.
static void describe_memory(Keys& key, IdentificationSettings& it) {
  KEY(load_kg, from(0, 100), "a point mass at the tip, likewise");
  KEY(inertia, "false: without it, for motion so slow that it does not count");
  LIST(push_nm_per_bar, 2 * key.chambers, from(-1e4, 1e4).one_or_pairs(),
       "of every chamber, generalized force in u, in any direction; 0: as actuation has it");
  LIST(fill_lag_s, key.chambers, from(0, 100).one_or_each(),
       "of every chamber, where its pressure rises; 0: lag_s");
  LIST(vent_lag_s, key.chambers, from(0, 100).one_or_each(), "the same where it falls");
  LIST(saturation_1pbar, key.chambers, from(-100, 100).one_or_each(),
       "of every chamber, q: p counts as p (1 + q p)");
  KEY(stiffening_1pbar, from(-100, 100), "s: k counts as k (1 + s sum of the segment's pressures)");
  KEY(stiffening_by_length, from(-20, 20),
      "q: k counts as k (l / L)^q, with the l that pressures give by stretch_m_per_bar");
  LIST(cross_nm_per_bar, 2 * key.segments * key.chambers, from(-1e4, 1e4).one_or_each(),
       "of every chamber in turn, 2n numbers: force on all segments beside push_nm_per_bar");
  KEY(slip_radius_rad, from(0, kTwoPi).list(), "hysteresis: bends at which springs slip");
  KEY(slip_stiffness_nm_per_rad, from(0, 1e4).list(), "of these springs");
  KEY(remanence, from(0, 1), "share of the bend by which the rest follows it");
  KEY(remanence_s, above(0, 1e4), "time constant of that");
  KEY(remanence_2, from(0, 1), "the same with another time, from 0 at first");
  KEY(remanence_2_s, above(0, 1e4), "that time");
  LIST(remanent_u_rad, 2 * key.segments, from(-kTwoPi, kTwoPi).one_or_pairs(),
       "where the rest is at first, for that");
}

static void describe_stretch(Keys& key, IdentificationSettings& it) {
  LIST(stretch_m_per_bar, key.segments * key.chambers, from(-10, 10).one_or_each(),
       "of every chamber in turn, n numbers: by what it lengthens the segments; all 0: not known");
  LIST(stretch_length_m, key.segments, from(0, 1e3).one_or_each(),
       "of the segments without pressure, for that");
  LIST(stretch_fill_s, key.chambers, from(0, 100).one_or_each(),
       "lag of every chamber's stretch as it rises");
  LIST(stretch_vent_s, key.chambers, from(0, 100).one_or_each(), "and as it falls");
  LIST(stretch_saturation_1pbar, key.chambers, from(-100, 100).one_or_each(),
       "as saturation_1pbar");
  KEY(stretch_friction_m, from(0, 1), "half width of a play between pressure and length");
  KEY(stretch_remanence, from(0, 10), "as remanence");
  KEY(stretch_remanence_s, above(0, 1e4), "as remanence_s");
  KEY(stretch_remanence_2, from(0, 10), "as remanence_2");
  KEY(stretch_remanence_2_s, above(0, 1e4), "as remanence_2_s");
  KEY(stretch_set, from(0, 10), "part of the largest stretch by pressure so far that stays");
  KEY(stretch_by_bend_m_per_rad2, from(-10, 10), "what a bend u adds to a length, by |u|^2");
}

static void describe_identification(Keys& key, IdentificationSettings& it, MotionLimits& limits) {
  KEY(steps_bar, above(0, 100).list(), "pressures of the steps, on every side in turn");
  KEY(hold_s, from(0.1, 100), "from step to step");
  key("max_theta_rad", limits.max_theta_rad, above(0, kTwoPi),
      "a segment that bends farther ends the experiment");
  key("max_speed_radps", limits.max_speed_radps, above(0, 100),
      "a segment that moves faster ends the experiment");
  LIST(rest_u_rad, 2 * key.segments, from(-kTwoPi, kTwoPi).one_or_pairs(),
       "where the springs rest, to predict a recorded motion; the controller does not know it");
  KEY(cubic_nm_per_rad3, from(-1e4, 1e4), "likewise: adds c |u - rest|^2 (u - rest) to K u");
  KEY(lag_s, from(0, 100), "first order, from set point to pressure, likewise");
  key("delay_s", it.dead_time_s, from(-1, 100), "from set point to frame, likewise");
  describe_memory(key, it);
  describe_stretch(key, it);
}

static void describe_uncertainty(Keys& key, Experiment& experiment) {
  ArmUncertainty& it = experiment.uncertainty;
  KEY(parameters, from(0, 0.5), "of stiffness, damping, mass, length and gain, relative");
  if (key.reading()) {
    it.payload_kg = 0.0;
    for (const SegmentParameters& segment : experiment.arm.segments)
      it.payload_kg += 0.1 * segment.mass_kg;
  }
  KEY(payload_kg, from(0, 100), "at the tip, at most; left out: a tenth of the arm's mass");
}

void describe(Keys& key, Experiment& it) {
  KEY(name, from(1, 100), "of the experiment, for logs and plots", kRequired);
  KEY(seed, from(0, kLargestWhole), "of every random number of the simulated arm");
  key.section({"arm", "the arm as the controller models it", kRequired}, [&] {
    key.segments = std::max(1, it.arm.size());
    key("segments", key.segments, from(1, kMaxSegments), "how many", kRequired);
    it.arm.segments.resize(static_cast<std::size_t>(key.segments));
    describe_arm(key, it.arm, kRequired);
    key.section(
        {"uncertainty", "how far the arm may differ from what is configured, for the check"},
        [&] { describe_uncertainty(key, it); });
  });
  key.section({"actuation", "chambers and the limits of their valves", kRequired}, [&] {
    describe_actuation(key, it.actuation, kRequired);
    key.chambers = chamber_count(it.actuation);
    key.when(it.actuation.kind == ActuationKind::chambers, [&] {
      key("inverse", it.actuator_inverse,
          "what lies between set points and moments, inverted in the tick; all zero: nothing is, "
          "at no cost");
    });
  });
  KEY(estimation, "from motion-capture frames to u");
  key.section({"control", "the controller (17)", kRequired}, [&] { describe(key, it.control); });
  describe_reference(key, it.reference);
  key.section({"daemon", "rate, safety and connections of softarmd"},
              [&] { describe_daemon(key, it); });
  if (it.valves.order.empty()) {
    it.valves.order.resize(static_cast<std::size_t>(key.chambers));
    std::iota(it.valves.order.begin(), it.valves.order.end(), 0);
  }
  KEY(valves, "the valve terminal that softarm-valves drives");
  key.section({"plant", "the simulated arm; left out: the arm as the controller models it"},
              [&] { describe_plant(key, it); });
  KEY(run, "defaults of a simulated run");
  key.section({"identification", "the steps and the findings of `softarm identify`"},
              [&] { describe_identification(key, it.identification, it.motion_limits); });
}

}  // namespace softarm
