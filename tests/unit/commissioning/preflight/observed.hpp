// What would be seen of a simulated arm: at rest, and while its chambers are filled. The arm moves
// by the plant's dynamics, which the checks do not use.
#pragma once

#include <functional>
#include <string>

#include "milliseconds.hpp"
#include "softarm/commissioning/preflight/checks.hpp"
#include "softarm/simulation/simulated_arm.hpp"

namespace softarm::test {

inline constexpr std::int64_t kWall_ns = 1'700'000'000'000'000'000;

/// A hanging arm with four chambers a segment, and what the checks are given of it.
inline Experiment hanging_arm(int segments) {
  Experiment experiment;
  experiment.arm.segments.assign(static_cast<std::size_t>(segments), {0.11, 0.15, 0.626, 0.029});
  experiment.actuation.segments.assign(
      static_cast<std::size_t>(segments),
      {{0.0, 0.839}, {M_PI / 2, 0.839}, {M_PI, 0.839}, {1.5 * M_PI, 0.839}});
  experiment.transport.bodies.base_id = 0;
  for (int i = 1; i <= segments; ++i) experiment.transport.bodies.segment_ids.push_back(i);
  for (int k = 0; k < 4 * segments; ++k) experiment.valves.order.push_back(k);
  experiment.safety.frame_period_s = 0.005;
  experiment.safety.frame_latency_s = 0.005;
  experiment.estimation.position_noise_m = 0.2e-3;
  experiment.estimation.orientation_noise_rad = 3.5e-3;
  PlantSettings& plant = experiment.plant;
  plant.arm = experiment.arm;
  plant.actuation = experiment.actuation;
  plant.valves.lag_s = 0.02;
  plant.mocap = {.rate_hz = 200.0,
                 .latency_s = 0.005,
                 .position_noise_m = 0.2e-3,
                 .orientation_noise_rad = 3.5e-3};
  plant.initial_u_rad.setZero(2 * segments);
  return experiment;
}

class Observer {
 public:
  explicit Observer(const Experiment& truth) : truth_(truth), arm_(truth.plant, 0) {}

  /// Two seconds at rest after two of settling, then a pulse on every chamber if `pulses`.
  Observation observe(bool pulses) {
    const int chambers = static_cast<int>(arm_.measured_pressures_bar().size());
    run(2000 * kMs);  // to settle
    seen_ = {};
    seen_.channels = {"SOFTARM_MOCAP"};
    seen_.start_ns = now_ns_;
    seen_.wall_minus_ns = kWall_ns;
    run(2000 * kMs);
    seen_.rest_end_ns = now_ns_;
    command_bar_.assign(static_cast<std::size_t>(chambers), 0.0);
    int valve = 0;
    for (int i = 0; pulses && i < truth_.arm.size(); ++i)
      for (int j = 0; j < 4; ++j, ++valve) {
        Pulse pulse{.segment = i, .chamber = j, .valve = valve, .pressure_bar = 0.11};
        pulse.before_ns = now_ns_;
        run(200 * kMs);
        pulse.start_ns = now_ns_;
        command_bar_[static_cast<std::size_t>(valve)] = pulse.pressure_bar;
        run(400 * kMs);
        pulse.held_ns = now_ns_;
        run(200 * kMs);
        pulse.end_ns = now_ns_;
        command_bar_[static_cast<std::size_t>(valve)] = 0.0;
        run(400 * kMs);
        seen_.pulses.push_back(pulse);
      }
    return seen_;
  }

 private:
  void run(std::int64_t time_ns) {
    for (const std::int64_t end_ns = now_ns_ + time_ns; now_ns_ < end_ns;) {
      now_ns_ += 5 * kMs;
      if (!command_bar_.empty())
        arm_.command(
            {.sequence = ++sequence_, .validity_ns = 100 * kMs, .pressure_bar = command_bar_},
            now_ns_);
      arm_.advance_to(now_ns_);
      const auto n = static_cast<std::size_t>(truth_.arm.size());
      for (MocapFrame frame; arm_.receive(frame);)
        seen_.frames.push_back({frame.capture_ns + 5 * kMs,
                                (frame.capture_ns + kWall_ns) / 1000,
                                frame.frame_number,
                                {frame.body.begin(), frame.body.begin() + n + 1},
                                {}});
      const Eigen::VectorXd& bar = arm_.measured_pressures_bar();
      seen_.pressures.push_back({now_ns_, {bar.begin(), bar.end()}});
    }
  }

  const Experiment& truth_;
  SimulatedArm arm_;
  Observation seen_;
  std::int64_t now_ns_ = 0, sequence_ = 0;
  std::vector<double> command_bar_;
};

inline Observation observed(const Experiment& truth, bool pulses = false) {
  return Observer(truth).observe(pulses);
}

inline void for_each_body(Observation& seen, const std::function<void(BodyPose&)>& corrupt) {
  for (SeenFrame& frame : seen.frames)
    for (BodyPose& body : frame.body) corrupt(body);
}

/// What x, y, z, w makes of numbers that were read as w, x, y, z.
inline BodyPose scalar_last(BodyPose body) {
  const Eigen::Quaterniond q = body.orientation;
  const double sent[4] = {q.w(), q.x(), q.y(), q.z()};
  body.orientation = Eigen::Quaterniond(sent[3], sent[0], sent[1], sent[2]);
  return body;
}

/// All checks, as the listener would call them with the order w, x, y, z configured.
inline std::vector<Finding> checked(const Experiment& experiment, Observation seen) {
  for (SeenFrame& frame : seen.frames) {
    frame.in_other_order.clear();
    for (const BodyPose& body : frame.body) frame.in_other_order.push_back(scalar_last(body));
  }
  return preflight(experiment, seen);
}

inline Finding finding(const std::vector<Finding>& all, const std::string& check) {
  for (const Finding& each : all)
    if (each.check == check) return each;
  return {};
}

}  // namespace softarm::test
