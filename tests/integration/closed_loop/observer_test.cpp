// What the model-based observer finds in closed loop: an arm that is learnt once and then known, a
// contact and its force, a leak that is none, an hour of hold.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <numbers>
#include <vector>

#include "dev/bench/robustness_scenes.hpp"
#include "softarm/base/time.hpp"
#include "softarm/commissioning/identification/learned_arm.hpp"
#include "softarm/config/load.hpp"
#include "softarm/runtime/control_pipeline.hpp"
#include "softarm/simulation/lock_step.hpp"
#include "softarm/simulation/simulated_arm.hpp"
#include "test_folder.hpp"

namespace softarm {
namespace {

namespace fs = std::filesystem;

fs::path shipped_file(const std::string& name) {
  return fs::path(SOFTARM_SOURCE_DIR) / "config" / name;
}
Experiment shipped(const std::string& name) { return load_experiment(shipped_file(name)); }

RobustnessScene scene_named(const std::string& name) {
  for (const RobustnessScene& scene : robustness_scenes())
    if (scene.name == name) return scene;
  throw std::invalid_argument(name);
}

Experiment observed(const std::string& scene) {
  return robustness_experiment(scene_named(scene), RobustnessLaw::observer_parameters, shipped);
}

/// The tick and the simulated arm in lock step, with what a test does to the commands on their way.
class Loop {
 public:
  explicit Loop(const Experiment& experiment)
      : pipeline(experiment),
        arm_(experiment.plant, 0),
        validity_ns_(to_ns(experiment.safety.command_validity_s)) {}

  const TickOutput& tick() {
    arm_.advance_to(now_ns);
    frames_.clear();
    for (MocapFrame frame; arm_.receive(frame);) frames_.push_back(frame);
    measured_ = arm_.measured_pressures_bar();
    TickInput input;
    input.now_ns = now_ns;
    input.frames = frames_;
    input.newest_go_ns = input.newest_measurement_ns = now_ns;
    input.measured_bar = &measured_;
    const TickOutput& output = pipeline.tick(input);
    PressureVector sent = output.pressure_bar;
    if (on_the_way) on_the_way(sent);
    arm_.command(sent, validity_ns_, now_ns);
    pipeline.report(report);
    now_ns += pipeline.period_ns();
    return output;
  }
  void run_until(double t_s) {
    while (time_s() < t_s) tick();
  }
  double time_s() const { return to_seconds(now_ns); }

  ControlPipeline pipeline;
  std::function<void(PressureVector&)> on_the_way;
  ObserverReport report;
  std::int64_t now_ns = 0;

