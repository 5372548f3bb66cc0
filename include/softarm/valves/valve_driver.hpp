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
  /// @param clock ns of the monotonic clock whose times are the arguments below; asked again where
  /// a request may have taken long
  ValveDriver(const ValveGuardSettings& settings, std::unique_ptr<ValveBackend> backend,
              std::function<std::int64_t()> clock = monotonic_now_ns);

  /// False: commands that wait in queues are too old and must be thrown away (ValveGuard::wake).
  bool wake(std::int64_t now_ns) noexcept { return guard_.wake(now_ns); }
  CommandVerdict command(const PressureCommand& command, std::int64_t arrival_ns) noexcept {
    return guard_.command(command, arrival_ns);
  }
  /// Does what the guard wants next. True if pressures were written and read back.
  bool cycle(std::int64_t now_ns) noexcept;

  /// From now on every set point is zero. To be called once.
  void stop(std::int64_t now_ns) noexcept;
  bool stopping() const noexcept { return stopping_; }
  /// After `stop`: zero was confirmed, or cannot be any more (within 0.7 s, or without a
  /// connection).
  bool stopped(std::int64_t now_ns) const noexcept;
  void close() noexcept { backend_->close(); }

  const ValveGuard& guard() const noexcept { return guard_; }
  /// Set points of the last write (bar, one per chamber), the command that was in force then, and
  /// what was read back last.
  const Eigen::VectorXd& written_bar() const noexcept { return written_bar_; }
  std::int64_t written_sequence() const noexcept { return sequence_; }
  const ReadBack& read_back() const noexcept { return read_back_; }

  /// State and reason in words, with what they are about: "DEGRADED (stuck valve): chamber 5 ...".
  /// Written into `buffer`, cut to fit.
  std::string_view text(std::span<char> buffer) const noexcept;

 private:
  bool exchange(std::int64_t now_ns) noexcept;
  void keep_error() noexcept;

  std::unique_ptr<ValveBackend> backend_;
  std::function<std::int64_t()> clock_;
  std::vector<int> order_;
  std::string address_;
  ValveGuard guard_;
  ReadBack read_back_, newest_;
  Eigen::VectorXd written_bar_, zero_;
  std::int64_t sequence_ = CommandExpiry::kNoSequence;
  std::int64_t stop_ns_ = 0;
  bool stopping_ = false;
  bool exchanged_since_stop_ = false;
  std::array<char, 200> error_{};  ///< of the request that failed last
};

}  // namespace softarm
