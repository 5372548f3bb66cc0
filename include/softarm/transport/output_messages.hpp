// What a tick says on the wire: the same in the daemon and in its replay.
#pragma once

#include <cstdint>
#include <softarm_messages/controller_status_t.hpp>
#include <softarm_messages/pressure_command_t.hpp>
#include <softarm_messages/torque_command_t.hpp>
#include <string>

#include "softarm/runtime/control_pipeline.hpp"
#include "softarm/runtime/settings.hpp"

namespace softarm {

/// Who is speaking: told in every status message, and in the records of ticks.
struct Provenance {
  std::string version;  ///< release and commit
  std::uint64_t configuration_hash = 0;
  std::uint64_t seed = 0;
  std::string build;  ///< version, commit, compiler and instruction sets
};

/// As the status counts: up to 2^31 - 1, and no further.
std::int32_t counter(std::int64_t value) noexcept;

/// Command and status of one tick. After construction nothing here allocates.
class OutputMessages {
 public:
  OutputMessages(const PipelineSettings& settings, const Provenance& provenance, bool shadow);

  /// Pressures, or torques where these actuate; `time_us` is for the sender to fill.
  void set_command(std::int64_t tick, const TickOutput& output) noexcept;
  /// Everything but `time_us`, `overruns` and `messages_malformed`, which no pipeline knows. The
  /// command of the same tick must have been set.
  void set_status(std::int64_t tick, const ControlPipeline& pipeline) noexcept;

  /// Commands are torques: another type, which no valve terminal decodes.
  bool by_torque() const noexcept { return by_torque_; }

  softarm_messages::pressure_command_t pressure_command;
  softarm_messages::torque_command_t torque_command;
  softarm_messages::controller_status_t status;

 private:
  bool by_torque_;
};

}  // namespace softarm