 private:
  SimulatedArm arm_;
  std::int64_t validity_ns_;
  std::vector<MocapFrame> frames_;
  PressureVector measured_;
};

TEST(LearnedArm, WithItPaper17TracksAWrongArmNearlyAsItsOwn) {
  const TestFolder folder;
  const Experiment experiment = observed("mismatch 20 %");
  Loop loop(experiment);
  loop.run_until(20.0);
  ASSERT_EQ(loop.pipeline.output().mode, Mode::active);

  const fs::path file = folder / "learned.yaml";
  std::ofstream(file) << learned_yaml(shipped("paper_arm.yaml"), loop.report, "Learnt.",
                                      shipped_file("paper_arm.yaml"), file);
  const Experiment learned = load_experiment(file);

  const RobustnessScene wrong = scene_named("mismatch 20 %"), own = scene_named("as configured");
  const auto error_rad = [&](const RobustnessScene& scene, const Experiment& known) {
    Experiment e = robustness_experiment(scene, RobustnessLaw::paper17, shipped);
    e.arm = known.arm;
    e.actuation = known.actuation;
    const RobustnessTrial trial = run(e, scene, 1);
    EXPECT_TRUE(trial.stayed_active);
    return trial.u_rms_rad;
  };
  const double nominal_rad = error_rad(own, shipped("paper_arm.yaml"));
  EXPECT_GT(error_rad(wrong, shipped("paper_arm.yaml")), 20.0 * nominal_rad);
  EXPECT_LT(error_rad(wrong, learned), 1.5 * nominal_rad);
}

TEST(LearnedArm, ATiltIsKnownFromTheBeginning) {
  const TestFolder folder;
  Loop loop(observed("tilt 10 degrees"));
  loop.run_until(20.0);
  const fs::path file = folder / "learned.yaml";
  std::ofstream(file) << learned_yaml(shipped("paper_arm_observer.yaml"), loop.report, "Learnt.",
                                      shipped_file("paper_arm_observer.yaml"), file);
  const Experiment learned = load_experiment(file);
  const ModelObserverSettings& known = learned.estimation.model_observer;
  ASSERT_EQ(known.load.size(), 6u);
  ASSERT_TRUE(known.load_deviation.has_value());
  const double tilt = std::tan(10.0 * std::numbers::pi / 180.0);
  for (std::size_t i = 0; i < 6; i += 2)
    EXPECT_NEAR(std::hypot(known.load[i], known.load[i + 1]), tilt, 0.3 * tilt) << i;

  RobustnessScene scene = scene_named("tilt 10 degrees");
  scene.counted_from_s = 0.1;
  scene.counted_s = 2.0;
  const auto error_rad = [&](const Experiment& e) { return run(e, scene, 1).u_rms_rad; };
  Experiment again = observed("tilt 10 degrees");
  const double before_rad = error_rad(again);
  again.arm = learned.arm;
  again.actuation = learned.actuation;
  again.estimation.model_observer = known;
  EXPECT_LT(error_rad(again), 0.9 * before_rad);
}

/// Pushed from 10 s on.
Experiment pushed(const std::string& scene, const Eigen::Vector3d& force_n, double duration_s,
                  double start_s = 10.0) {
  Experiment e = observed(scene);
  e.safety.contact_force_n = 0.1;
  e.safety.contact_reaction = ContactReaction::yield;
  ExternalLoad push;
  push.force_n = force_n;
  push.start_s = start_s;
  push.duration_s = duration_s;
  e.plant.loads.push_back(push);
  return e;
}

/// Size of the mean force over the next tenth of a second.
double mean_force_n(Loop& loop) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  constexpr int kTicks = 50;
  for (int k = 0; k < kTicks; ++k) {
    loop.tick();
    sum += loop.report.force_n;
  }
  return sum.norm() / kTicks;
}

TEST(Contact, AForceOf200MillinewtonsIsFoundAndMeasured) {
  for (const Eigen::Vector3d& force_n :
       {Eigen::Vector3d(0.2, 0.0, 0.0), Eigen::Vector3d(0.0, -0.2, 0.0),
        Eigen::Vector3d(-0.14, 0.14, 0.0)}) {
    Loop loop(pushed("as configured", force_n, 2.0));
    loop.run_until(10.0);
    EXPECT_FALSE(loop.report.contact);
    while (!loop.report.contact && loop.time_s() < 11.0) loop.tick();
    EXPECT_LT(loop.time_s(), 10.105) << force_n.transpose();  // the tick of 10.1 s at the latest
    loop.run_until(10.45);
    const double found_n = mean_force_n(loop);
    EXPECT_NEAR(found_n, force_n.norm(), 0.15 * force_n.norm()) << force_n.transpose();
    EXPECT_EQ(loop.pipeline.output().mode, Mode::active);
    loop.run_until(13.0);
    EXPECT_FALSE(loop.report.contact) << loop.report.force_n.transpose();
  }
}

TEST(Contact, OnAWrongArmAfterAMinute) {
  const Eigen::Vector3d force_n(0.2, 0.0, 0.0);
  Loop loop(pushed("mismatch 20 %", force_n, 2.0, 60.0));
  loop.run_until(60.45);
  EXPECT_TRUE(loop.report.contact);
  EXPECT_NEAR(mean_force_n(loop), force_n.norm(), 0.3 * force_n.norm());
}

TEST(Contact, HoldLastsAsLongAsThePush) {
  Experiment e = pushed("as configured", {0.3, 0.0, 0.0}, 1.0);
  e.safety.contact_reaction = ContactReaction::hold;
  Loop loop(e);
  loop.run_until(10.5);
  EXPECT_EQ(loop.pipeline.output().mode, Mode::hold);
  EXPECT_EQ(loop.pipeline.output().reason, Reason::contact);
  loop.run_until(10.9);
  EXPECT_EQ(loop.pipeline.output().mode, Mode::hold);
  loop.run_until(13.0);
  EXPECT_EQ(loop.pipeline.output().mode, Mode::active);
}

TEST(Contact, VentWaitsForAnOperator) {
  Experiment e = pushed("as configured", {0.3, 0.0, 0.0}, 0.5);
  e.safety.contact_reaction = ContactReaction::vent;
  Loop loop(e);
  loop.run_until(13.0);
  EXPECT_EQ(loop.pipeline.output().mode, Mode::vent);
  EXPECT_FALSE(loop.pipeline.output().armed);
}

/// A chamber that leaks pulls the arm as a push would; its measured pressure gives it away.
TEST(Contact, ALeakIsNoPushWherePressuresAreMeasured) {
  for (const bool measured : {true, false}) {
    Experiment e = pushed("as configured", Eigen::Vector3d::Zero(), 1.0);
    e.safety.valve_readback = measured;
    e.safety.pressure_tolerance_bar = 0.0;  // whose fault would end the run
    Loop loop(e);
    loop.run_until(10.0);
    loop.on_the_way = [](PressureVector& bar) { bar.tail(4) *= 0.6; };
    bool contact = false, loss = false;
    while (loop.time_s() < 12.0) {
      loop.tick();
      contact |= loop.report.contact;
      loss |= loop.report.pressure_loss;
    }
    EXPECT_EQ(contact, !measured);
    EXPECT_EQ(loss, measured);
  }
}

/// Root mean square of reference minus truth, a component, from 5 s on; the arm is 10 % off.
double error_of(Experiment e) {
  e.estimation.observer = ObserverKind::model;
  for (SegmentParameters& segment : e.plant.arm.segments) {
    segment.stiffness_nm_per_rad *= 1.1;
    segment.damping_nms_per_rad *= 0.9;
  }
  LockStep lock_step(e, e.plant);
  LogRow row;
  double squares = 0.0;
  std::int64_t count = 0;
  for (std::int64_t k = 0; k < static_cast<std::int64_t>(12.0 * e.rate_hz); ++k) {
    lock_step.step(row);
    if (row.t_s < 5.0) continue;
    if (row.mode != Mode::active) return std::numeric_limits<double>::infinity();
    EXPECT_TRUE(row.observer && row.observer->running);
    squares += (row.reference - row.truth).squaredNorm();
    count += row.reference.size();
  }
  return std::sqrt(squares / static_cast<double>(count));
}

TEST(ArmsOfEveryKind, AreTrackedWithTheObserver) {
  Experiment planar = shipped("planar_arm.yaml");
  EXPECT_LT(error_of(planar), 2e-3);

  const Experiment four = shipped("paper_arm_observer.yaml");
  Experiment three = four;
  for (ActuationSettings* actuation : {&three.actuation, &three.plant.actuation})
    for (std::vector<Chamber>& chambers : actuation->segments) {
      chambers.pop_back();
      for (std::size_t j = 0; j < chambers.size(); ++j)
        chambers[j].angle_rad = 2.0 * std::numbers::pi / 3.0 * static_cast<double>(j);
    }
  EXPECT_LT(error_of(three), 2e-3);

  Experiment torque = four;
  set_torque_actuation(torque.actuation, torque.arm.size(), 10.0);
  set_torque_actuation(torque.plant.actuation, torque.arm.size(), 10.0);
  torque.plant.valves.supply_pressure_bar = 100.0;
  EXPECT_LT(error_of(torque), 2e-3);

  Experiment point = four;
  point.arm.mass = point.plant.arm.mass = MassModel::point;
  EXPECT_LT(error_of(point), 2e-3);
}

/// Reason for which the arm left ACTIVE within 20 s; none where it did not.
Reason lost_for(const std::function<void(PlantSettings&)>& change) {
  Experiment e = observed("as configured");
  change(e.plant);
  Loop loop(e);
  bool was_active = false;
  while (loop.time_s() < 20.0) {
    const TickOutput& output = loop.tick();
    if (was_active && output.mode != Mode::active) return output.reason;
    was_active |= output.mode == Mode::active;
  }
  return was_active ? Reason::none : Reason::starting;
}

TEST(WrongModel, IsAFaultFarFromTheFileAndNoneNearIt) {
  const auto scaled = [](double stiffness, double mass, double gain, double payload_kg) {
    return [=](PlantSettings& plant) {
      for (SegmentParameters& segment : plant.arm.segments) {
        segment.stiffness_nm_per_rad *= stiffness;
        segment.mass_kg *= mass;
      }
      for (auto& chambers : plant.actuation.segments)
        for (Chamber& chamber : chambers) chamber.gain_nm_per_bar *= gain;
      plant.payload_kg.back() = payload_kg;
    };
  };
  EXPECT_EQ(lost_for(scaled(4.0, 1.0, 1.0, 0.0)), Reason::wrong_model);
  EXPECT_EQ(lost_for(scaled(1.3, 0.7, 1.3, 0.0)), Reason::none);
  EXPECT_EQ(lost_for(scaled(0.7, 1.3, 0.7, 0.0)), Reason::none);
  EXPECT_EQ(lost_for(scaled(1.0, 1.0, 1.0, 0.15)), Reason::none);
  EXPECT_EQ(lost_for(scaled(0.8, 0.8, 0.8, 0.15)), Reason::none);
}

TEST(ObserverSlow, NoFalseContactInAnHourOfTheReference) {
  Experiment e = pushed("mismatch 5 %", Eigen::Vector3d::Zero(), 1.0);
  Loop loop(e);
  std::int64_t in_contact = 0;
  while (loop.time_s() < 3600.0) {
    loop.tick();
    if (loop.report.contact) ++in_contact;
  }
  EXPECT_EQ(loop.pipeline.output().mode, Mode::active);
  EXPECT_EQ(in_contact, 0);
}

/// Unexcited parameters stay as the first motion left them, within what it could show, and the
/// motion that follows finds them so: no burst.
TEST(ObserverSlow, AnHourOfHoldAndThenTheReference) {
  Experiment e = observed("held still");
  const ReferenceSettings moving = observed("as configured").reference;
  e.reference.phases.front().duration_s = 3600.0;
  e.reference.phases.insert(e.reference.phases.end(), moving.phases.begin(), moving.phases.end());
  LockStep lock_step(e, e.plant);
  LogRow row;
  double squares = 0.0, largest_rad = 0.0;
  std::int64_t count = 0;
  ObserverReport early, late;  // of the hold
  const auto ticks = static_cast<std::int64_t>(3622.0 * e.rate_hz);
  for (std::int64_t k = 0; k < ticks; ++k) {
    const double t_s = static_cast<double>(k) / e.rate_hz;
    lock_step.step(row, t_s < 20.0 || t_s > 3595.0);
    if (row.observer && t_s < 20.0) early = *row.observer;
    if (row.observer && t_s < 3599.0) late = *row.observer;
    if (t_s < 3602.0) continue;
    ASSERT_EQ(row.mode, Mode::active);
    const SegmentVector error = row.reference - row.truth;
    squares += error.squaredNorm();
    count += error.size();
    largest_rad = std::max(largest_rad, error.cwiseAbs().maxCoeff());
  }
  EXPECT_LT(std::sqrt(squares / static_cast<double>(count)), 1e-3);
  EXPECT_LT(largest_rad, 0.01);
  for (int i = 0; i < e.arm.size(); ++i) {
    const auto segment = static_cast<std::size_t>(i);
    for (const auto part :
         {&SegmentCorrection::damping, &SegmentCorrection::stiffness, &SegmentCorrection::gain}) {
      const double learnt = late.correction.segment[segment].*part;
      EXPECT_NEAR(learnt, early.correction.segment[segment].*part, 0.01) << i;
      EXPECT_LT(std::abs(learnt), 3.0 * late.deviation.segment[segment].*part) << i;
    }
  }
}

}  // namespace
}  // namespace softarm
