// A plant and a reference kind that the library does not know, through public headers alone: added
// by name, then run in lock step. The plant has a closed form to be held against.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "softarm/control/reference_kinds.hpp"
#include "softarm/model/kinematics.hpp"
#include "softarm/simulation/lock_step.hpp"
#include "softarm/simulation/plant_kinds.hpp"

namespace softarm {
namespace {

/// Curvatures that know nothing of one another: inertia x'' + beta x' + k x = force, a coordinate
/// each, weightless.
class UncoupledSystem final : public PlantSystem {
 public:
  UncoupledSystem(const PlantSettings& settings, double inertia_kgm2)
      : PlantSystem(settings), inertia_kgm2_(inertia_kgm2) {
    if (!settings.loads.empty() || !settings.payload_kg.empty() || external_loads_.base_moves())
      throw std::invalid_argument("plant.kind: expected no loads with uncoupled, got some");
    const SegmentParameters& segment = settings.arm.segments.front();
    stiffness_ = segment.stiffness_nm_per_rad;
    damping_ = segment.damping_nms_per_rad;
  }

  int size() const override { return segments_arm_.dof(); }
  void residual(double t_s, ConstVector x, ConstVector v, ConstVector a, Vector out) override {
    out = inertia_kgm2_ * a + damping_ * v + stiffness_ * x - input_.force_nm(t_s);
  }
  Powers powers(double t_s, ConstVector, ConstVector v) override {
    return {input_.force_nm(t_s).dot(v), damping_ * v.squaredNorm()};
  }
  double potential_energy_j(ConstVector x) override { return 0.5 * stiffness_ * x.squaredNorm(); }
  void spread(ConstVector u, Vector x) const override { x = u; }
  void segment_ends(ConstVector x, std::span<Eigen::Isometry3d> ends) const override {
    forward_kinematics(segments_arm_, x, ends);
  }

 private:
  double inertia_kgm2_, stiffness_, damping_;
};

struct Uncoupled {
  double inertia_kgm2 = 0.002;

  const char* name() const noexcept { return "uncoupled"; }
  std::unique_ptr<PlantSystem> make(const PlantSettings& settings) const {
    return std::make_unique<UncoupledSystem>(settings, inertia_kgm2);
  }
};

/// All segments swing alike in the plane of x: u_x = amplitude (1 - cos rate t).
struct Swing {
  double amplitude_rad = 0.2;
  double rate_radps = 1.5;

  const char* name() const noexcept { return "swing"; }
  void check(const ReferencePlace& place, const ControllerSettings&, int) const {
    place.require_finite({amplitude_rad, rate_radps});
  }
  double largest_theta_rad() const noexcept { return 2.0 * amplitude_rad; }
  double largest_speed_radps() const noexcept { return amplitude_rad * rate_radps; }
  void evaluate(double time_s, ReferenceSample& out) const noexcept {
    const double angle = rate_radps * time_s;
    for (Eigen::Index i = 0; i < out.u.size(); i += 2) {
      out.u.segment<2>(i) << amplitude_rad * (1.0 - std::cos(angle)), 0.0;
      out.velocity.segment<2>(i) << amplitude_rad * rate_radps * std::sin(angle), 0.0;
      out.acceleration.segment<2>(i) << amplitude_rad * rate_radps * rate_radps * std::cos(angle),
          0.0;
    }
  }
};

/// The tip goes to and fro below the base, off the straight pose.
struct Rock {
  double height_m = -0.2;
  double sway_m = 0.02;

