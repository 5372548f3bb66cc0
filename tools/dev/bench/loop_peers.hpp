// The rivals of `softarm-dev bench loop`: a bare LCM echo, a bare clock_nanosleep, and load, each a
// process.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

#include "softarm/base/realtime.hpp"
#include "softarm/config/experiment.hpp"

namespace softarm {

/// A process that is a copy of this one and runs a function until it is killed, at the latest with
/// its owner.
class ForkedPeer {
 public:
  /// @throws std::runtime_error if no process can be started
  explicit ForkedPeer(const std::function<void()>& body);
  ~ForkedPeer();
  ForkedPeer(const ForkedPeer&) = delete;
  ForkedPeer& operator=(const ForkedPeer&) = delete;

 private:
  int pid_ = -1;
};

inline constexpr const char* kEchoRequest = "SOFTARM_BENCH_FRAME";
inline constexpr const char* kEchoAnswer = "SOFTARM_BENCH_COMMAND";

/// Answers every message on kEchoRequest with a message of as many bytes as a pressure command to
/// so many chambers, which has the request's bytes 8 to 15 (the frame's number) as its own.
/// Scheduled as the daemon is: LCM's thread one priority below the one that answers. Never returns.
[[noreturn]] void echo_forever(const std::string& url, int chambers,
                               const RealtimeSettings& realtime);

/// Answers every state of an experiment's external law with zero moments, scheduled likewise. Never
/// returns.
[[noreturn]] void answer_states_forever(const Experiment& experiment,
                                        const RealtimeSettings& realtime);

/// Wake-ups of a bare clock_nanosleep at a fixed rate, in memory that two processes share.
class SharedWakeUps {
 public:
  /// Capacity for so many wake-ups. @throws std::runtime_error without memory
  explicit SharedWakeUps(std::size_t capacity);
  ~SharedWakeUps();
  SharedWakeUps(const SharedWakeUps&) = delete;
  SharedWakeUps& operator=(const SharedWakeUps&) = delete;

  /// Waits until `start` was called, then sleeps from deadline to deadline, missed ones skipped, as
  /// the daemon does. Never returns.
  [[noreturn]] void sleep_forever(std::int64_t period_ns, const RealtimeSettings& realtime);
  /// From CLOCK_MONOTONIC `first_ns` on.
  void start(std::int64_t first_ns) { state_->first_ns = first_ns; }

  std::size_t count() const { return state_->count; }
  std::int64_t missed() const { return state_->missed; }
  std::int64_t lateness_ns(std::size_t index) const { return lateness_ns_[index]; }

 private:
  struct State {
    std::atomic<std::int64_t> first_ns{0}, missed{0};
    std::atomic<std::size_t> count{0};
  };
  std::size_t bytes_, capacity_;
  State* state_;
  std::int64_t* lateness_ns_;
};

}  // namespace softarm
