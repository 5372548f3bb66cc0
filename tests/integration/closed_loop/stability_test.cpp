// The loop that runs, on arms that are not their model: a tip that stays stable with the default
// gains, and an unstable loop that is noticed.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>

#include "softarm/config/load.hpp"
#include "softarm/simulation/lock_step.hpp"

namespace softarm {
namespace {

const std::filesystem::path kConfigs = std::filesystem::path(SOFTARM_SOURCE_DIR) / "config";

/// How a run went; the tip's error counts in its second half.
struct Outcome {
  double tip_rms_m = 0.0;
  double lost_after_s = -1.0;  ///< ACTIVE ended; -1: it did not
  Reason reason = Reason::none;
};

Outcome outcome(const Experiment& experiment, double duration_s) {
  LockStep steps(experiment, experiment.plant);
  LogRow row;
  Outcome result;
  double squares = 0.0, active_s = 0.0;
  std::int64_t counted = 0;
  const auto ticks = std::llround(duration_s * experiment.rate_hz);
  for (std::int64_t k = 0; k < ticks; ++k) {
    steps.step(row);
    if (row.mode != Mode::active) {
      if (active_s == 0.0) continue;
      return {0.0, active_s, row.reason};
    }
    active_s += 1.0 / experiment.rate_hz;
    if (2 * k < ticks || !row.tip_is_asked) continue;
    squares += (*row.tip - *row.tip_reference).squaredNorm();
    ++counted;
  }
  if (counted > 0) result.tip_rms_m = std::sqrt(squares / static_cast<double>(counted));
  if (active_s == 0.0) result = {0.0, 0.0, row.reason};
  return result;
}

/// paper_arm with as many segments, and a path of its tip: 5 cm about its axis, or a point there.
Experiment tip_arm(int segments, bool circle, double rate_radps = 0.63) {
  std::string path = fmt::format("centre_m: [{}, 0, {}]", circle ? 0.0 : 0.05,
                                 segments == 2 ? -0.2 : -0.0933 * segments);
  if (segments == 1) path = fmt::format("centre_m: [{}, 0, -0.1045]", circle ? 0.0 : 0.03);
  const double radius = segments == 1 ? 0.03 : 0.05;
  if (circle)
    path += fmt::format(", first_axis_m: [{0}, 0, 0], second_axis_m: [0, {0}, 0], rate_radps: {1}",
                        radius, rate_radps);
  const std::filesystem::path file =
      std::filesystem::temp_directory_path() / fmt::format("softarm_tip_arm_{}.yaml", ::getpid());
  std::ofstream(file) << fmt::format(
      "include: {}\nname: tip\narm: {{segments: {}}}\nreference: [{{kind: {}, {}}}]\n",
      (kConfigs / "paper_arm.yaml").string(), segments, circle ? "tip_circle" : "tip_point", path);
  const Experiment experiment = load_experiment(file);
  std::filesystem::remove(file);
  return experiment;
}

/// The loop, not the daemon's check of lengths, is on trial.
void scale_length(Experiment& e, double factor) {
  e.safety.length_fault = 0.0;
  for (SegmentParameters& segment : e.plant.arm.segments) segment.length_m *= factor;
}
void scale_gain(Experiment& e, double factor) {
  for (auto& chambers : e.plant.actuation.segments)
    for (Chamber& chamber : chambers) chamber.gain_nm_per_bar *= factor;
}
void set_lag(Experiment& e, double real_s, double configured_s) {
  e.plant.valves.lag_s = real_s;
  e.control.valve_lag_s = configured_s;
}
void set_gains(Experiment& e, double kp, double ki) {
  e.control.kp.assign(e.control.kp.size(), kp);
  e.control.ki.assign(e.control.kp.size(), ki);
}

TEST(TipStability, MarginsAtTheDefaults) {
  struct Scene {
    const char* name;
    std::function<void(Experiment&)> change;
  };
  const std::vector<Scene> scenes = {
      {"as configured", [](Experiment&) {}},
      {"length 1.28", [](Experiment& e) { scale_length(e, 1.28); }},
      {"length 0.9", [](Experiment& e) { scale_length(e, 0.9); }},
      {"gain 2", [](Experiment& e) { scale_gain(e, 2.0); }},
      {"gain 0.7", [](Experiment& e) { scale_gain(e, 0.7); }},
      {"10 ms of dead time", [](Experiment& e) { e.plant.valves.dead_time_s = 0.01; }},
      {"50 g", [](Experiment& e) { e.plant.payload_kg.back() = 0.05; }},
      {"150 g", [](Experiment& e) { e.plant.payload_kg.back() = 0.15; }},
      {"K_I 1", [](Experiment& e) { set_gains(e, 1.0, 1.0); }},
      {"K_I 1 and 50 g",
       [](Experiment& e) {
         set_gains(e, 1.0, 1.0);
         e.plant.payload_kg.back() = 0.05;
       }},
      {"K_P 0.3", [](Experiment& e) { set_gains(e, 0.3, 0.0); }},
      {"K_P 1.5", [](Experiment& e) { set_gains(e, 1.5, 0.0); }},
      {"no lag", [](Experiment& e) { set_lag(e, 0.0, 0.0); }},
      {"30 ms of lag", [](Experiment& e) { set_lag(e, 0.03, 0.03); }},
      {"60 ms of lag", [](Experiment& e) { set_lag(e, 0.06, 0.06); }},
      {"60 ms of lag, 40 configured", [](Experiment& e) { set_lag(e, 0.06, 0.04); }},
      {"30 ms of lag, 60 configured", [](Experiment& e) { set_lag(e, 0.03, 0.06); }},
      {"90 ms of lag, 60 configured", [](Experiment& e) { set_lag(e, 0.09, 0.06); }}};
  for (const Scene& scene : scenes) {
    for (const bool circle : {true, false}) {
      Experiment experiment = tip_arm(3, circle);
      scene.change(experiment);
      const Outcome found = outcome(experiment, 20.0);
      EXPECT_LT(found.lost_after_s, 0.0) << scene.name << " " << name(found.reason);
      EXPECT_LT(found.tip_rms_m, 2e-3) << scene.name << (circle ? ", circle" : ", point");
    }
  }
}

TEST(TipStability, AnyNumberOfSegments) {
  for (const int segments : {1, 2, 4, 6}) {
    for (const bool circle : {true, false}) {
      const Outcome found = outcome(tip_arm(segments, circle), 20.0);
      EXPECT_LT(found.lost_after_s, 0.0) << segments << " " << name(found.reason);
      EXPECT_LT(found.tip_rms_m, 2e-3) << segments;
    }
  }
}

TEST(TipStability, APayloadOnAFastCircle) {
  Experiment experiment = tip_arm(3, true, 2.0);
  experiment.plant.payload_kg.back() = 0.15;
  EXPECT_LT(outcome(experiment, 20.0).tip_rms_m, 2e-3);
}

TEST(SectionSix, TracksTheLemniscate) {
  EXPECT_LT(outcome(load_experiment(kConfigs / "paper_simulation.yaml"), 20.0).tip_rms_m, 0.15e-3);
  Experiment noisy = load_experiment(kConfigs / "paper_simulation_noisy.yaml");
  EXPECT_LT(outcome(noisy, 20.0).tip_rms_m, 0.45e-3);
  for (SegmentParameters& segment : noisy.arm.segments) {  // against the same links
    segment.stiffness_nm_per_rad *= 1.2;
    segment.damping_nms_per_rad *= 0.8;
  }
  EXPECT_LT(outcome(noisy, 20.0).tip_rms_m, 0.5e-3);
}

/// The tip's loop as it was: (21) with the offset of the tip filtered at 10 rad/s, fed back alone.
void as_it_was(Experiment& e) { e.control.task_space = {6.0, 10.0, 2.0, 0.0}; }

TEST(Oscillation, AnUnstableLoopVentsInBoundedTime) {
  struct Scene {
    const char* name;
    std::function<Experiment()> make;
  };
  const auto paper = [] { return load_experiment(kConfigs / "paper_arm.yaml"); };
  const auto changed = [](Experiment e, const std::function<void(Experiment&)>& change) {
    change(e);
    return e;
  };
  const std::vector<Scene> scenes = {
      {"K_I 500", [&] { return changed(paper(), [](auto& e) { set_gains(e, 1.0, 500.0); }); }},
      {"K_P 3.5", [&] { return changed(paper(), [](auto& e) { set_gains(e, 3.5, 0.0); }); }},
      {"K_P 2 with a gain of 2",
       [&] {
         return changed(paper(), [](auto& e) {
           set_gains(e, 2.0, 0.0);
           scale_gain(e, 2.0);
         });
       }},
      {"a fast tip loop, 100 g",
       [&] {
         return changed(tip_arm(3, true), [](auto& e) {
           as_it_was(e);
           e.plant.payload_kg.back() = 0.1;
         });
       }},
      {"the same, a point", [&] {
         return changed(tip_arm(3, false), [](auto& e) {
           as_it_was(e);
           e.plant.payload_kg.back() = 0.15;
         });
       }}};
  for (const Scene& scene : scenes) {
    const Outcome found = outcome(scene.make(), 30.0);
    EXPECT_GT(found.lost_after_s, 0.0) << scene.name;
    EXPECT_TRUE(found.reason == Reason::oscillation || found.reason == Reason::soft_limit)
        << scene.name << ": " << name(found.reason);
  }
}

TEST(Oscillation, NoShippedExperimentVents) {
  int run = 0;
  for (const auto& each : std::filesystem::directory_iterator(kConfigs)) {
    if (each.path().extension() != ".yaml" || each.path().stem() == "template") continue;
    Experiment experiment = load_experiment(each.path());
    const Outcome found = outcome(experiment, 20.0);
    EXPECT_NE(found.reason, Reason::oscillation)
        << each.path().filename() << " after " << found.lost_after_s;
    ++run;
  }
  EXPECT_GT(run, 10);
}

/// What follows badly is no oscillation, however periodic it is.
TEST(Oscillation, AWrongModelIsNone) {
  for (const double rate : {2.0, 8.0}) {
    Experiment experiment = load_experiment(kConfigs / "paper_arm.yaml");
    PaperReference reference;
    reference.rate_radps = rate;
    experiment.reference.phases = {{reference, 0.0}};
    scale_gain(experiment, 0.8);
    experiment.plant.payload_kg.back() = 0.05;
    EXPECT_LT(outcome(experiment, 20.0).lost_after_s, 0.0) << rate;
  }
}

class OscillationSlow : public ::testing::TestWithParam<const char*> {};

TEST_P(OscillationSlow, AnHourVentsNothing) {
  const Outcome found = outcome(load_experiment(kConfigs / GetParam()), 3600.0);
  EXPECT_LT(found.lost_after_s, 0.0) << name(found.reason);
}

INSTANTIATE_TEST_SUITE_P(Hour, OscillationSlow,
                         ::testing::Values("paper_arm.yaml", "paper_arm_mismatch.yaml"));

}  // namespace
}  // namespace softarm
