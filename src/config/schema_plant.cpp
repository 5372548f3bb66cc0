// The description of the simulated arm.
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
  visitor.number({"dropout_probability", "", "of a whole frame, independent from frame to frame",
                  from_to(0.0, 1.0)},
                 mocap.dropout_probability);
  visitor.flag({"noise_on_base", "", "the base is measured with noise too"}, mocap.noise_on_base);
}

void describe_kind(SchemaVisitor& visitor, PlantSettings& plant) {
  static const std::array<const char*, 3> kKinds = {"pcc", "refined", "links"};
  visitor.choice({"kind", "",
                  "pcc: the model; refined: several constant-curvature pieces a segment; links: "
                  "rigid links, the paper's section VI"},
                 kKinds, plant.kind);
  visitor.section({"refined", "", "for kind refined"}, SectionKind::plain, [&] {
    RefinedSettings& refined = plant.refined;
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
  });
  visitor.section({"links", "", "for kind links"}, SectionKind::plain, [&] {
    LinkSettings& links = plant.links;
    visitor.integer({"links_per_segment", "", "each with two crossed revolute joints at its start",
                     from_to(1, kMaxLinksPerSegment)},
                    links.links_per_segment);
    visitor.optional_number(
        {"joint_stiffness_nm_per_rad", "N m/rad",
         "of every joint about each axis; left out: k times links_per_segment", from_to(0.0, 1e6)},
        links.joint_stiffness_nm_per_rad);
    visitor.optional_number({"joint_damping_nms_per_rad", "N m s/rad",
                             "the same; left out: beta times links_per_segment", from_to(0.0, 1e6)},
                            links.joint_damping_nms_per_rad);
  });
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
                  SectionKind::plain, [&] {
                    visitor.number({"lag_s", "s", "time constant; 0: the command is the pressure",
                                    from_to(0.0, 10.0)},
                                   plant.valves.lag_s);
                    visitor.number({"supply_pressure_bar", "bar",
                                    "no pressure above it; left out: actuation.max_pressure_bar",
                                    above_to(0.0, 100.0)},
                                   plant.valves.supply_pressure_bar);
                  });
  visitor.section({"mocap", "", "simulated motion capture"}, SectionKind::plain,
                  [&] { describe_mocap(visitor, plant.mocap); });
  visitor.section({"initial", "", "where the arm starts, at rest"}, SectionKind::plain, [&] {
    std::vector<double> u(plant.initial_u_rad.data(),
                          plant.initial_u_rad.data() + plant.initial_u_rad.size());
    describe_pose(visitor, u, n, Presence::optional);
    plant.initial_u_rad = Eigen::Map<const Eigen::VectorXd>(u.data(), 2 * n);
  });
  std::vector<double> force(plant.tip_force_n.data(), plant.tip_force_n.data() + 3);
  visitor.numbers(
      {"tip_force_n", "N", "constant external force at the tip, world frame", from_to(-1e4, 1e4)},
      {Shape::Kind::list, 3}, force);
  plant.tip_force_n = Eigen::Map<const Eigen::Vector3d>(force.data());
  static const std::array<const char*, 3> kMethods = {"sdirk2", "cash4", "sdirk4"};
  visitor.choice({"integrator", "", "diagonally implicit Runge-Kutta method of SUNDIALS ARKODE"},
                 kMethods, plant.method);
  visitor.number({"relative_tolerance", "", "of the integrator", from_to(1e-13, 1e-2)},
                 plant.relative_tolerance);
  visitor.number(
      {"absolute_tolerance", "rad", "of the integrator, for u; 1000 times that for u' in rad/s",
       from_to(1e-15, 1e-2)},
      plant.absolute_tolerance);
}

}  // namespace softarm
