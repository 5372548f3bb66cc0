#include "dev/bench/robustness_scenes.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace softarm {
namespace {

using Change = std::function<void(Experiment&)>;

/// As paper_arm_mismatch.yaml: every parameter off in the direction that adds up.
void mismatch(PlantSettings& plant, std::size_t i, double by) {
  SegmentParameters& segment = plant.arm.segments[i];
  segment.stiffness_nm_per_rad *= 1.0 + by;
  segment.damping_nms_per_rad *= 1.0 - by;
  segment.mass_kg *= 1.0 + by;
  for (Chamber& chamber : plant.actuation.segments[i]) chamber.gain_nm_per_bar *= 1.0 - by;
}

Change mismatched(double by) {
  return [by](Experiment& e) {
    for (std::size_t i = 0; i < e.plant.arm.segments.size(); ++i) mismatch(e.plant, i, by);
  };
}

Change tilted(double degrees) {
  return [degrees](Experiment& e) {
    const double angle = degrees * std::numbers::pi / 180.0;
    e.plant.arm.base_rotation =
        Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()) * e.plant.arm.base_rotation;
  };
}

Change weak_segment(double gain) {
  return [gain](Experiment& e) {
    for (Chamber& chamber : e.plant.actuation.segments.at(2)) chamber.gain_nm_per_bar *= gain;
  };
}

Change loaded(double kg) {
  return [kg](Experiment& e) {
    e.plant.payload_kg.assign(e.plant.arm.segments.size(), 0.0);
    e.plant.payload_kg.back() = kg;
  };
}

Change after(const Change& first, const Change& second) {
  return [=](Experiment& e) {
    first(e);
    second(e);
  };
}

/// Frames may be missing for a while without a HOLD.
void patient(Experiment& e) {
  e.safety.hold_after_s = 0.5;
  e.safety.vent_after_s = 1.0;
  e.estimation.predicted_frames = 200;
}

void fast(Experiment& e) {
  auto paper = *e.reference.phases.at(0).kind.get_if<PaperReference>();
  paper.rate_radps = 8.0;
  e.reference.phases.at(0).kind = paper;
}

/// All segments back and forth through the straight pose.
void through_straight(Experiment& e) {
  WayPointReference points;
  points.repeat = true;
  double time_s = 0.0;
  const Eigen::Vector2d one(0.4, 0.1);
  for (const Eigen::Vector2d& u : {one, Eigen::Vector2d(-one), one}) {
    WayPoint point{.time_s = time_s += 1.0, .u_rad = {}};
    for (int i = 0; i < e.arm.size(); ++i)
      point.u_rad.insert(point.u_rad.end(), u.begin(), u.end());
    points.points.push_back(point);
  }
  e.reference.phases = {{points, 0.0}};
}

void held(Experiment& e) {
  SetPointReference pose;
  for (int i = 0; i < e.arm.size(); ++i) {
    const double phi = std::numbers::pi + std::cos(i * std::numbers::pi / 3.0);
    pose.u_rad.push_back(0.4 * std::cos(phi));
    pose.u_rad.push_back(0.4 * std::sin(phi));
  }
  e.reference.phases = {{pose, 0.0}};
}

void let_stretch(Experiment& e, const Experiment& stretching) {
  for (ArmParameters* arm : {&e.arm, &e.plant.arm}) {
    arm->extensible = true;
    for (std::size_t i = 0; i < arm->segments.size(); ++i) {
      const SegmentParameters& from = stretching.arm.segments.at(i);
      arm->segments[i].axial_stiffness_n_per_m = from.axial_stiffness_n_per_m;
      arm->segments[i].axial_damping_ns_per_m = from.axial_damping_ns_per_m;
    }
  }
  e.actuation.bias_pressure_bar = stretching.actuation.bias_pressure_bar;
}

}  // namespace

