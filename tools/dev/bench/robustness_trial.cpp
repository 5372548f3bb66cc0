#include <algorithm>
#include <cmath>
#include <vector>

#include "dev/bench/robustness_scenes.hpp"
#include "softarm/base/clock.hpp"
#include "softarm/base/time.hpp"
#include "softarm/estimation/model_observer.hpp"
#include "softarm/model/coordinates.hpp"
#include "softarm/model/kinematics.hpp"
#include "softarm/runtime/control_pipeline.hpp"
#include "softarm/simulation/simulated_arm.hpp"

namespace softarm {
namespace {

/// False: it does not arrive. The first two seconds are without faults: the arm becomes ACTIVE.
bool passes(const FrameFaults& faults, MocapFrame& frame) {
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  if (frame.capture_ns < 2 * kSecond_ns) return true;
  const std::int64_t since_ns = frame.capture_ns % kSecond_ns;
  if (since_ns < to_ns(faults.occluded_s)) frame.body[2].valid = false;
  return since_ns >= to_ns(faults.lost_s);
}

double quantile_us(std::vector<std::int64_t>& durations_ns, double fraction) {
  const auto at = durations_ns.begin() +
                  static_cast<std::ptrdiff_t>(fraction * static_cast<double>(durations_ns.size()));
  std::nth_element(durations_ns.begin(), at, durations_ns.end());
  return 1e-3 * static_cast<double>(*at);
}

}  // namespace

RobustnessTrial run(const Experiment& asked, const RobustnessScene& scene, std::uint64_t seed) {
  Experiment e = asked;
  e.plant.seed = seed;
  ControlPipeline pipeline(e);
  SimulatedArm arm(e.plant, 0);
  const std::int64_t period_ns = pipeline.period_ns();
  const std::int64_t validity_ns = to_ns(e.safety.command_validity_s);
  std::vector<MocapFrame> frames;
  PressureVector measured, before;
  std::vector<std::int64_t> ticks_ns;
  RobustnessTrial trial;
  double u_squares = 0.0, tip_squares = 0.0, e_squares = 0.0, rate_squares = 0.0, nis = 0.0;
  std::int64_t counted = 0, surprised = 0, active_since_ns = -1;
  const double until_s = scene.counted_from_s + scene.counted_s;
  constexpr std::int64_t kPatience_ns = 10'000'000'000;
  for (std::int64_t now_ns = 0;; now_ns += period_ns) {
    if (active_since_ns < 0 ? now_ns > kPatience_ns
                            : to_seconds(now_ns - active_since_ns) > until_s)
      break;
    arm.advance_to(now_ns);
    frames.clear();
    for (MocapFrame frame; arm.receive(frame);)
      if (passes(scene.faults, frame)) frames.push_back(frame);
    measured = arm.measured_pressures_bar();
    TickInput input;
    input.now_ns = now_ns;
    input.frames = frames;
    input.newest_go_ns = input.newest_measurement_ns = now_ns;
    input.measured_bar = &measured;
    before = pipeline.output().pressure_bar;
    const std::int64_t begin_ns = monotonic_now_ns();
    const TickOutput& output = pipeline.tick(input);
    ticks_ns.push_back(monotonic_now_ns() - begin_ns);
    arm.command(output.pressure_bar, validity_ns, now_ns);
    if (output.mode != Mode::active) {
      trial.stayed_active &= active_since_ns < 0;
      continue;
    }
    if (active_since_ns < 0) active_since_ns = now_ns;
    if (to_seconds(now_ns - active_since_ns) < scene.counted_from_s) continue;
    arm.advance_to(now_ns + period_ns / 2);
    const SegmentVector u_rad = arm.plant().u_rad();
    const SegmentScalars e_m = arm.plant().elongation_m();
    const SegmentVector error = bend_part(e.arm, output.reference.u) - u_rad;
    u_squares += error.squaredNorm() / static_cast<double>(error.size());
    trial.u_largest_rad = std::max(trial.u_largest_rad, error.cwiseAbs().maxCoeff());
    const Eigen::Vector3d tip_ref = tip_position(e.arm, output.reference.u);
    tip_squares += (tip_position(e.arm, coordinates(e.arm, u_rad, e_m)) - tip_ref).squaredNorm();
    if (e.arm.extensible)
      e_squares += (stretch_part(e.arm, output.reference.u) - e_m).squaredNorm() /
                   static_cast<double>(e_m.size());
    rate_squares += ((output.pressure_bar - before) * e.rate_hz).squaredNorm() /
                    static_cast<double>(before.size());
    if (output.observer != nullptr) {
      nis += output.observer->nis();
      surprised += output.observer->surprised() ? 1 : 0;
    }
    ++counted;
  }
  trial.stayed_active &= active_since_ns >= 0;
  const double count = static_cast<double>(counted);
  trial.u_rms_rad = std::sqrt(u_squares / count);
  trial.tip_rms_m = std::sqrt(tip_squares / count);
  trial.e_rms_m = std::sqrt(e_squares / count);
  trial.pressure_rate_bar_per_s = std::sqrt(rate_squares / count);
  trial.nis = nis / count;
  trial.surprised = static_cast<double>(surprised) / count;
  trial.tick_us = quantile_us(ticks_ns, 0.5);
  trial.frame_tick_us = quantile_us(ticks_ns, 0.9);
  return trial;
}

}  // namespace softarm
