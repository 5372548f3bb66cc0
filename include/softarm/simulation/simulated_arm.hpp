// All that replaces the hardware: valves that vent when their commands expire, the arm, and motion
// capture.
#pragma once

#include <cstdint>
#include <vector>

#include "softarm/actuation/command_expiry.hpp"
#include "softarm/actuation/pressure_allocator.hpp"
#include "softarm/base/time.hpp"
#include "softarm/simulation/arm_plant.hpp"
#include "softarm/simulation/mocap_simulator.hpp"
#include "softarm/simulation/settings.hpp"

namespace softarm {

/// The simulated arm as its controller meets it, in lock step and in real time alike. Time is an
/// argument, in nanoseconds of whichever monotonic clock the caller uses; it never goes back.
///
///     SimulatedArm arm(settings, now);
///     arm.command(command, now);         // as it arrives
///     arm.advance_to(now);               // captures and expiries on the way at their own times
///     while (arm.receive(frame)) { ... } // what has arrived by now
///
/// Same settings, same calls: same bits.
class SimulatedArm {
 public:
  /// At rest, without pressure, vented; the first frame is captured at `start_ns`. No command is
  /// valid for longer than `longest_validity_ns`.
  /// @throw std::invalid_argument as ArmPlant and MocapSimulator.
  SimulatedArm(const PlantSettings& settings, std::int64_t start_ns,
               std::int64_t longest_validity_ns = kForever);

  /// Takes a command that arrives at `arrival_ns`, first letting time pass until then. @throw
  /// PlantError.
  CommandVerdict command(const PressureCommand& command, std::int64_t arrival_ns);
  /// The same for set points (bar, one a chamber) that follow those before in one process.
  CommandVerdict command(const PressureVector& pressure_bar, std::int64_t validity_ns,
                         std::int64_t arrival_ns);

  /// Lets time pass until `now_ns`; a time that has passed already changes nothing.
  /// @throw PlantError if the integrator fails; time then stands at the last event before.
  void advance_to(std::int64_t now_ns);

  /// The oldest frame that has arrived by `time_ns()` and was not fetched yet, if any.
  bool receive(MocapFrame& frame) noexcept { return mocap_.receive(now_ns_, frame); }

  /// When something happens next by itself: a capture, the arrival of a frame, the expiry of the
  /// command in force.
  std::int64_t next_event_ns() const noexcept;

  std::int64_t time_ns() const noexcept { return now_ns_; }
  bool vented() const noexcept { return expiry_.vented(); }
  /// Of the command in force, CommandExpiry::kNoSequence while vented.
  std::int64_t sequence() const noexcept { return expiry_.sequence(); }
  /// What pressure sensors behind the valves read now.
  const Eigen::VectorXd& measured_pressures_bar() const noexcept { return plant_.pressures_bar(); }

  const ArmPlant& plant() const noexcept { return plant_; }
  const MocapSimulator& mocap() const noexcept { return mocap_; }

 private:
  void advance_plant(std::int64_t t_ns);

  std::int64_t start_ns_;
  std::int64_t now_ns_;
  ArmPlant plant_;
  CommandExpiry expiry_;
  MocapSimulator mocap_;
  std::vector<Eigen::Isometry3d> segment_ends_;
};

}  // namespace softarm
