#include "softarm/simulation/arm_plant.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <stdexcept>
#include <string>
#include <vector>

#include "simulation/integrator.hpp"
#include "softarm/actuation/chamber_hysteresis.hpp"
#include "softarm/actuation/input_map.hpp"
#include "softarm/simulation/plant_system.hpp"

namespace softarm {
namespace {

/// What a material remembers, and what a supply gives, is updated so often; relaxation takes seconds.
constexpr double kMemoryStep_s = 1e-3;

void expect(bool holds, const std::string& expected, const std::string& got) {
  if (!holds) {
    throw std::invalid_argument("plant: expected " + expected + ", got " + got);
  }
}

const PlantSettings& checked(const PlantSettings& settings) {
  const int n = settings.arm.size();
  expect(n >= 1 && n <= kMaxSegments, "1 to " + std::to_string(kMaxSegments) + " segments",
         std::to_string(n));
  expect(static_cast<int>(settings.actuation.segments.size()) == n,
         "chambers for " + std::to_string(n) + " segments",
         std::to_string(settings.actuation.segments.size()));
  expect(settings.initial_u_rad.size() == 0 || settings.initial_u_rad.size() == 2 * n,
         std::to_string(2 * n) + " numbers in initial_u",
         std::to_string(settings.initial_u_rad.size()));
  expect(settings.initial_u_rad.allFinite(), "finite numbers in initial_u", "others");
  expect(settings.tip_force_n.allFinite(), "a finite tip force", "another");
  expect(settings.payload_kg.empty() || static_cast<int>(settings.payload_kg.size()) == n,
         std::to_string(n) + " payloads", std::to_string(settings.payload_kg.size()));
  for (const double payload : settings.payload_kg) {
    expect(std::isfinite(payload) && payload >= 0.0, "payloads >= 0 kg", std::to_string(payload));
  }
  const MaterialSettings& material = settings.material;
  expect(material.hysteresis >= 0.0 && material.hysteresis <= 1.0, "a part in material.hysteresis",
         std::to_string(material.hysteresis));
  for (const double width : material.play_bar)
    expect(std::isfinite(width) && width >= 0.0, "material.play_bar >= 0", std::to_string(width));
  for (const double term :
       {material.cubic_per_rad2, material.stiffening_per_bar, material.remanence,
        material.remanence_2, material.axial_remanence, material.axial_remanence_2})
    expect(std::isfinite(term) && term >= 0.0, "terms of material >= 0", std::to_string(term));
  expect(!material.relaxes() || (material.remanence_s > 0.0 && material.remanence_2_s > 0.0),
         "times of remanence > 0 s in material", "others");
  expect(std::isfinite(material.bouc_wen) && material.bouc_wen >= 0.0, "material.bouc_wen >= 0",
         std::to_string(material.bouc_wen));
  expect(material.bouc_wen == 0.0 ||
             (material.bouc_wen_rad > 0.0 && material.bouc_wen_exponent >= 1.0 &&
              material.bouc_wen_shape >= 0.5 && material.bouc_wen_shape <= 1.0),
         "a limit > 0, an exponent >= 1 and a shape in [1/2, 1] of material.bouc_wen", "others");
  const std::size_t forces = 2 * settings.arm.segments.size() *
                             static_cast<std::size_t>(chamber_count(settings.actuation));
  expect(!settings.crosses() || settings.cross_nm_per_bar.size() == forces,
         std::to_string(forces) + " numbers in cross_nm_per_bar",
         std::to_string(settings.cross_nm_per_bar.size()));
  expect(settings.arm.gravity_mps2.allFinite(), "finite gravity", "another");
  for (const SegmentParameters& segment : settings.arm.segments) {
    expect(std::isfinite(segment.length_m) && segment.length_m > 0.0, "lengths > 0 m",
           std::to_string(segment.length_m));
    expect(std::isfinite(segment.mass_kg) && segment.mass_kg > 0.0, "masses > 0 kg",
           std::to_string(segment.mass_kg));
    expect(std::isfinite(segment.stiffness_nm_per_rad) && segment.stiffness_nm_per_rad >= 0.0,
           "stiffnesses >= 0 N m/rad", std::to_string(segment.stiffness_nm_per_rad));
    expect(std::isfinite(segment.radius_m) && segment.radius_m >= 0.0, "radii >= 0 m",
           std::to_string(segment.radius_m));
    expect(std::isfinite(segment.damping_nms_per_rad) && segment.damping_nms_per_rad >= 0.0,
           "damping >= 0 N m s/rad", std::to_string(segment.damping_nms_per_rad));
    expect(std::isfinite(segment.axial_stiffness_n_per_m) && segment.axial_stiffness_n_per_m >= 0.0,
           "axial stiffnesses >= 0 N/m", std::to_string(segment.axial_stiffness_n_per_m));
    expect(std::isfinite(segment.axial_damping_ns_per_m) && segment.axial_damping_ns_per_m >= 0.0,
           "axial damping >= 0 N s/m", std::to_string(segment.axial_damping_ns_per_m));
  }
  expect(!settings.arm.extensible || settings.arm.actuation == ActuationModel::chamber,
         "chamber for the actuation_model of an extensible arm", "couple");
  for (const auto& segment : settings.actuation.segments) {
    expect(settings.actuation.kind != ActuationKind::torque || segment.size() == 2,
           "two moments a segment", std::to_string(segment.size()));
    for (const Chamber& chamber : segment) {
      expect(std::isfinite(chamber.angle_rad) && std::isfinite(chamber.gain_nm_per_bar),
             "finite chamber angles and gains", "others");
      expect(chamber.offset_m > 0.0, "offsets > 0 m", std::to_string(chamber.offset_m));
    }
  }
  return settings;
}

/// From pressures to generalized forces, with what chambers do to other segments.
Eigen::MatrixXd forces_of_chambers(const PlantSettings& settings) {
  Eigen::MatrixXd map = input_map(settings.actuation, settings.arm.extensible);
  if (!settings.crosses()) return map;
  const int n = settings.arm.size(), width = settings.arm.segment_dof();
  const Eigen::Map<const Eigen::MatrixXd> cross(settings.cross_nm_per_bar.data(), 2 * n,
                                                map.cols());
  for (int i = 0; i < n; ++i) map.middleRows<2>(width * i) += cross.middleRows<2>(2 * i);
  return map;
}

IntegratorSettings integrator_settings(const PlantSettings& settings) {
  return {.method = settings.method,
          .relative_tolerance = settings.relative_tolerance,
          .absolute_tolerance = settings.absolute_tolerance,
          .absolute_tolerance_velocity = kVelocityTolerance * settings.absolute_tolerance,
          .max_step_s = settings.max_step_s,
          .account_energy = settings.account_energy};
}

}  // namespace

struct ArmPlant::Implementation {
  explicit Implementation(const PlantSettings& settings)
      : arm(checked(settings).arm),
        lag_s(settings.valves.lag_s),
        dead_time_s(settings.valves.dead_time_s),
        valves(settings.valves, chamber_count(settings.actuation),
               settings.actuation.kind == ActuationKind::torque),
        hysteresis(settings.material.hysteresis, settings.material.play_bar, valves.size()),
        follows_valves(!valves.exponential() || hysteresis.active() ||
                       settings.material.stiffening_per_bar != 0.0),
        map(forces_of_chambers(settings)),
        system(settings.kind.make(settings)),
        integrator(make_integrator(*system, integrator_settings(settings))),
        present_nm(Eigen::VectorXd::Zero(arm.dof())),
        target_nm(Eigen::VectorXd::Zero(arm.dof())),
        driven_nm(Eigen::VectorXd::Zero(arm.dof())),
        ends(static_cast<std::size_t>(arm.size())) {
    Eigen::VectorXd u = Eigen::VectorXd::Zero(2 * arm.size());
    if (settings.initial_u_rad.size() > 0) {
      u = settings.initial_u_rad;
    }
    drive();
    Eigen::VectorXd x(system->size());
    system->spread(u, x);
    integrator->reset(0.0, x, Eigen::VectorXd::Zero(x.size()));
  }

