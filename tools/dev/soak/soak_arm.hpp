// The people and the references of a soak, and the account of what comes over the wire.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "dev/soak/command_steps.hpp"
#include "softarm/client/arm_client.hpp"
#include "softarm/config/experiment.hpp"
#include "softarm/control/reference.hpp"
#include "softarm/valves/valve_guard.hpp"

namespace softarm {

/// A motion through random poses, at rest in each, that repeats after `poses` of them: every
/// segment goes straight through theta = 0 on half of its ways, and rests there now and then.
ReferenceSettings random_reference(int segments, double most_theta_rad, int poses,
                                   std::uint64_t seed);

/// Belongs to one thread. While it waits it publishes references at 100 Hz, another random motion
/// from where the arm is whenever the daemon becomes ACTIVE, and the dead-man's go at 25 Hz.
class SoakArm {
 public:
  /// @throws TransportError
  explicit SoakArm(const Experiment& experiment);

  /// Handles messages and sends references and the dead-man input until `reached`, or until
  /// `patience_s` have passed. Returns whether it was reached.
  bool wait_for(const std::function<bool()>& reached, double patience_s);

  /// An operator's request, sent once.
  void request(OperatorRequest what) { client_.send(what); }
  /// The dead-man input from now on.
  enum class DeadMan { go, let_go, silent };
  void set_dead_man(DeadMan input) { dead_man_ = input; }

  Mode mode() const { return status_.mode; }
  Reason reason() const { return status_.reason; }
  const ArmStatus& status() const { return status_; }
  /// ACTIVE statuses in a row, up to the newest.
  int active_in_row() const { return active_in_row_; }
  void reset_active_count() { active_in_row_ = 0; }
  bool plant_vented() const { return client_.plant() && client_.plant()->vented; }
  /// The chamber with the highest commanded pressure, and that pressure.
  int fullest_chamber() const;
  /// Of the newest command.
  std::size_t chambers() const { return static_cast<std::size_t>(commanded_bar_.size()); }
  double fullest_bar() const;

  /// Every mode and reason since the last `forget`.
  bool saw(Mode mode, Reason reason) const { return seen_.count({mode, reason}) > 0; }
  bool left_active() const;
  bool saw(ValveReason reason) const { return seen_of_valves_.count(reason) > 0; }
  void forget();

  /// Of all daemons there were.
  std::int64_t ticks() const { return ended_.ticks + status_.tick; }
  std::int64_t overruns() const { return ended_.overruns + status_.overruns; }
  std::int64_t commands() const { return commands_; }
  std::int64_t commands_outside_limits() const { return outside_; }
  /// How often the daemon's reference of a segment went through theta = 0.
  std::int64_t straight_poses() const { return straight_poses_; }

 private:
  void take_status(const ArmStatus& newest);
  void take_command(const ChamberCommand& command);
  void speak(std::int64_t now_ns);
  void begin_motion();
  void send_reference(std::int64_t now_ns);

  ArmClient client_;
  double lowest_bar_, highest_bar_, largest_step_bar_;
  std::uint64_t seed_;
  std::optional<Reference> reference_;  ///< since the daemon has been ACTIVE for the first time
  ReferenceSample sample_;
  SegmentVector followed_rad_;  ///< the daemon's reference before
  std::int64_t next_reference_ns_, next_go_ns_, motion_began_ns_ = 0;
  DeadMan dead_man_ = DeadMan::go;
  std::set<std::pair<Mode, Reason>> seen_;
  std::set<ValveReason> seen_of_valves_;
  int active_in_row_ = 0;
  struct {
    std::int64_t ticks = 0, overruns = 0;
  } ended_;  // daemons
  std::int64_t commands_ = 0, outside_ = 0, straight_poses_ = 0;
  ArmStatus status_;
  PressureVector commanded_bar_;
  CommandSteps steps_;
};

}  // namespace softarm
