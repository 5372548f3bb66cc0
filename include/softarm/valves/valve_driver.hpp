// Commands to valves: the guard decides, a back end acts. No LCM here.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "softarm/base/clock.hpp"
#include "softarm/valves/valve_backend.hpp"
#include "softarm/valves/valve_guard.hpp"

namespace softarm {

/// Belongs to one thread. Once a cycle: `wake`, the commands that came, `cycle`. Never throws or
/// allocates after construction, where the back end does not.
class ValveDriver {
 public:
  /// @param clock ns of the monotonic clock whose times are the arguments below; read again where a
  /// request may have taken long
  ValveDriver(const ValveGuardSettings& settings, std::unique_ptr<ValveBackend> backend,
              std::function<std::int64_t()> clock = monotonic_now_ns);

  /// False: queued commands are too old and must be discarded (ValveGuard::wake).
  bool wake(std::int64_t now_ns) noexcept { return guard_.wake(now_ns, pause_.paused()); }
  /// A command that arrived at `arrival_ns`, by the rules of CommandExpiry.
  CommandVerdict command(const PressureCommand& command, std::int64_t arrival_ns) noexcept {
    return guard_.command(command, arrival_ns);
  }
  /// An operator's emergency stop, and the disarm that acknowledges it (ValveGuard).
  void emergency_stop() noexcept { guard_.emergency_stop(); }
  void acknowledge() noexcept { guard_.acknowledge(); }
  /// Carries out the guard's next action. True if pressures were written and read back.
  bool cycle(std::int64_t now_ns) noexcept;

  /// From now on every set point is zero. Call it once.
  void stop(std::int64_t now_ns) noexcept;
  /// Whether `stop` was called.
  bool stopping() const noexcept { return stopping_; }
  /// After `stop`: zero was confirmed, or can no longer be confirmed (0.7 s have passed, or there
  /// is no connection).
  bool stopped(std::int64_t now_ns) const noexcept;
  /// Closes the connection to the hardware.
  void close() noexcept { backend_->close(); }

  /// The guard, for its state and counters.
  const ValveGuard& guard() const noexcept { return guard_; }
  /// Set points of the last write (bar, one per chamber).
  const Eigen::VectorXd& written_bar() const noexcept { return written_bar_; }
  /// Sequence number of the command in force at the last write.
  std::int64_t written_sequence() const noexcept { return sequence_; }
  /// Result of the last read.
  const ReadBack& read_back() const noexcept { return read_back_; }

  /// State and reason in words, with details: "DEGRADED (stuck valve): chamber 5 ...". Written into
  /// `buffer`, cut to fit.
  std::string_view text(std::span<char> buffer) const noexcept;

 private:
  bool exchange(std::int64_t now_ns) noexcept;
  bool read(std::int64_t now_ns) noexcept;
  void give_up() noexcept;
  void keep_error() noexcept;

  std::unique_ptr<ValveBackend> backend_;
  std::function<std::int64_t()> clock_;
  std::vector<int> order_;
  std::string address_;
  double vented_bar_;
  ValveGuard guard_;
  PauseWatch pause_;
  ReadBack read_back_, newest_;
  Eigen::VectorXd written_bar_, zero_;
  std::int64_t sequence_ = CommandExpiry::kNoSequence;
  std::int64_t stop_ns_ = 0;
  bool stopping_ = false;
  std::int64_t cycles_at_stop_ = 0;
  std::array<char, 200> error_{};  ///< of the request that failed last
};

}  // namespace softarm
