// The declarations of the simulated arm.
#include "config/describe.hpp"

namespace softarm {

/// Factors on the controller's model, applied before absolute values override it.
static void describe_mismatch(Keys& key, PlantSettings& it) {
  const auto factor = [&](const char* name, const char* doc, const auto& apply) {
    std::vector<double> values(it.arm.segments.size(), 1.0);
    key(name, values, above(0, 100).one_or_each(), doc);
    for (std::size_t i = 0; i < values.size(); ++i) apply(i, values[i]);
  };
  auto& segments = it.arm.segments;
  factor("stiffness_factor", "of all segments, or a list",
         [&](std::size_t i, double f) { segments[i].stiffness_nm_per_rad *= f; });
  factor("damping_factor", "the same",
         [&](std::size_t i, double f) { segments[i].damping_nms_per_rad *= f; });
  factor("mass_factor", "the same", [&](std::size_t i, double f) { segments[i].mass_kg *= f; });
  factor("gain_factor", "of the chambers of all segments, or a list", [&](std::size_t i, double f) {
    for (Chamber& chamber : it.actuation.segments[i]) chamber.gain_nm_per_bar *= f;
  });
}

static void describe(Keys& key, MocapSettings& it) {
  KEY(rate_hz, above(0, 1e4), "frames a second");
  KEY(latency_s, from(0, 1), "from capture to arrival");
  KEY(position_noise_m, from(0, 1), "standard deviation an axis of every body");
  KEY(orientation_noise_rad, from(0, 1), "the same, of its rotation vector");
  KEY(position_resolution_m, from(0, 1), "positions are rounded to its multiples; 0: exact");
  KEY(dropout_probability, from(0, 1), "of a whole frame, independent from frame to frame");
  KEY(noise_on_base, "the base is measured with noise too");
}

static void describe(Keys& key, ValveSettings& it) {
  KEY(lag_s, from(0, 10), "time constant; 0: the command is the pressure");
  KEY(vent_lag_s, from(0, 10), "the same where a pressure falls; 0: lag_s");
  KEY(supply_pressure_bar, above(0, 1e4), "highest; left out: actuation.max_pressure_bar");
  KEY(dead_time_s, from(0, 10), "from a command's arrival until the valves begin to act");
  KEY(slew_bar_per_s, from(0, 1e9), "largest rate of a real pressure; 0: no limit");
  KEY(resolution_bar, from(0, 100), "set points are rounded to its multiples; 0: exact");
  KEY(play_bar, from(0, 100), "half the backlash between set point and pressure");
  KEY(dead_band_bar, from(0, 100), "set points that move the valve by less do nothing");
  KEY(supply_sag_s, from(0, 100),
      "the common supply falls by this times the sum of rates of rising pressures; needs lag_s");
}

static void describe(Keys& key, MaterialSettings& it) {
  KEY(hysteresis, from(0, 1), "part of every pressure that acts through play operators");
  KEY(play_bar, from(0, 100).list(), "half widths of these operators, in equal shares");
  KEY(cubic_per_rad2, from(0, 100), "K u becomes K u (1 + cubic |u|^2)");
  KEY(stiffening_per_bar, from(0, 100),
      "K becomes K (1 + stiffening p), p the sum over the segment's chambers");
  KEY(remanence, from(0, 100),
      "a Maxwell element beside K, in parts of K: bent, the arm stays bent");
  KEY(remanence_s, from(1e-3, 1e6), "time constant of its relaxation");
  KEY(remanence_2, from(0, 100), "a second Maxwell element, of another time");
  KEY(remanence_2_s, from(1e-3, 1e6), "time constant of the second");
  KEY(axial_remanence, from(0, 100),
      "the first one beside the axial stiffness of an arm that stretches, in parts of that");
  KEY(axial_remanence_2, from(0, 100), "the second one, likewise");
  KEY(bouc_wen, from(0, 100),
      "hysteresis of the moment by Bouc and Wen beside K, in parts of K: bouc_wen K z");
  KEY(bouc_wen_rad, above(0, kTwoPi), "z follows the bend until it saturates at this");
  KEY(bouc_wen_exponent, from(1, 20), "the larger, the sharper the knee");
  KEY(bouc_wen_shape, from(0.5, 1), "beta / (beta + gamma); 1/2: straight where it unloads");
}

static void describe(Keys& key, ExternalLoad& it) {
  KEY(segment, from(0, kMaxSegments), "it acts on the end of this segment; 0: the tip");
  KEY(force_n, from(-1e6, 1e6), "world frame");
  KEY(moment_nm, from(-1e6, 1e6), "world frame");
  KEY(shape, one_of({"constant", "half_sine"}),
      "constant, or a blow: half a sine over the duration");
  KEY(start_s, from(0, kMany), "when it begins");
  KEY(duration_s, from(0, kMany), "0: unlimited (a constant load only)");
}

static void describe(Keys& key, BaseMotion& it) {
  KEY(amplitude_m, from(-10, 10), "world frame");
  KEY(frequency_hz, from(0, 1000), "of the sine");
  KEY(phase_rad, from(-100, 100), "at t = 0");
}

/// What the world does to the arm.
static void describe_world(Keys& key, PlantSettings& it) {
  KEY(tip_force_n, from(-1e4, 1e4), "constant external force at the tip, world frame");
  if (key.reading() || !it.loads.empty()) {
    key.list({"loads", "external forces and moments on the segments' ends; none if left out"},
             it.loads, [&](ExternalLoad& load) { describe(key, load); });
  }
  LIST(payload_kg, key.segments, from(0, 100).one_or_each(),
       "masses on the segments' ends, of all or a list");
  KEY(base_motion, "the base moves along a sine, without turning");
}

static void describe_integrator(Keys& key, PlantSettings& it) {
  key("integrator", it.method, one_of({"sdirk2", "cash4", "sdirk4", "erk", "cvode_bdf"}),
      "method of SUNDIALS: one-step and implicit (sdirk2, cash4, sdirk4) or explicit (erk), "
      "multistep (cvode_bdf)");
  if (key.reading() && it.method != IntegratorMethod::sdirk2) {
    // Another method is chosen for its accuracy.
    it.relative_tolerance = 1e-6;
    it.absolute_tolerance = 1e-8;
    it.max_step_s = 0.0;
  }
  KEY(relative_tolerance, from(1e-13, 1e-2),
      "of the integrator; left out: 1e-3, or 1e-6 where it is not sdirk2");
  KEY(absolute_tolerance, from(1e-15, 1e-2),
      "of the integrator, for u; 1000 times that for u' in rad/s; left out: 1e-4, or 1e-8 where it "
      "is not sdirk2");
  KEY(max_step_s, from(0, 1),
      "longest step, 0: as the tolerances allow; left out: 1 ms, or 0 where the integrator is not "
      "sdirk2");
}

void describe_plant(Keys& key, Experiment& experiment) {
  PlantSettings& it = experiment.plant;
  if (key.reading()) {
    it.arm = experiment.arm;
    it.actuation = experiment.actuation;
    it.valves.supply_pressure_bar = experiment.actuation.max_pressure_bar;
    it.seed = experiment.seed;
  }
  describe_kind(key, "kind", plant_kinds(), it.kind,
                "pcc: the model; refined: several constant-curvature pieces a segment; links: "
                "rigid links, the paper's section VI",
                "for the kind of this name");
  constexpr auto kOptional = Presence::optional;
  key.section({"mismatch", "factors on the controller's model", kOptional, SectionKind::input_only},
              [&] { describe_mismatch(key, it); });
  key.section(
      {"arm", "keys of `arm` that differ here (not segments)", kOptional, SectionKind::hint},
      [&] { describe_arm(key, it.arm, kOptional); });
  key.section({"actuation", "keys of `actuation` that differ here", kOptional, SectionKind::hint},
              [&] { describe_actuation(key, it.actuation, kOptional); });
  KEY(valves, "between commanded and real pressure (or torque, then in N m)");
  KEY(material, "how the body differs from a linear spring and damper");
  LIST(cross_nm_per_bar, 2 * key.segments * chamber_count(it.actuation),
       from(-1e4, 1e4).one_or_each(),
       "of every chamber in turn, 2n numbers: generalized force in u on all segments beside its "
       "own");
  KEY(mocap, "simulated motion capture");
  key.section({"initial", "where the arm starts, at rest"}, [&] {
    std::vector<double> u(it.initial_u_rad.begin(), it.initial_u_rad.end());
    describe_pose(key, u, kOptional);
    it.initial_u_rad = Eigen::Map<const Eigen::VectorXd>(u.data(), 2 * key.segments);
  });
  describe_world(key, it);
  describe_integrator(key, it);
}

}  // namespace softarm
