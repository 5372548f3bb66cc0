#include "dev/bench/plant_scenes.hpp"

#include <time.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "dev/bench/plain_cvode.hpp"
#include "softarm/base/clock.hpp"
#include "softarm/base/time.hpp"
#include "softarm/simulation/plant_error.hpp"

namespace softarm {
namespace {

constexpr double kHold_s = 1e-3;
constexpr double kAxialForce_n = 30.0;  // mean and amplitude, where segments stretch
constexpr int kHoldsPerSample = 20;

/// A plant under the smooth drive or under a force held.
class DrivenSystem final : public SecondOrderSystem {
 public:
  DrivenSystem(const PlantSettings& settings, Scene scene)
      : settings_(settings),
        plant_(settings.kind.make(settings)),
        smooth_(scene == Scene::smooth),
        force_(Eigen::VectorXd::Zero(settings.arm.dof())) {
    hold(force_);
  }
  PlantSystem& plant() { return *plant_; }
  void hold(const Eigen::VectorXd& force) { plant_->drive(0.0, force, force, 0.0); }

  int size() const override { return plant_->size(); }
  void residual(double t, ConstVector x, ConstVector v, ConstVector a, Vector out) override {
    drive(t);
    plant_->residual(t, x, v, a, out);
  }
  bool acceleration(double t, ConstVector x, ConstVector v, Vector a) override {
    drive(t);
    return plant_->acceleration(t, x, v, a);
  }
  void linearize(double t, ConstVector x, ConstVector v, ConstVector a, Matrix by_a, Matrix by_v,
                 Matrix by_x) override {
    drive(t);
    plant_->linearize(t, x, v, a, by_a, by_v, by_x);
  }
  Powers powers(double t, ConstVector x, ConstVector v) override {
    drive(t);
    return plant_->powers(t, x, v);
  }

 private:
  void drive(double t) {
    if (!smooth_ || t == time_s_) return;
    time_s_ = t;
    hold(smooth_drive_nm(settings_, t));
  }

  const PlantSettings& settings_;
  std::unique_ptr<PlantSystem> plant_;
  bool smooth_;
  double time_s_ = std::numeric_limits<double>::quiet_NaN();
  Eigen::VectorXd force_;
};

template <class Solver>
void drive_through(Solver& solver, DrivenSystem& system, const PlantSettings& settings, Scene scene,
                   double duration_s, std::vector<Eigen::VectorXd>& samples) {
  const int count = static_cast<int>(std::lround(duration_s / kSample_s));
  for (int k = 0; k < count; ++k) {
    if (scene == Scene::held) {
      for (int j = 0; j < kHoldsPerSample; ++j) {
        const int tick = k * kHoldsPerSample + j;
        system.hold(smooth_drive_nm(settings, tick * kHold_s));
        solver.input_jumped();
        solver.advance((tick + 1) * kHold_s);
      }
    } else {
      solver.advance((k + 1) * kSample_s);
    }
    samples.emplace_back(solver.x());
  }
}

}  // namespace

Eigen::VectorXd smooth_drive_nm(const PlantSettings& settings, double t_s) {
  const double rise = -std::expm1(-(t_s / 0.3) * (t_s / 0.3));
  Eigen::VectorXd force(settings.arm.dof());
  for (int i = 0; i < settings.arm.size(); ++i) {
    const double phase = 2.0 * std::numbers::pi * 0.7 * t_s + i * std::numbers::pi / 3.0;
    const double moment =
        0.4 * settings.arm.segments[static_cast<std::size_t>(i)].stiffness_nm_per_rad * rise;
    const Eigen::Index first = i * settings.arm.segment_dof();
    force.segment<2>(first) << moment * std::sin(phase), moment * std::cos(phase);
    if (settings.arm.extensible) force[first + 2] = kAxialForce_n * rise * (1.0 + std::sin(phase));
  }
  return force;
}

PlantSettings bench_arm(const PlantKind& kind, MassModel mass, bool stretches) {
  PlantSettings settings;
  settings.kind = kind;
  settings.arm.mass = mass;
  settings.arm.extensible = stretches;
  settings.arm.segments.assign(3, SegmentParameters{});
  if (kind.get_if<LinkSettings>() != nullptr) {
    settings.arm.segments.assign(4, {.length_m = 0.25,
                                     .mass_kg = 0.25,
                                     .stiffness_nm_per_rad = 2.0,
                                     .damping_nms_per_rad = 0.5});
  }
  return settings;
}

std::vector<BenchPlant> bench_plants() {
  return {
      {"pcc point", bench_arm(PccSettings{}, MassModel::point)},
      {"pcc distributed", bench_arm(PccSettings{}, MassModel::distributed)},
      {"refined 3x8", bench_arm(RefinedSettings{}, MassModel::distributed)},
      {"links 4x6", bench_arm(LinkSettings{}, MassModel::distributed)},
      {"pcc that stretches", bench_arm(PccSettings{}, MassModel::distributed, true)},
      {"refined 3x8 that stretches", bench_arm(RefinedSettings{}, MassModel::distributed, true)},
      {"links 4x6 that stretch", bench_arm(LinkSettings{}, MassModel::distributed, true)}};
}

PlantRun run_plant(const PlantSettings& settings, Scene scene, const Trial& trial,
                   double duration_s) {
  DrivenSystem system(settings, scene);
  const double absolute =
      trial.absolute_tolerance > 0.0 ? trial.absolute_tolerance : 1e-2 * trial.tolerance;
  Eigen::VectorXd u = Eigen::VectorXd::Zero(2 * settings.arm.size());
  if (scene == Scene::free) {
    for (int i = 0; i < settings.arm.size(); ++i) {
      u.segment<2>(2 * i) << 0.6 * std::cos(0.7 * i), 0.6 * std::sin(0.7 * i);
    }
  }
  Eigen::VectorXd x(system.size());
  system.plant().spread(u, x);
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(x.size());
  PlantRun run;
  try {
    if (trial.plain_cvode) {
      PlainCvode solver(system, trial.tolerance, absolute, scene != Scene::held);
      const double start_s = to_seconds(thread_cpu_ns());
      solver.reset(0.0, x, rest);
      drive_through(solver, system, settings, scene, duration_s, run.samples);
      run.seconds = to_seconds(thread_cpu_ns()) - start_s;
      return run;
    }
    const auto solver =
        make_integrator(system, {.method = trial.method,
                                 .relative_tolerance = trial.tolerance,
                                 .absolute_tolerance = absolute,
                                 .absolute_tolerance_velocity = kVelocityTolerance * absolute,
                                 .max_step_s = trial.max_step_s,
                                 .smooth_input = scene != Scene::held});
    const double start_s = to_seconds(thread_cpu_ns());
    solver->reset(0.0, x, rest);
    drive_through(*solver, system, settings, scene, duration_s, run.samples);
    run.seconds = to_seconds(thread_cpu_ns()) - start_s;
    run.counters = solver->counters();
  } catch (const PlantError& error) {
    run.failure = error.cause;
  } catch (const std::runtime_error& error) {
    run.failure = error.what();
  }
  return run;
}

double largest_difference(const PlantRun& run, const PlantRun& reference) {
  if (!run.failure.empty() || run.samples.size() != reference.samples.size()) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  double largest = 0.0;
  for (std::size_t k = 0; k < run.samples.size(); ++k) {
    largest = std::max(largest, (run.samples[k] - reference.samples[k]).lpNorm<Eigen::Infinity>());
  }
  return largest;
}

}  // namespace softarm
