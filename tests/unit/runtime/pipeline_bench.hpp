// The pipeline with an ideal arm around it: the arm is where the reference says, motion capture
// sees it exactly, and a test may corrupt any frame on its way.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <functional>
#include <span>

#include "milliseconds.hpp"
#include "softarm/base/time.hpp"
#include "softarm/config/load.hpp"
#include "softarm/model/kinematics.hpp"
#include "softarm/runtime/control_pipeline.hpp"

namespace softarm::test {

inline Experiment paper_arm() {
  return load_experiment(SOFTARM_SOURCE_DIR "/config/paper_arm.yaml");
}

/// 500 Hz ticks and 200 Hz frames of 5 ms latency, as config/paper_arm.yaml has them.
class PipelineBench {
 public:
  explicit PipelineBench(const Experiment& experiment)
      : arm(experiment.arm),
        pipeline(experiment),
        u(SegmentVector::Zero(arm.dof())),
        validity_ns(to_ns(experiment.safety.command_validity_s)) {}

  /// One period: the arm moves, motion capture looks, the pipeline acts.
  const TickOutput& tick() {
    now_ns += pipeline.period_ns();
    move();
    if (now_ns >= next_capture_ns) capture();
    deliver();
    input.command_expired = now_ns - sent_ns >= validity_ns;
    if (sends) sent_ns = now_ns;
    input.now_ns = now_ns;
    input.frames = {arrived.data(), count};
    if (valves_publish) publish_pressures();
    if (going) input.newest_go_ns = now_ns;
    const TickOutput& output = pipeline.tick(input);
    input.requests.arm = input.requests.disarm = input.requests.emergency_stop = false;
    input.reference = nullptr;
    input.measured_bar = nullptr;
    return output;
  }
  const TickOutput& run(int ticks) {
    for (int k = 0; k < ticks; ++k) tick();
    return pipeline.output();
  }
  /// Until `mode`, for at most `patience` ticks; the ticks it took, or -1.
  int run_to(Mode mode, int patience = 2000) {
    for (int k = 1; k <= patience; ++k)
      if (tick().mode == mode) return k;
    return -1;
  }

  /// An exact frame of the arm as it is, with the next number.
  MocapFrame exact_frame() {
    MocapFrame frame;
    frame.frame_number = next_number++;
    frame.capture_ns = now_ns;
    frame.segments = arm.size();
    frame.body[0] = {arm.base_position_m, Eigen::Quaterniond(arm.base_rotation), true};
    std::array<Eigen::Isometry3d, kMaxSegments> ends;
    forward_kinematics(arm, u, {ends.data(), arm.segments.size()});
    for (std::size_t i = 0; i < arm.segments.size(); ++i)
      frame.body[i + 1] = {ends[i].translation(), Eigen::Quaterniond(ends[i].linear()), true};
    return frame;
  }
  void send(const MocapFrame& frame, std::int64_t after_ns) {
    if (in_flight == flight.size()) return;
    flight[in_flight++] = {frame, frame.capture_ns + after_ns};
  }

  const ArmParameters arm;
  ControlPipeline pipeline;
  SegmentVector u;
  std::int64_t validity_ns;
  std::int64_t now_ns = 1'000'000'000;
  std::int64_t next_capture_ns = now_ns;
  std::int64_t next_number = 1;
  TickInput input;
  bool publishing = true;
  bool moves = true;  ///< false: the arm stays where it is, whatever is commanded
  std::int64_t frame_period_ns = 5 * kMs;
  std::int64_t latency_ns = 5 * kMs;
  std::span<const MocapFrame> delivered() const { return {arrived.data(), count}; }

  bool valves_publish = true;  ///< pressures, 10 ms behind the commands
  bool going = true;           ///< the dead-man switch is held
  bool sends = true;           ///< commands reach the valves
  std::int64_t sent_ns = 0;    ///< the newest that did
  /// Corrupts what the valves measured.
  std::function<void(PressureVector&)> leak;
  /// Corrupts a frame before it is sent; returns whether to send it.
  std::function<bool(MocapFrame&)> corrupt;

 private:
  struct Flying {
    MocapFrame frame;
    std::int64_t arrival_ns;
  };

  void move() {
    const TickOutput& output = pipeline.output();
    if (!moves) return;
    if (output.mode == Mode::active && output.reference.u.size() == u.size()) {
      u = output.reference.u;
    } else if (output.mode != Mode::hold) {
      u *= 0.99;  // vented, it relaxes
    }
  }
  void capture() {
    next_capture_ns += frame_period_ns;
    MocapFrame frame = exact_frame();
    // The least movement, so that an arm at rest is not taken for a frozen sensor.
    frame.body[0].position_m.x() += frame.frame_number % 2 == 0 ? 1e-7 : -1e-7;
    if (publishing && (!corrupt || corrupt(frame))) send(frame, latency_ns);
  }
  void publish_pressures() {
    const PressureVector& commanded = pipeline.output().pressure_bar;
    if (real_bar.size() == 0) real_bar = PressureVector::Zero(commanded.size());
    const double part = 1.0 - std::exp(-to_seconds(pipeline.period_ns()) / 0.01);
    real_bar += part * (commanded - real_bar);
    measured_bar = real_bar;
    if (leak) leak(measured_bar);
    input.measured_bar = &measured_bar;
    input.newest_measurement_ns = now_ns;
  }
  void deliver() {
    count = 0;
    std::size_t kept = 0;
    for (std::size_t k = 0; k < in_flight; ++k) {
      if (flight[k].arrival_ns <= now_ns) {
        arrived[count++] = flight[k].frame;
      } else {
        if (kept != k) flight[kept] = flight[k];
        ++kept;
      }
    }
    in_flight = kept;
  }

  std::array<Flying, 64> flight;
  std::array<MocapFrame, 64> arrived;
  std::size_t in_flight = 0, count = 0;
  PressureVector real_bar, measured_bar;
};

/// What must hold in every tick, whatever happens: finite pressures within their limits, and no
/// step faster than the slew limit, or than the vent rate while venting.
class PressureLimits {
 public:
  explicit PressureLimits(const Experiment& experiment)
      : settings_(experiment.actuation), period_s_(1.0 / experiment.rate_hz) {}

  /// Empty, or what is wrong; `expired`: the command before, so the valves have vented.
  const char* violation(const TickOutput& output, bool expired = false) {
    const PressureVector& now = output.pressure_bar;
    const char* wrong = "";
    if (before_.size() == 0 || expired) before_ = PressureVector::Zero(now.size());
    const double rate =
        output.mode == Mode::active ? settings_.slew_bar_per_s : settings_.vent_bar_per_s;
    for (Eigen::Index j = 0; j < now.size(); ++j) {
      const double step = now[j] - before_[j];
      if (!std::isfinite(now[j])) wrong = "a pressure is not finite";
      if (now[j] > settings_.max_pressure_bar) wrong = "a pressure is above its limit";
      if (now[j] < 0.0) wrong = "a pressure is below ambient";
      if (std::abs(step) > rate * period_s_ * (1.0 + 1e-12)) wrong = "a step is too fast";
      if (output.mode == Mode::hold && step != 0.0) wrong = "a pressure moves in HOLD";
      if (output.mode != Mode::active && step > 0.0) wrong = "a pressure rises outside of ACTIVE";
    }
    before_ = now;
    return wrong;
  }

 private:
  ActuationSettings settings_;
  double period_s_;
  PressureVector before_;
};

}  // namespace softarm::test