  /// Passes what the valves will do from now on to the equation of motion.
  void drive() {
    if (follows_valves) {
      system->input().follow(integrator->time_s(), valves, hysteresis, map);
    } else {
      present_nm.noalias() = map * valves.pressures_bar();
      target_nm.noalias() = map * valves.commanded_bar();
      system->drive(integrator->time_s(), present_nm, target_nm, lag_s);
      if (lag_s == 0.0 && target_nm != driven_nm) {
        jumped = true;
        driven_nm = target_nm;
      }
    }
    if (jumped) integrator->input_jumped();
    jumped = false;
  }

  /// Lets happen what is due: commands after their dead time, loads that begin or end.
  void meet_events() {
    const double now = integrator->time_s();
    while (!pending.empty() && pending.front().due_s <= now) {
      valves.command(pending.front().command_bar);
      pending.pop_front();
    }
    jumped |= system->external_loads().enter(now);
  }

  Eigen::Vector3d displacement_m() const {
    return system->external_loads().base_displacement_m(integrator->time_s());
  }

  double next_event_s() const {
    const double load_s = system->external_loads().until(integrator->time_s());
    return pending.empty() ? load_s : std::min(load_s, pending.front().due_s);
  }

  struct PendingCommand {
    double due_s;
    std::vector<double> command_bar;
  };

