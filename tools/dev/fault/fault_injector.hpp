// Faults of motion capture and of the valves' read-back, made on the way from sender to daemon.
#pragma once

#include <cstdint>
#include <deque>
#include <limits>
#include <optional>
#include <softarm_messages/mocap_frame_t.hpp>
#include <softarm_messages/pressure_measurement_t.hpp>
#include <span>
#include <string>
#include <vector>

#include "softarm/base/time.hpp"

namespace softarm {

/// What may happen to messages. `Fault::amount` is a number of the unit that `fault_list` names.
enum class FaultKind {
  none,
  stop,        ///< no frame goes through
  occlude,     ///< `body` is not seen
  nan,         ///< a coordinate of `body` is not a number
  inf,         ///< a coordinate of `body` is infinite
  quaternion,  ///< the quaternion of `body` is not of unit length
  length,      ///< `body` is moved along the world's x axis
  jump,        ///< every other frame the end of the arm bends to another side
  swap,        ///< `body` and the next one exchange their ids
  duplicate,   ///< every frame comes twice
  reorder,     ///< of every two frames the second comes first
  restart,     ///< numbers begin again at 1, once
  delay,       ///< frames come late
  freeze,      ///< poses repeat, numbers and times go on
  clock,       ///< the sender's clock is set
  silence,     ///< no measured pressure goes through
  burst,       ///< chamber `body` shows no pressure
  mirror,      ///< the world's y is reversed in positions alone
  leak,        ///< chamber `body` shows a part less pressure than it has
  stale,       ///< `body` repeats its last pose, still valid
  turn,        ///< `body` is recognised turned about its own axis
  stick        ///< chamber `body` repeats its last measurement
};

struct Fault {
  FaultKind kind = FaultKind::none;
  int body = 1;  ///< which one, in the order of the message; or which chamber
  double amount = 0.0;
};

/// A fault as a person chooses it.
struct FaultDescription {
  const char* name;
  FaultKind kind;
  const char* what;      ///< happens
  const char* amount;    ///< what the number means, with its unit; "" where there is none
  double usual;          ///< amount where none is given
  const char* reaction;  ///< of the daemon
};
std::span<const FaultDescription> fault_list();

/// The fault of this name with its usual amount, if there is one.
std::optional<Fault> find_fault(const std::string& name);

/// Pure: time is an argument, in ns of one monotonic clock.
class FaultInjector {
 public:
  /// From the next message on.
  void set(const Fault& fault);

  /// Takes a frame as it was sent.
  void take(const softarm_messages::mocap_frame_t& frame, std::int64_t now_ns);
  /// The next frame that is due by `now_ns`, corrupted; false where there is none.
  bool next(std::int64_t now_ns, softarm_messages::mocap_frame_t& frame);
  /// When the next one is due; kForever where none waits.
  std::int64_t next_due_ns() const;

  /// Corrupts measured pressures; false: they do not go through.
  bool pass(softarm_messages::pressure_measurement_t& measurement);

 private:
  struct Waiting {
    softarm_messages::mocap_frame_t frame;
    std::int64_t due_ns;
  };
  void corrupt_body(softarm_messages::mocap_body_t& body) const;
  void bend_to_other_side(softarm_messages::mocap_frame_t& frame) const;
  void corrupt_poses(softarm_messages::mocap_frame_t& frame);

  Fault fault_;
  std::deque<Waiting> waiting_;
  std::optional<softarm_messages::mocap_frame_t> kept_;  // frozen, or overtaken
  std::optional<float> kept_pressure_;
  std::int64_t number_offset_ = 0, newest_number_ = 0;
  bool restart_ = false;
  std::int64_t taken_ = 0;
};

}  // namespace softarm
