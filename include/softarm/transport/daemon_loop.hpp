// The control pipeline in real time, joined to LCM: what softarmd runs.
#pragma once

#include <cstdint>
#include <functional>

#include "softarm/runtime/control_pipeline.hpp"
#include "softarm/transport/daemon_link.hpp"

namespace softarm {

/// Keeps the deadline, and the account of how well it was kept. Belongs to the tick's thread.
class DaemonLoop {
 public:
  /// After each tick.
  struct Report {
    std::int64_t woken_ns;        ///< CLOCK_MONOTONIC
    std::int64_t since_start_ns;  ///< of run()
    bool on_time;                 ///< the next tick's deadline was kept
    bool stopping;                ///< a stop was requested
  };

  /// @throws TransportError
  DaemonLoop(const PipelineSettings& settings, const TransportSettings& transport,
             const Provenance& provenance, bool shadow);

  /// Ticks until `stop_requested` returns true and every pressure has been commanded to zero.
  /// Neither allocates nor throws, as long as the functions do not.
  void run(const std::function<bool()>& stop_requested,
           const std::function<void(const Report&)>& after_tick);

  const LoopTiming& timing() const noexcept { return timing_; }
  const ControlPipeline& pipeline() const noexcept { return pipeline_; }
  const DaemonLink& link() const noexcept { return link_; }

 private:
  void tick(std::int64_t woken_ns, bool stopping) noexcept;

  ControlPipeline pipeline_;
  DaemonLink link_;
  std::int64_t ticks_per_second_;
  bool judge_overruns_ = false;
  int missed_in_row_ = 0;
  LoopTiming timing_;
};

}  // namespace softarm
