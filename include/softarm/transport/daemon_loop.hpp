// The control pipeline in real time, connected to LCM: the loop of softarmd.
#pragma once

#include <cstdint>
#include <functional>
#include <utility>

#include "softarm/runtime/control_pipeline.hpp"
#include "softarm/transport/daemon_link.hpp"

namespace softarm {

/// Runs the tick at its deadlines and records how well they were kept. Use from the thread of the
/// tick.
class DaemonLoop {
 public:
  /// Passed to the callback after each tick.
  struct Report {
    std::int64_t woken_ns;        ///< CLOCK_MONOTONIC
    std::int64_t since_start_ns;  ///< since the start of run()
    bool on_time;                 ///< the next tick's deadline was kept
    bool stopping;                ///< a stop was requested
  };

  /// @throws TransportError
  DaemonLoop(const PipelineSettings& settings, const TransportSettings& transport,
             const Provenance& provenance, bool shadow);

  /// The first tick will find an emergency stop: a FAULT that nobody has acknowledged.
  void begin_stopped() noexcept { begin_stopped_ = true; }

  /// From now on `kept` is asked in every tick, with what was decided, and no status shows FAULT
  /// before it returns true: nobody relies on what dies with this process. A disk that does not
  /// answer delays the statuses, not the commands, by at most a second.
  void keep_faults(std::function<bool(Mode, Reason)> kept) { kept_ = std::move(kept); }

  /// Ticks until `stop_requested` returns true and every pressure has been commanded to zero.
  /// Neither allocates nor throws as long as the callbacks do not.
  void run(const std::function<bool()>& stop_requested,
           const std::function<void(const Report&)>& after_tick);

  /// Durations and counters so far.
  const LoopTiming& timing() const noexcept { return timing_; }
  /// The pipeline after its latest tick.
  const ControlPipeline& pipeline() const noexcept { return pipeline_; }
  /// Counters of messages.
  const DaemonLink& link() const noexcept { return link_; }

 private:
  void tick(std::int64_t woken_ns, bool stopping) noexcept;
  bool may_publish_status(std::int64_t now_ns, const TickOutput& output) noexcept;

  ControlPipeline pipeline_;
  DaemonLink link_;
  std::int64_t ticks_per_second_;
  std::function<bool(Mode, Reason)> kept_;
  std::int64_t not_kept_since_ns_ = kForever;
  bool judge_overruns_ = false;
  bool begin_stopped_ = false;
  int missed_in_row_ = 0;
  LoopTiming timing_;
};

}  // namespace softarm
