// A running arm, real or simulated, from another program: listen, command, arm, record.
//
//   ArmClient arm("config/one_segment_live.yaml");
//   if (arm.request(OperatorRequest::arm) != RequestOutcome::done) return 1;
//   while (arm.wait_for_status(1.0)) {
//     std::cout << arm.status()->text() << " " << arm.status()->u_rad.transpose() << "\n";
//     arm.send_reference(u_rad, velocity_radps, acceleration_radps2);
//   }
#pragma once

#include <filesystem>
#include <limits>
#include <memory>

#include "softarm/client/operator_client.hpp"
#include "softarm/client/valves_status.hpp"
#include "softarm/config/experiment.hpp"
#include "softarm/estimation/mocap_frame.hpp"
#include "softarm/model/arm.hpp"

namespace softarm {

/// A motion-capture frame as it came; valid only during the callback.
struct CapturedFrame {
  const MocapFrame& frame;  ///< capture time on our clock, as daemon.capture_time lets us know it
  std::int64_t arrival_ns;  ///< our clock
  std::int64_t sender_us;   ///< the sender's stamp
};

/// The arm in the newest frame that showed every segment.
struct SeenArm {
  std::int64_t arrival_ns = kNever, capture_ns = kNever;  ///< kNever before the first
  SegmentVector u_rad;                                    ///< 2n; empty before the first
  /// Largest theta of a segment, and the fastest |u'| of a segment over the last 50 ms.
  double bend_rad = 0.0, speed_radps = 0.0;
};

/// Pressures as the valve side measured them.
struct MeasuredPressures {
  std::int64_t arrival_ns = 0;
  PressureVector bar;  ///< every chamber, order of the command
};

/// Frames are those of the experiment's motion-capture source, in our world and SI units, bodies in
/// the order base, segment ends 1 .. n. Chambers count segment by segment from the base. Threads,
/// callbacks and clock as OperatorClient says.
///
/// Beside a softarmd that commands the arm: listening, requests and, in a phase that is `live`,
/// references. Commanding chambers replaces softarmd; the lock admits one of the two.
class ArmClient : public OperatorClient {
 public:
  /// @throws TransportError
  explicit ArmClient(Experiment experiment, Clock clock = monotonic_now_ns);
  /// @throws ConfigError, TransportError
  explicit ArmClient(const std::filesystem::path& experiment);
  /// Vents to rest where it has commanded pressures that are not vented yet; this blocks for as
  /// long as `vent_to_rest`.
  ~ArmClient() override;

  const Experiment& experiment() const;

  // Listening. Everything is the newest that came; empty, or none, before the first.

  const SeenArm& seen() const;
  /// Messages on the channels of motion capture that were none of the experiment's source.
  std::int64_t not_frames() const;
  /// Called with every frame, also with one that repeats the last or does not show every segment.
  void on_frame(std::function<void(const CapturedFrame&)> callback);

  const std::optional<MeasuredPressures>& measured() const;
  void on_measured(std::function<void(const MeasuredPressures&)> callback);
  /// Of the driver of a valve terminal (softarm-valves).
  const std::optional<ValvesStatus>& valves() const;
  /// Of a simulated arm (softarm-plant).
  const std::optional<PlantState>& plant() const;
  void on_plant(std::function<void(const PlantState&)> callback);

  /// The newest command of anybody, ours and a shadow's included.
  const std::optional<ChamberCommand>& command() const;
  void on_command(std::function<void(const ChamberCommand&)> callback);
  /// Who else commands the arm, as a sentence for a person; empty where nobody does: within the
  /// last second no command came that is for the valves and not ours, and no daemon was armed.
  std::string other_commander() const;

  // References, for a softarmd whose phase is `live`.

  /// 2n numbers each, rad, rad/s, rad/s^2, valid from the arrival on: the daemon extrapolates for
  /// the phase's timeout_s and then rests at u. It refuses what is beyond control.max_theta_rad or
  /// max_speed_radps, or farther than max_step_rad from its reference so far:
  /// status()->reference_limited. Does not block.
  /// @throws std::invalid_argument for another size or a number that is not finite; TransportError
  void send_reference(ConstVectorRef u_rad, ConstVectorRef velocity_radps,
                      ConstVectorRef acceleration_radps2);

  // Commands to the chambers, in place of softarmd.

  /// Takes the lock that softarmd holds on the command channel of this machine, until the client is
  /// destroyed. Who commands from another machine shows in `other_commander`: listen for a while.
  /// @throws OtherInstance; std::logic_error where actuation is by torque, or it is taken already
  void lock_commands();
  /// Moves every set point towards `wanted_bar` (one a chamber, bar), within the limits of pressure
  /// and slew, at most at `rate_bar_per_s`, and sends them when they are due, 100 times a second.
  /// No step makes up for a pause. What was sent is valid for safety.command_validity_s: the valves
  /// vent by themselves when it expires, and set points then begin at zero again. Does not block.
  /// @throws std::logic_error without the lock; std::invalid_argument for another size (a number
  /// that is not finite leaves its chamber as it is); TransportError
  void command_chambers(const PressureVector& wanted_bar,
                        double rate_bar_per_s = std::numeric_limits<double>::infinity());
  /// The same towards 0 bar, at actuation.vent_bar_per_s.
  void vent();
  /// Vents to the end and goes on commanding 0 bar for a second; messages are handled meanwhile.
  /// Blocks. Does nothing without the lock.
  void vent_to_rest();
  /// Set points now; zero before the first command.
  const PressureVector& set_points_bar() const;
  /// When the newest command was sent (kNever before), and when the next is due.
  std::int64_t sent_ns() const;
  std::int64_t next_command_ns() const;
  /// A command came after the one before it had expired: the valves have vented meanwhile, and what
  /// the arm did since is no answer to what was commanded.
  bool held_up() const;
  static constexpr const char* kHeldUp =
      "this program was held up for longer than daemon.lcm.command_validity_s, so the valves "
      "vented";

 private:
  void after_round() override;
  void send_command();

  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace softarm