  const char* name() const noexcept { return "rock"; }
  void check(const ReferencePlace&, const ControllerSettings&, int) const {}
  TipReference tip(double time_s) const noexcept {
    return {.position_m = {0.05, sway_m * std::sin(time_s), height_m},
            .velocity_mps = {0.0, sway_m * std::cos(time_s), 0.0},
            .acceleration_mps2 = {0.0, -sway_m * std::sin(time_s), 0.0}};
  }
};

const PlantRegistration kUncoupled(Uncoupled{});
const ReferenceRegistration kSwing(Swing{});
const ReferenceRegistration kRock(Rock{});

constexpr int kSegments = 2;

PipelineSettings pipeline(ReferenceKind reference) {
  PipelineSettings settings;
  settings.arm.segments.assign(kSegments, SegmentParameters{});
  settings.arm.gravity_mps2.setZero();
  settings.control.kp.assign(2 * kSegments, 0.2);
  settings.control.kd.assign(2 * kSegments, 0.005);
  settings.estimation.filter_bandwidth_radps = 100.0;
  set_torque_actuation(settings.actuation, kSegments, 10.0);
  settings.actuation.slew_bar_per_s = 1e6;
  settings.actuation.vent_bar_per_s = 100.0;
  settings.rate_hz = 500.0;
  settings.safety.frame_period_s = 0.005;
  settings.reference.phases = {{std::move(reference), 0.0}};
  return settings;
}

PlantSettings plant(const PipelineSettings& settings, PlantKind kind) {
  PlantSettings plant;
  plant.kind = std::move(kind);
  plant.arm = settings.arm;
  plant.actuation = settings.actuation;
  plant.valves.supply_pressure_bar = 10.0;
  plant.initial_u_rad.setZero(2 * kSegments);
  return plant;
}

TEST(ExtensionPoints, KnowBothByName) {
  ASSERT_NE(plant_kinds().find("uncoupled"), nullptr);
  EXPECT_EQ(plant_kinds().find("uncoupled")->get_if<Uncoupled>()->inertia_kgm2, 0.002);
  EXPECT_EQ(plant_kinds().find("unheard_of"), nullptr);
  ASSERT_NE(reference_kinds().find("swing"), nullptr);
  EXPECT_FALSE(reference_kinds().find("swing")->is_tip_path());
  EXPECT_TRUE(reference_kinds().find("rock")->is_tip_path());
  EXPECT_THROW(PlantRegistration(PccSettings{}), std::invalid_argument);
  EXPECT_THROW(ReferenceRegistration(Swing{}), std::invalid_argument);
}

TEST(ExtensionPoints, APlantMovesAsItsEquationSays) {
  const PipelineSettings settings = pipeline(SetPointReference{});
  PlantSettings uncoupled = plant(settings, *plant_kinds().find("uncoupled"));
  uncoupled.relative_tolerance = 1e-8;
  uncoupled.absolute_tolerance = 1e-10;
  uncoupled.account_energy = true;
  uncoupled.initial_u_rad << 0.4, 0.0, -0.1, 0.3;
  // m x'' + d x' + k x = 0 released at rest, under-damped.
  const SegmentParameters& segment = settings.arm.segments.front();
  const double k = segment.stiffness_nm_per_rad, d = segment.damping_nms_per_rad, m = 0.002;
  const double decay = d / (2.0 * m), w = std::sqrt(k / m - decay * decay), t = 0.2;
  const double left = std::exp(-decay * t) * (std::cos(w * t) + decay / w * std::sin(w * t));
  const double rate = -std::exp(-decay * t) * k / (m * w) * std::sin(w * t);
  for (const auto method : {IntegratorMethod::sdirk2, IntegratorMethod::erk}) {
    uncoupled.method = method;
    ArmPlant arm(uncoupled);
    const PlantEnergies start = arm.energies();
    arm.advance(t);
    EXPECT_LT((arm.u_rad() - left * uncoupled.initial_u_rad).norm(), 1e-6);
    EXPECT_LT((arm.velocity_radps() - rate * uncoupled.initial_u_rad).norm(), 1e-4);
    const PlantEnergies end = arm.energies();
    EXPECT_NEAR(end.kinetic + end.potential + end.dissipated, start.potential, 1e-6);
  }
}

TEST(ExtensionPoints, RunInLockStep) {
  const PipelineSettings settings = pipeline(*reference_kinds().find("swing"));
  LockStep lock_step(settings, plant(settings, *plant_kinds().find("uncoupled")));
  LogRow row;
  double worst_rad = 0.0;
  for (int tick = 0; tick < 2000; ++tick) {
    lock_step.step(row);
    if (row.t_s > 2.0) worst_rad = std::max(worst_rad, (row.truth - row.reference).norm());
  }
  EXPECT_EQ(row.mode, Mode::active) << name(row.reason);
  EXPECT_GT(row.reference.norm(), 0.0);
  // The controller's model has other inertias, and no more: k and beta are the plant's.
  EXPECT_LT(worst_rad, 0.02);
}

TEST(ExtensionPoints, APathOfTheTipIsFollowed) {
  const PipelineSettings settings = pipeline(*reference_kinds().find("rock"));
  LockStep lock_step(settings, plant(settings, PccSettings{}));
  LogRow row;
  double worst_m = 0.0;
  for (int tick = 0; tick < 3000; ++tick) {
    lock_step.step(row);
    if (row.t_s > 4.0) {
      ASSERT_TRUE(row.tip_is_asked);
      worst_m = std::max(worst_m, (*row.tip - *row.tip_reference).norm());
    }
  }
  EXPECT_LT(worst_m, 1e-3);
}

TEST(ExtensionPoints, WhatDoesNotFitIsRefused) {
  Swing swing;
  swing.amplitude_rad = 2.0;
  EXPECT_THROW(ControlPipeline{pipeline(swing)}, std::invalid_argument);  // beyond max_theta_rad
  swing = {};
  swing.rate_radps = std::nan("");
  EXPECT_THROW(ControlPipeline{pipeline(swing)}, std::invalid_argument);
  const PipelineSettings settings = pipeline(SetPointReference{{0.0, 0.0, 0.0, 0.0}});
  PlantSettings loaded = plant(settings, Uncoupled{});
  loaded.loads = {{.force_n = {1.0, 0.0, 0.0}}};
  EXPECT_THROW(LockStep(settings, loaded), std::invalid_argument);
}

/// What follows from `residual` alone is what the built-in kinds know in closed form.
TEST(PlantSystem, DifferencesAgreeWithWhatAKindKnows) {
  const PipelineSettings base = pipeline(SetPointReference{});
  for (const PlantKind& kind : plant_kinds().all()) {
    PlantSettings settings = plant(base, kind);
    settings.arm.gravity_mps2 = {0.0, 0.0, -9.81};
    settings.arm.base_rotation = Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitX()).matrix();
    const auto system = kind.make(settings);
    const Eigen::Index n = system->size();
    Eigen::VectorXd x(n), v(n), u(2 * kSegments), rate(2 * kSegments);
    system->spread(Eigen::Vector4d(0.6, -0.2, 0.3, 0.5), x);
    system->spread(Eigen::Vector4d(0.5, 1.0, -0.7, 0.2), v);
    Eigen::VectorXd a(n), by_differences(n);
    ASSERT_TRUE(system->acceleration(0.0, x, v, a));
    ASSERT_TRUE(system->PlantSystem::acceleration(0.0, x, v, by_differences));
    EXPECT_LT((a - by_differences).norm(), 1e-6 * a.norm()) << kind.name();
    EXPECT_NEAR(system->PlantSystem::kinetic_energy_j(x, v), system->kinetic_energy_j(x, v), 1e-12);
    Eigen::VectorXd u_by_differences(2 * kSegments), rate_by_differences(2 * kSegments);
    system->curvature(x, v, u, rate);
    system->PlantSystem::curvature(x, v, u_by_differences, rate_by_differences);
    EXPECT_LT((u - u_by_differences).norm(), 1e-9) << kind.name();
    EXPECT_LT((rate - rate_by_differences).norm(), 1e-6) << kind.name();
    Eigen::MatrixXd exact[3], differenced[3];
    for (auto& matrix : exact) matrix.setZero(n, n);
    for (auto& matrix : differenced) matrix.setZero(n, n);
    const Eigen::VectorXd rest = Eigen::VectorXd::Zero(n);
    system->linearize(0.0, x, rest, rest, exact[0], exact[1], exact[2]);
    system->PlantSystem::linearize(0.0, x, rest, rest, differenced[0], differenced[1],
                                   differenced[2]);
    for (int k = 0; k < 3; ++k)
      EXPECT_LT((exact[k] - differenced[k]).norm(), 1e-4 * exact[k].norm()) << kind.name() << k;
  }
}

}  // namespace
}  // namespace softarm