  ArmParameters arm;
  double lag_s;
  double dead_time_s;
  Valves valves;
  ChamberHysteresis hysteresis;
  bool follows_valves;  // the force is not one exponential
  Eigen::MatrixXd map;
  std::unique_ptr<PlantSystem> system;
  std::unique_ptr<Integrator> integrator;
  Eigen::VectorXd present_nm, target_nm;
  Eigen::VectorXd driven_nm;  // the torque of the last call without a lag
  bool jumped = false;        // since the last input_jumped()
  std::deque<PendingCommand> pending;
  mutable std::vector<Eigen::Isometry3d> ends;
};

ArmPlant::ArmPlant(const PlantSettings& settings)
    : implementation_(std::make_unique<Implementation>(settings)) {}
ArmPlant::~ArmPlant() = default;
ArmPlant::ArmPlant(ArmPlant&&) noexcept = default;
ArmPlant& ArmPlant::operator=(ArmPlant&&) noexcept = default;

int ArmPlant::dof() const noexcept { return implementation_->system->size(); }
int ArmPlant::segments() const noexcept { return implementation_->arm.size(); }
int ArmPlant::chambers() const noexcept { return implementation_->valves.size(); }

void ArmPlant::command(std::span<const double> command_bar) {
  Implementation& self = *implementation_;
  if (self.dead_time_s > 0.0) {
    self.pending.push_back(
        {self.integrator->time_s() + self.dead_time_s, {command_bar.begin(), command_bar.end()}});
    return;
  }
  self.valves.command(command_bar);
  self.drive();
}

void ArmPlant::advance(double t_end_s) {
  Implementation& self = *implementation_;
  while (t_end_s > self.integrator->time_s()) {
    const double from_s = self.integrator->time_s();
    double to_s = std::min(t_end_s, self.next_event_s());
    if (self.system->remembers() || self.valves.sags())
      to_s = std::min(to_s, from_s + kMemoryStep_s);
    self.integrator->advance(to_s);
    self.valves.advance(to_s - from_s);
    if (self.hysteresis.active()) self.hysteresis.remember(self.valves.pressures_bar());
    if (self.system->remembers()) self.system->remember(to_s - from_s, self.integrator->x());
    self.meet_events();
    self.drive();
  }
}

void ArmPlant::advance(double t_end_s, std::span<const double> command_bar) {
  command(command_bar);
  advance(t_end_s);
}

void ArmPlant::reset(ConstVectorRef u_rad, ConstVectorRef velocity_radps,
                     std::span<const double> pressure_bar) {
  Implementation& self = *implementation_;
  const int dof = 2 * self.arm.size();
  expect(u_rad.size() == dof && velocity_radps.size() == dof,
         std::to_string(dof) + " numbers in u and velocity",
         std::to_string(u_rad.size()) + " and " + std::to_string(velocity_radps.size()));
  expect(static_cast<int>(pressure_bar.size()) == chambers(),
         std::to_string(chambers()) + " pressures", std::to_string(pressure_bar.size()));
  expect(u_rad.allFinite() && velocity_radps.allFinite(), "a finite state", "another");
  self.pending.clear();
  self.valves.reset(pressure_bar);
  self.hysteresis.remember(self.valves.pressures_bar());
  self.drive();
  Eigen::VectorXd x(self.system->size());
  Eigen::VectorXd v(self.system->size());
  self.system->spread(u_rad, x);
  self.system->spread(velocity_radps, v);
  self.integrator->reset(self.integrator->time_s(), x, v);
}

double ArmPlant::time_s() const noexcept { return implementation_->integrator->time_s(); }
Eigen::VectorXd ArmPlant::coordinates() const noexcept { return implementation_->integrator->x(); }
Eigen::VectorXd ArmPlant::coordinate_rates() const noexcept {
  return implementation_->integrator->v();
}

void ArmPlant::curvature(SegmentVector& u_rad, SegmentVector& velocity_radps) const noexcept {
  const Implementation& self = *implementation_;
  u_rad.resize(2 * self.arm.size());
  velocity_radps.resize(2 * self.arm.size());
  self.system->curvature(self.integrator->x(), self.integrator->v(), u_rad, velocity_radps);
}

SegmentVector ArmPlant::u_rad() const noexcept {
  SegmentVector u, velocity;
  curvature(u, velocity);
  return u;
}

SegmentVector ArmPlant::velocity_radps() const noexcept {
  SegmentVector u, velocity;
  curvature(u, velocity);
  return velocity;
}

SegmentScalars ArmPlant::elongation_m() const noexcept {
  return implementation_->system->elongation_m(implementation_->integrator->x());
}
SegmentScalars ArmPlant::elongation_rate_mps() const noexcept {
  return implementation_->system->elongation_m(implementation_->integrator->v());
}

const Eigen::VectorXd& ArmPlant::pressures_bar() const noexcept {
  return implementation_->valves.pressures_bar();
}
const Eigen::VectorXd& ArmPlant::commanded_bar() const noexcept {
  return implementation_->valves.commanded_bar();
}

Eigen::Isometry3d ArmPlant::base() const noexcept {
  Eigen::Isometry3d base = Eigen::Isometry3d::Identity();
  base.linear() = implementation_->arm.base_rotation;
  base.translation() = implementation_->arm.base_position_m + implementation_->displacement_m();
  return base;
}

void ArmPlant::segment_ends(std::span<Eigen::Isometry3d> segment_ends) const noexcept {
  implementation_->system->segment_ends(implementation_->integrator->x(), segment_ends);
  if (implementation_->system->external_loads().base_moves()) {
    const Eigen::Vector3d displacement = implementation_->displacement_m();
    for (Eigen::Isometry3d& end : segment_ends) end.translation() += displacement;
  }
}

Eigen::Vector3d ArmPlant::tip_m() const noexcept {
  segment_ends(implementation_->ends);
  return implementation_->ends.back().translation();
}

PlantEnergies ArmPlant::energies() const noexcept {
  const Implementation& self = *implementation_;
  return {.kinetic = self.system->kinetic_energy_j(self.integrator->x(), self.integrator->v()),
          .potential = self.system->potential_energy_j(self.integrator->x()),
          .supplied = self.integrator->supplied_j(),
          .dissipated = self.integrator->dissipated_j()};
}

IntegratorCounters ArmPlant::counters() const noexcept {
  return implementation_->integrator->counters();
}

}  // namespace softarm