std::vector<RobustnessScene> robustness_scenes() {
  std::vector<RobustnessScene> scenes;
  const auto add = [&scenes](const char* name, double bound, Change change) -> RobustnessScene& {
    return scenes.emplace_back(RobustnessScene{
        .name = name, .bound_mrad = bound, .change = std::move(change), .faults = {}});
  };
  add("as configured", 0.9, [](Experiment&) {});
  add("mismatch 5 %", 1.0, mismatched(0.05));
  add("mismatch 10 %", 1.0, mismatched(0.1));
  add("mismatch 20 %", 1.0, mismatched(0.2));
  add("mixed 20 %", 1.0, [](Experiment& e) {
    for (std::size_t i = 0; i < e.plant.arm.segments.size(); ++i)
      mismatch(e.plant, i, i % 2 == 0 ? 0.2 : -0.2);
  });
  add("segment 3 at 70 %", 1.0, weak_segment(0.7));
  add("segment 3 at 50 %", 1.0, weak_segment(0.5));
  add("tilt 10 degrees", 1.2, tilted(10.0));
  add("tilt 20 degrees", 2.2, tilted(20.0));
  add("payload 50 g", 1.6, loaded(0.05));
  add("payload 100 g", 2.6, loaded(0.1));
  add("0.2 N at the tip", 1.2, [](Experiment& e) { e.plant.tip_force_n = {0.2, 0.0, 0.0}; });
  add("push 0.5 N for 0.5 s", 7.0, [](Experiment& e) {
    ExternalLoad push;
    push.force_n = {0.5, 0.0, 0.0};
    push.start_s = 10.0;
    push.duration_s = 0.5;
    e.plant.loads.push_back(push);
  });
  add("links plant", 1.0, [](Experiment& e) { e.plant.kind = LinkSettings{}; });
  add("refined plant", 1.0, [](Experiment& e) { e.plant.kind = RefinedSettings{}; });
  add("hysteresis 15 %", 5.0, [](Experiment& e) {
    e.plant.material.hysteresis = 0.15;
    e.plant.material.play_bar = {0.02, 0.05, 0.1};
  });
  add("valve play 12.5 mbar, steps 10 mbar", 7.0, [](Experiment& e) {
    e.plant.valves.play_bar = 0.0125;
    e.plant.valves.resolution_bar = 0.01;
  });
  add("20 %, 8 rad/s", 2.0, after(mismatched(0.2), fast));
  add("20 %, through theta = 0", 1.2, after(mismatched(0.2), through_straight));
  add("lag 40 ms, 20 configured", 1.2, [](Experiment& e) { e.plant.valves.lag_s = 0.04; });
  add("unknown dead time 20 ms", 1.5, [](Experiment& e) { e.plant.valves.dead_time_s = 0.02; });
  add("unknown dead time 30 ms", 3.0, [](Experiment& e) { e.plant.valves.dead_time_s = 0.03; });
  add("known dead time 30 ms", 0.0,
      [](Experiment& e) { e.plant.valves.dead_time_s = e.control.dead_time_s = 0.03; });
  add("50 % of frames lost", 1.1,
      after(patient, [](Experiment& e) { e.plant.mocap.dropout_probability = 0.5; }));
  add("200 ms without frames each second", 1.1, patient).faults.lost_s = 0.2;
  add("a body occluded 100 ms each second", 1.1, patient).faults.occluded_s = 0.1;
  add("nominal plant, ideal sensing", 0.03, [](Experiment&) {}).nominal = true;
  add("the same, 20 % wrong", 0.2, mismatched(0.2)).nominal = true;
  for (const bool wrong : {false, true}) {
    RobustnessScene& scene = add(wrong ? "held still, 20 % wrong" : "held still", wrong ? 1.2 : 1.0,
                                 wrong ? after(mismatched(0.2), held) : Change(held));
    scene.counted_from_s = 3.0;
  }
  return scenes;
}

const char* name(RobustnessLaw law) {
  constexpr const char* kNames[] = {"paper17",  "statics + PI",          "K_I",
                                    "observer", "observer + parameters", "observer + repetition"};
  return kNames[static_cast<std::size_t>(law)];
}

Experiment robustness_experiment(const RobustnessScene& scene, RobustnessLaw law,
                                 const std::function<Experiment(const std::string&)>& config,
                                 bool stretches) {
  Experiment e = config(scene.nominal ? "paper_arm_nominal.yaml" : "paper_arm.yaml");
  if (stretches) let_stretch(e, config("paper_arm_stretching.yaml"));
  switch (law) {
    case RobustnessLaw::paper17:
      break;
    case RobustnessLaw::statics_pi: {
      const ControllerSettings control = config("claims/static_pi.yaml").control;
      const double lag_s = e.control.valve_lag_s;
      e.control = control;
      e.control.valve_lag_s = std::min(lag_s, control.valve_lag_s);
      break;
    }
    case RobustnessLaw::integral:
      std::fill(e.control.ki.begin(), e.control.ki.end(), 1.0);
      break;
    case RobustnessLaw::observer:
    case RobustnessLaw::observer_parameters:
    case RobustnessLaw::observer_repetition: {
      const Experiment observer = config("paper_arm_observer.yaml");
      e.estimation.observer = observer.estimation.observer;
      e.estimation.model_observer = observer.estimation.model_observer;
      e.estimation.model_observer.learn_parameters = law != RobustnessLaw::observer;
      if (law == RobustnessLaw::observer_repetition) e.control.repetition.lead_s = 0.1;
      e.control.kp = observer.control.kp;
      e.control.kd = observer.control.kd;
      // Without a lag there is nothing that K_D could damp, and its bound is tighter.
      if (scene.nominal) std::fill(e.control.kd.begin(), e.control.kd.end(), 0.01);
      break;
    }
  }
  scene.change(e);
  return e;
}

}  // namespace softarm
