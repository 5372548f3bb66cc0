// The description of the simulated arm.
#include <algorithm>
#include <array>
#include <vector>

#include "config/schema.hpp"

namespace softarm {
namespace {

constexpr double kMany = 1e6;

/// Factors on what the controller believes, applied before absolute values override it.
void describe_mismatch(SchemaVisitor& visitor, PlantSettings& plant) {
  const int n = plant.arm.size();
  const auto factor = [&](const char* key, const char* doc, const auto& apply) {
    std::vector<double> values(static_cast<std::size_t>(n), 1.0);
    visitor.numbers({key, "", doc, above_to(0.0, 100.0)}, {Shape::Kind::scalar_or_list, n}, values);
    for (std::size_t i = 0; i < values.size(); ++i) apply(i, values[i]);
  };
  auto& segments = plant.arm.segments;
  factor("stiffness_factor", "of all segments, or a list",
         [&](std::size_t i, double f) { segments[i].stiffness_nm_per_rad *= f; });
  factor("damping_factor", "the same",
         [&](std::size_t i, double f) { segments[i].damping_nms_per_rad *= f; });
  factor("mass_factor", "the same", [&](std::size_t i, double f) { segments[i].mass_kg *= f; });
  factor("gain_factor", "of the chambers of all segments, or a list", [&](std::size_t i, double f) {
    for (Chamber& chamber : plant.actuation.segments[i]) chamber.gain_nm_per_bar *= f;
  });
}

void describe_mocap(SchemaVisitor& visitor, MocapSettings& mocap) {
  visitor.number({"rate_hz", "Hz", "frames a second", above_to(0.0, 1e4)}, mocap.rate_hz);
  visitor.number({"latency_s", "s", "from capture to arrival", from_to(0.0, 1.0)}, mocap.latency_s);
  visitor.number(
      {"position_noise_m", "m", "standard deviation an axis of every body", from_to(0.0, 1.0)},
      mocap.position_noise_m);
  visitor.number(
      {"orientation_noise_rad", "rad",
       "standard deviation of the rotation vector an axis of every body", from_to(0.0, 1.0)},
      mocap.orientation_noise_rad);
  visitor.number({"position_resolution_m", "m", "positions are rounded to its multiples; 0: exact",
                  from_to(0.0, 1.0)},
                 mocap.position_resolution_m);
  visitor.number({"dropout_probability", "", "of a whole frame, independent from frame to frame",
                  from_to(0.0, 1.0)},
                 mocap.dropout_probability);
  visitor.flag({"noise_on_base", "", "the base is measured with noise too"}, mocap.noise_on_base);
}

void describe_valves(SchemaVisitor& visitor, ValveSettings& valves) {
  visitor.number(
      {"lag_s", "s", "time constant; 0: the command is the pressure", from_to(0.0, 10.0)},
      valves.lag_s);
  visitor.number({"supply_pressure_bar", "bar",
                  "no pressure above it; left out: actuation.max_pressure_bar", above_to(0.0, 1e4)},
                 valves.supply_pressure_bar);
  visitor.number({"dead_time_s", "s", "from a command's arrival until the valves begin to act",
                  from_to(0.0, 10.0)},
                 valves.dead_time_s);
  visitor.number({"slew_bar_per_s", "bar/s", "largest rate of a real pressure; 0: no limit",
                  from_to(0.0, 1e9)},
                 valves.slew_bar_per_s);
  visitor.number({"resolution_bar", "bar", "set points are rounded to its multiples; 0: exact",
                  from_to(0.0, 100.0)},
                 valves.resolution_bar);
}

void describe_load(SchemaVisitor& visitor, ExternalLoad& load, int segments) {
  static const std::array<const char*, 2> kShapes = {"constant", "half_sine"};
  visitor.integer({"segment", "", "on whose end it acts; 0: the tip",
                   from_to(0, static_cast<double>(segments))},
                  load.segment);
  visitor.vector3({"force_n", "N", "world frame", from_to(-1e6, 1e6)}, load.force_n);
  visitor.vector3({"moment_nm", "N m", "world frame", from_to(-1e6, 1e6)}, load.moment_nm);
  visitor.choice({"shape", "", "constant, or a blow: half a sine over the duration"}, kShapes,
                 load.shape);
  visitor.number({"start_s", "s", "when it begins", from_to(0.0, kMany)}, load.start_s);
  visitor.number({"duration_s", "s", "0: for ever", from_to(0.0, kMany)}, load.duration_s);
}

/// What the world does to the arm.
void describe_world(SchemaVisitor& visitor, PlantSettings& plant) {
  const int n = plant.arm.size();
  visitor.vector3(
      {"tip_force_n", "N", "constant external force at the tip, world frame", from_to(-1e4, 1e4)},
      plant.tip_force_n);
  if (visitor.reading() || !plant.loads.empty()) {
    visitor.list(
        {"loads", "", "external forces and moments on the segments' ends; none if left out"},
        static_cast<int>(plant.loads.size()),
        [&](int size) { plant.loads.resize(static_cast<std::size_t>(size)); },
        [&](int i) { describe_load(visitor, plant.loads[static_cast<std::size_t>(i)], n); });
  }
  plant.payload_kg.resize(static_cast<std::size_t>(n), 0.0);
  visitor.numbers({"payload_kg", "kg", "point masses on the segments' ends, of all or a list",
                   from_to(0.0, 100.0)},
                  {Shape::Kind::scalar_or_list, n}, plant.payload_kg);
  visitor.section(
      {"base_motion", "", "the base is carried to and fro, without turning"}, SectionKind::plain,
      [&] {
        BaseMotion& motion = plant.base_motion;
        visitor.vector3({"amplitude_m", "m", "world frame", from_to(-10.0, 10.0)},
                        motion.amplitude_m);
        visitor.number({"frequency_hz", "Hz", "of the sine", from_to(0.0, 1000.0)},
                       motion.frequency_hz);
        visitor.number({"phase_rad", "rad", "at t = 0", from_to(-100.0, 100.0)}, motion.phase_rad);
      });
}

void describe(SchemaVisitor& visitor, RefinedSettings& refined) {
  visitor.integer({"pieces", "", "a segment", from_to(1, kMaxSegments)}, refined.pieces);
  const auto weights = [&](const char* key, const char* doc, std::vector<double>& values) {
    values.resize(static_cast<std::size_t>(refined.pieces), 1.0);
    visitor.numbers({key, "", doc, above_to(0.0, kMany)},
                    {Shape::Kind::scalar_or_list, refined.pieces}, values);
  };
  weights("length_weights", "of the pieces of a segment, base to tip; their ratios count",
          refined.length_weights);
  weights("mass_weights", "the same", refined.mass_weights);
  weights("rigidity_weights", "of E I, and of damping alike; the segment's k and beta stay",
          refined.rigidity_weights);
}

void describe(SchemaVisitor& visitor, LinkSettings& links) {
  visitor.integer({"links_per_segment", "", "each with two crossed revolute joints at its start",
                   from_to(1, kMaxLinksPerSegment)},
                  links.links_per_segment);
  static const std::array<const char*, 1> kJoints = {"crossed"};
  visitor.choice({"joints", "", "crossed: two angles, about x and y"}, kJoints, links.joints);
  visitor.optional_number(
      {"joint_stiffness_nm_per_rad", "N m/rad",
       "of every joint about each axis; left out: k times links_per_segment", from_to(0.0, 1e6)},
      links.joint_stiffness_nm_per_rad);
  visitor.optional_number({"joint_damping_nms_per_rad", "N m s/rad",
                           "the same; left out: beta times links_per_segment", from_to(0.0, 1e6)},
                          links.joint_damping_nms_per_rad);
}

/// The section of a kind, whichever is chosen.
template <class K>
void kind_section(SchemaVisitor& visitor, PlantKind& chosen, K settings, const char* doc) {
  if (const K* kind = chosen.get_if<K>()) settings = *kind;
  visitor.section({settings.name(), "", doc}, SectionKind::plain,
                  [&] { describe(visitor, settings); });
  if (chosen.get_if<K>() != nullptr) chosen = settings;
}

void describe_kind(SchemaVisitor& visitor, PlantSettings& plant) {
  const std::vector<PlantKind>& kinds = plant_kinds().all();
  std::vector<const char*> names;
  for (const PlantKind& kind : kinds) names.push_back(kind.name());
  const std::string before = plant.kind.name();
  int index = static_cast<int>(std::find(names.begin(), names.end(), before) - names.begin());
  visitor.choice({"kind", "",
                  "pcc: the model; refined: several constant-curvature pieces a segment; links: "
                  "rigid links, the paper's section VI"},
                 names, index);
  const PlantKind& chosen = kinds[static_cast<std::size_t>(index)];
  if (before != chosen.name()) plant.kind = chosen;
  kind_section(visitor, plant.kind, RefinedSettings{}, "for kind refined");
  kind_section(visitor, plant.kind, LinkSettings{}, "for kind links");
}

}  // namespace

ActuationKind describe_actuation_kind(SchemaVisitor& visitor, ActuationSettings& actuation,
                                      int segments) {
  static const std::array<const char*, 2> kKinds = {"chambers", "torque"};
  const ActuationKind before = actuation.kind;
  visitor.choice({"kind", "",
                  "chambers: pressures; torque: tau_A itself, for simulated arms only (then "
                  "max_torque_nm, slew_nm_per_s and vent_nm_per_s are all its keys)"},
                 kKinds, actuation.kind);
  if (actuation.kind != ActuationKind::torque) return actuation.kind;
  constexpr double kMaxTorque_nm = 100.0;
  constexpr double kSlew_nm_per_s = 1e6;
  constexpr double kVent_nm_per_s = 200.0;
  if (before != ActuationKind::torque) {
    set_torque_actuation(actuation, segments, kMaxTorque_nm);
    actuation.slew_bar_per_s = kSlew_nm_per_s;
    actuation.vent_bar_per_s = kVent_nm_per_s;
  }
  visitor.number(
      {"max_torque_nm", "N m", "largest moment about each axis of a segment", above_to(0.0, 1e4)},
      actuation.max_pressure_bar);
  actuation.min_pressure_bar = -actuation.max_pressure_bar;
  visitor.number(
      {"slew_nm_per_s", "N m/s", "largest rate of a commanded moment", above_to(0.0, 1e9)},
      actuation.slew_bar_per_s);
  visitor.number({"vent_nm_per_s", "N m/s", "rate of the ramp to zero; it takes less than 1 s",
                  above_to(0.0, 1e9)},
                 actuation.vent_bar_per_s);
  return actuation.kind;
}

void describe_plant(SchemaVisitor& visitor, Experiment& experiment) {
  PlantSettings& plant = experiment.plant;
  if (visitor.reading()) {
    plant.arm = experiment.arm;
    plant.actuation = experiment.actuation;
    plant.valves.supply_pressure_bar = experiment.actuation.max_pressure_bar;
    plant.seed = experiment.seed;
  }
  const int n = plant.arm.size();
  describe_kind(visitor, plant);
  visitor.section({"mismatch", "", "factors on what the controller believes"},
                  SectionKind::input_only, [&] { describe_mismatch(visitor, plant); });
  visitor.section({"arm", "", "keys of `arm` that differ here (not segments)"},
                  SectionKind::defaults_elsewhere, [&] { describe_arm(visitor, plant.arm); });
  visitor.section({"actuation", "", "keys of `actuation` that differ here"},
                  SectionKind::defaults_elsewhere,
                  [&] { describe_actuation(visitor, plant.actuation, n); });
  visitor.section({"valves", "", "between commanded and real pressure (or torque, then in N m)"},
                  SectionKind::plain, [&] { describe_valves(visitor, plant.valves); });
  visitor.section({"mocap", "", "simulated motion capture"}, SectionKind::plain,
                  [&] { describe_mocap(visitor, plant.mocap); });
  visitor.section({"initial", "", "where the arm starts, at rest"}, SectionKind::plain, [&] {
    std::vector<double> u(plant.initial_u_rad.data(),
                          plant.initial_u_rad.data() + plant.initial_u_rad.size());
    describe_pose(visitor, u, n, Presence::optional);
    plant.initial_u_rad = Eigen::Map<const Eigen::VectorXd>(u.data(), 2 * n);
  });
  describe_world(visitor, plant);
  static const std::array<const char*, 5> kMethods = {"sdirk2", "cash4", "sdirk4", "erk",
                                                      "cvode_bdf"};
  visitor.choice({"integrator", "",
                  "method of SUNDIALS: one-step and implicit (sdirk2, cash4, sdirk4) or explicit "
                  "(erk), multistep (cvode_bdf)"},
                 kMethods, plant.method);
  if (visitor.reading() && plant.method != IntegratorMethod::sdirk2) {
    // Whoever chooses another method wants its accuracy.
    plant.relative_tolerance = 1e-6;
    plant.absolute_tolerance = 1e-8;
    plant.max_step_s = 0.0;
  }
  visitor.number(
      {"relative_tolerance", "",
       "of the integrator; left out: 1e-3, or 1e-6 where it is not sdirk2", from_to(1e-13, 1e-2)},
      plant.relative_tolerance);
  visitor.number({"absolute_tolerance", "rad",
                  "of the integrator, for u; 1000 times that for u' in rad/s; left out: 1e-4, or "
                  "1e-8 where it is not sdirk2",
                  from_to(1e-15, 1e-2)},
                 plant.absolute_tolerance);
  visitor.number({"max_step_s", "s",
                  "longest step, 0: as the tolerances allow; left out: 1 ms, or 0 where the "
                  "integrator is not sdirk2",
                  from_to(0.0, 1.0)},
                 plant.max_step_s);
}

}  // namespace softarm
