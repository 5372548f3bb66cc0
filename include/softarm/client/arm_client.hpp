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

/// A motion-capture frame as it was received; valid only during the callback.
struct CapturedFrame {
  const MocapFrame& frame;  ///< with the capture time on our clock, by daemon.capture_time
  std::int64_t arrival_ns;  ///< on our clock
  std::int64_t sender_us;   ///< time stamp of the sender
};

/// The arm in the newest frame that showed every segment.
struct SeenArm {
  std::int64_t arrival_ns = kNever, capture_ns = kNever;  ///< kNever before the first
  SegmentVector u_rad;                                    ///< 2n; empty before the first
  /// Largest theta of any segment, and largest |u'| of any segment over the last 50 ms.
  double bend_rad = 0.0, speed_radps = 0.0;
};

/// Pressures measured by the valves.
struct MeasuredPressures {
  std::int64_t arrival_ns = 0;
  PressureVector bar;  ///< of every chamber, in the order of the command
};

/// The interface of other programs to a running arm: status, frames and pressures; requests,
/// references and chamber commands. Frames are those of the experiment's motion-capture source, in
/// our world frame and SI units, with bodies in the order base, segment ends 1 .. n. Chambers are
/// counted segment by segment from the base. Threads, callbacks and clock: see OperatorClient.
///
/// Beside a softarmd that commands the arm, a client may listen, send requests and, in a `live`
/// phase, references. Commanding chambers replaces softarmd; the lock admits only one of the two.
class ArmClient : public OperatorClient {
 public:
  /// @param experiment  checked settings of the arm  @param clock  see OperatorClient
  /// @throws TransportError
  explicit ArmClient(Experiment experiment, Clock clock = monotonic_now_ns);
  /// Reads the experiment file. @throws ConfigError, TransportError
  explicit ArmClient(const std::filesystem::path& experiment);
  /// Vents to rest if it has commanded pressures that are not vented yet; blocks as long as
  /// `vent_to_rest`.
  ~ArmClient() override;

  /// The settings that the client was constructed with.
  const Experiment& experiment() const;

  // Listening. Each accessor returns the newest value received; empty, or none, before the first.

  /// The arm in the newest frame that showed every segment.
  const SeenArm& seen() const;
  /// How many messages on the motion-capture channels were not frames of the experiment's source.
  std::int64_t not_frames() const;
  /// Sets the callback for every frame, including repeated and incomplete ones.
  void on_frame(std::function<void(const CapturedFrame&)> callback);

  /// Pressures measured by the valves.
  const std::optional<MeasuredPressures>& measured() const;
  /// Sets the callback for every measurement.
  void on_measured(std::function<void(const MeasuredPressures&)> callback);
  /// Status of the driver of a valve terminal (softarm-valves).
  const std::optional<ValvesStatus>& valves() const;
  /// True state of a simulated arm (softarm-plant).
  const std::optional<PlantState>& plant() const;
  /// Sets the callback for every state of a simulated arm.
  void on_plant(std::function<void(const PlantState&)> callback);

  /// The newest command of any program, including ours and those of a shadow.
  const std::optional<ChamberCommand>& command() const;
  /// Sets the callback for every command.
  void on_command(std::function<void(const ChamberCommand&)> callback);
  /// Which other program commands the arm, as a sentence for a person. Empty if there is none:
  /// within the last second no command for the valves came from another program, and no daemon was
  /// armed.
  std::string other_commander() const;

  // References, for a softarmd whose phase is `live`.

  /// Sends a reference: u, u' and u'' with 2n numbers each, in rad, rad/s and rad/s^2, valid from
  /// its arrival: the daemon extrapolates it for the timeout_s of the phase and then rests at u.
  /// The daemon refuses a reference beyond control.max_theta_rad or max_speed_radps, or farther
  /// than max_step_rad from its current one, and reports that as status()->reference_limited. Does
  /// not block.
  /// @throws std::invalid_argument for a wrong size or a number that is not finite; TransportError
  void send_reference(ConstVectorRef u_rad, ConstVectorRef velocity_radps,
                      ConstVectorRef acceleration_radps2);

  /// Sends a target of the tip (world frame, m and m/s) for a phase of kind live_tip. Does not
  /// block. @throws std::invalid_argument for a number that is not finite; TransportError
  void send_tip_target(const Eigen::Vector3d& position_m,
                       const Eigen::Vector3d& velocity_mps = Eigen::Vector3d::Zero());

  // A control law of one's own, for a softarmd with control.law: external.

  /// What the law is to answer, the newest.
  const std::optional<LawRequest>& law_request() const;
  /// Sets the callback for every one of them.
  void on_law_request(std::function<void(const LawRequest&)> callback);
  /// Answers it: with a generalized force in u (2n, N m), or with set points of all chambers (bar).
  /// The daemon holds an answer for `validity_s` from the state that it answers, at most for
  /// daemon.safety.law_validity_s; without a newer one it goes to HOLD and then to VENT. What it
  /// refused, and why, is in status()->law_answers. Does not block.
  /// @throws std::invalid_argument for a wrong size or a number that is not finite; TransportError
  void answer_force(const LawRequest& request, ConstVectorRef force_nm, double validity_s = 0.05);
  void answer_pressures(const LawRequest& request, ConstVectorRef pressure_bar,
                        double validity_s = 0.05);

  // Commands to the chambers, in place of softarmd.

  /// Takes the lock on the command channel of this machine, which softarmd also takes, until the
  /// client is destroyed. It does not exclude programs on other machines; `other_commander` reports
  /// those after some time of listening.
  /// @throws OtherInstance; std::logic_error where actuation is by torque, or if this client holds
  /// the lock already
  void lock_commands();
  /// Moves every set point towards `wanted_bar` (one per chamber, bar), within the limits of
  /// pressure and slew rate and at most at `rate_bar_per_s`, and sends the set points when they are
  /// due, 100 times a second. A pause is not caught up with. A command is valid for
  /// daemon.lcm.command_validity_s: the valves vent by themselves when it expires, and set points
  /// then begin at zero again. Does not block.
  /// @throws std::logic_error without the lock; std::invalid_argument for a wrong size (a number
  /// that is not finite leaves its chamber unchanged); TransportError
  void command_chambers(const PressureVector& wanted_bar,
                        double rate_bar_per_s = std::numeric_limits<double>::infinity());
  /// As `command_chambers` towards 0 bar, at actuation.vent_bar_per_s.
  void vent();
  /// Vents completely and then commands 0 bar for one more second; messages are handled meanwhile.
  /// Blocks. Does nothing without the lock.
  void vent_to_rest();
  /// Current set points in bar, one per chamber; zero before the first command.
  const PressureVector& set_points_bar() const;
  /// When the newest command was sent; kNever before the first.
  std::int64_t sent_ns() const;
  /// When the next command is due.
  std::int64_t next_command_ns() const;
  /// Whether some command was sent only after its predecessor had expired: the valves vented in
  /// between, and the later motion of the arm is not a response to the commands alone.
  bool held_up() const;
  /// The same as a sentence for a person.
  static constexpr const char* kHeldUp =
      "this program was held up for longer than daemon.lcm.command_validity_s, so the valves "
      "vented";

 private:
  void after_round() override;
  void send_command();
  void answer(const LawRequest& request, std::int8_t answer, ConstVectorRef values, int expected,
              double validity_s);

  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace softarm
