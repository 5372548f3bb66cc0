// softarm run: the daemon's pipeline and the simulated arm in one process, in lock step, as fast as
// the machine allows.
#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <vector>

#include "experiment_log.hpp"
#include "program.hpp"
#include "progress.hpp"
#include "softarm/commands.hpp"
#include "softarm/config/load.hpp"
#include "softarm/daemon/control_pipeline.hpp"
#include "softarm/daemon/realtime.hpp"
#include "softarm/model/kinematics.hpp"
#include "softarm/plant/simulated_arm.hpp"

namespace softarm {
namespace {

struct RunOptions {
  std::string config;
  std::string out = "out";
  double duration_s = 0.0;
  std::uint64_t seed = 0;
  bool has_seed = false;
};

/// Pipeline and plant in lock step: ticks at whole periods, everything else at its own time between
/// them.
class LockStep {
 public:
  explicit LockStep(const Experiment& experiment)
      : experiment_(experiment), pipeline_(experiment), arm_(experiment.plant, 0) {}

  /// One tick at the next period; leaves the plant, and the row, in the middle of the period: there
  /// the reference of that tick belongs.
  void step(LogRow& row) {
    const std::int64_t now_ns = ticks_++ * pipeline_.period_ns();
    arm_.advance_to(now_ns);
    frames_.clear();
    for (MocapFrame frame; arm_.receive(frame);) frames_.push_back(frame);

    const std::int64_t before_ns = monotonic_now_ns();
    TickInput input;
    input.now_ns = now_ns;
    input.frames = frames_;
    const TickOutput& output = pipeline_.tick(input);
    tick_.add_ns(monotonic_now_ns() - before_ns);

    pressures_.assign(output.pressure_bar.begin(), output.pressure_bar.end());
    arm_.command({.sequence = ticks_,
                  .validity_ns = std::llround(1e9 * experiment_.daemon.lcm.command_validity_s),
                  .shadow = false,
                  .pressure_bar = pressures_},
                 now_ns);
    arm_.advance_to(now_ns + pipeline_.period_ns() / 2);
    fill(row);
  }

  const ControlPipeline& pipeline() const { return pipeline_; }
  const DurationHistogram& tick_times() const { return tick_; }

 private:
  void fill(LogRow& row) {
    const TickOutput& output = pipeline_.output();
    const CurvatureEstimate& estimate = pipeline_.estimate();
    const int n = experiment_.arm.size();
    row.t_s = 1e-9 * static_cast<double>(arm_.time_ns());
    row.mode = output.mode;
    row.reason = output.reason;
    row.saturated = output.saturated;
    row.frame_age_s = output.frame_age_s;
    row.u = output.motion.u_rad;
    row.velocity = output.motion.velocity_radps;
    row.reference = output.reference.u;
    row.truth = arm_.plant().u_rad();
    row.tau_actuation = output.tau_actuation_nm;
    row.residual_twist = Eigen::Map<const Eigen::VectorXd>(estimate.twist_rad.data(), n);
    row.residual_length = Eigen::Map<const Eigen::VectorXd>(estimate.length_error_m.data(), n);
    row.commanded = output.pressure_bar;
    row.real = arm_.measured_pressures_bar();
    row.tip = arm_.plant().tip_m();
    row.tip_reference.reset();
    if (row.reference.size() > 0) row.tip_reference = tip_position(experiment_.arm, row.reference);
  }

  const Experiment& experiment_;
  ControlPipeline pipeline_;
  SimulatedArm arm_;
  std::vector<MocapFrame> frames_;
  std::vector<double> pressures_;
  std::int64_t ticks_ = 0;
  DurationHistogram tick_;
};

int run(const RunOptions& options) {
  Experiment experiment = load_experiment(options.config);
  if (options.has_seed) experiment.seed = experiment.plant.seed = options.seed;
  const double duration_s =
      options.duration_s > 0.0 ? options.duration_s : experiment.run.duration_s;

  auto lock_step = std::make_unique<LockStep>(experiment);
  ExperimentLog log(options.out, experiment);
  TrackingSummary summary(experiment.arm.size(), experiment.run.tracking_from_s);
  const double period_s = 1.0 / experiment.daemon.rate_hz;
  const auto ticks = static_cast<std::int64_t>(std::llround(duration_s / period_s));
  LogRow row;
  std::int64_t simulation_ns = 0;
  {
    Progress progress;
    for (std::int64_t k = 0; k < ticks; ++k) {
      const std::int64_t before_ns = monotonic_now_ns();
      lock_step->step(row);
      simulation_ns += monotonic_now_ns() - before_ns;
      log.add(row);
      summary.add(row, period_s);
      if (progress.due())
        progress.update(
            fmt::format("{:.1f} of {:.1f} s simulated, {}", row.t_s, duration_s, name(row.mode)));
    }
  }
  log.close();
  const std::filesystem::path out(options.out);
  write_text(out / "summary.json", summary.json());
  const double factor =
      1e9 * duration_s / static_cast<double>(std::max<std::int64_t>(1, simulation_ns));
  const DurationHistogram& tick = lock_step->tick_times();
  write_text(out / "timing.json",
             timing_json({.real_time_factor = factor,
                          .histograms = {{"tick_us", tick.counts(), tick.max_us()}}}));
  fmt::print("{}{:.0f} times faster than real time; log, summary and timing are in {}\n",
             summary.table(), factor, options.out);
  return kExitOk;
}

}  // namespace

void add_run_command(CLI::App& app) {
  auto options = std::make_shared<RunOptions>();
  CLI::App* command =
      app.add_subcommand("run", "Run an experiment on the simulated arm, faster than real time");
  command->add_option("CONFIG", options->config, "experiment in YAML")->required();
  command
      ->add_option("--out", options->out, "folder for log.csv, summary.json, timing.json and plots")
      ->capture_default_str();
  command
      ->add_option("--duration", options->duration_s,
                   "simulated time in s (default: run.duration_s)")
      ->check(CLI::PositiveNumber);
  auto* seed = command->add_option("--seed", options->seed,
                                   "seed of noise and dropouts (default: the configuration's)");
  command->callback([options, seed] {
    options->has_seed = seed->count() > 0;
    if (const int code = run(*options); code != kExitOk) throw CLI::RuntimeError(code);
  });
}

}  // namespace softarm
