// Which command is in force at the valves, real or simulated, and until when.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>

#include "softarm/base/time.hpp"

namespace softarm {

/// Verdict of the valve side on a command.
enum class CommandVerdict {
  in_force,      ///< its set points hold until a newer command comes or it expires
  older,         ///< its sequence number is not above that of the command in force
  shadow,        ///< computed for inspection, not for the valves
  malformed,     ///< wrong number of pressures, a pressure that is not finite, or no validity
  other_sender,  ///< of another sender than the command in force: two programs command the arm
};

/// Set points for every valve, as a controller sends them.
struct PressureCommand {
  std::int64_t sequence = 0;     ///< counts up by one a command
  std::int64_t validity_ns = 0;  ///< how long it may be held after its arrival
  std::int64_t sent_us = 0;      ///< sender's clock; 0: unknown
  bool shadow = false;
  std::span<const double>
      pressure_bar;  ///< above ambient; segment by segment, in each the configured chamber order
};

/// The same rule for the sender: whether a command valid for `validity_us` from `sent_us` on has
/// expired at `now_us`, so that the valves have vented unless another command arrived. All times
/// are of one clock.
constexpr bool has_expired(std::int64_t sent_us, std::int64_t validity_us,
                           std::int64_t now_us) noexcept {
  return now_us - sent_us >= validity_us;
}

/// Whether a command with this time stamp of its sender is not of this moment, where the sender
/// reads the receiver's clock: it has expired on the way, was played from a log, or is of an
/// earlier boot. Not judged: 0, where the sender gave no time, and times of the wall clock.
inline bool is_untimely(std::int64_t sent_us, std::int64_t validity_us,
                        std::int64_t now_us) noexcept {
  constexpr std::int64_t kWallClock_us = 1'000'000'000'000'000;  // 2001; no machine runs so long
  if (sent_us == 0 || (sent_us > kWallClock_us && is_time_us(sent_us))) return false;
  return !is_time_us(sent_us) || has_expired(sent_us, validity_us, now_us) ||
         sent_us - now_us > validity_us;
}

/// Decides which command is in force, so that the arm vents by itself when its controller stops
/// sending. Reads no clock: time is an argument.
///
/// Before the first command and from the expiry of the last one on, every set point is 0 bar. After
/// an expiry a sender may restart its sequence numbers.
///
/// While a command is in force only its sender is obeyed. A sender counts up as its clock goes on;
/// what does not fit is another's: an old number with a new time, or a clock half a second off. Two
/// senders whose numbers and clocks are the same by chance are noticed when a number comes twice. A
/// packet that was overtaken on the network is late by a few numbers only. Nothing allocates or
/// throws after construction.
class CommandExpiry {
 public:
  static constexpr std::int64_t kNoSequence = -1;  ///< `sequence()` while vented

  /// @param chambers number of set points in a command, >= 0 (std::invalid_argument otherwise).
  /// @param longest_ns upper limit of a command's validity: a sender with a wrong unit must not
  /// hold the valves for minutes.
  explicit CommandExpiry(int chambers, std::int64_t longest_ns = kForever);

  /// Takes a command that arrived at `arrival_ns` (times never go back).
  CommandVerdict receive(const PressureCommand& command, std::int64_t arrival_ns) noexcept;

  /// Expires a command whose validity ended at or before `now_ns`. Returns true if this call vented
  /// the valves.
  bool update(std::int64_t now_ns) noexcept;

  /// Forgets the command in force: the valves are vented.
  void vent() noexcept;

  /// The validity that the last command taken asked for; longer than the limit: it was cut.
  std::int64_t asked_ns() const noexcept { return asked_ns_; }
  std::int64_t longest_ns() const noexcept { return longest_ns_; }
  bool vented() const noexcept { return expires_ns_ == kForever; }  ///< no command is in force
  std::int64_t expires_ns() const noexcept { return expires_ns_; }  ///< kForever while vented
  std::int64_t sequence() const noexcept { return sequence_; }      ///< of the command in force
  /// Set points in force, one per chamber (bar); zero while vented.
  const Eigen::VectorXd& set_points_bar() const noexcept { return set_points_bar_; }

 private:
  friend struct ProofOfGuard;  ///< tests/proof: all of its state

  CommandVerdict compare(const PressureCommand& command, std::int64_t arrival_ns) const noexcept;

  std::int64_t longest_ns_;
  std::int64_t expires_ns_ = kForever;
  std::int64_t sequence_ = kNoSequence;
  std::int64_t sent_us_ = 0, arrival_ns_ = 0;  ///< of the command in force
  std::int64_t asked_ns_ = 0;
  Eigen::VectorXd set_points_bar_;
};

}  // namespace softarm
