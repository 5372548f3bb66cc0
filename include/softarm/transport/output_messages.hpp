// The messages of a tick: the same in the daemon and in its replay.
#pragma once

#include <cstdint>
#include <softarm_messages/controller_status_t.hpp>
#include <softarm_messages/law_state_t.hpp>
#include <softarm_messages/observer_status_t.hpp>
#include <softarm_messages/pressure_command_t.hpp>
#include <softarm_messages/torque_command_t.hpp>
#include <string>

#include "softarm/runtime/control_pipeline.hpp"
#include "softarm/runtime/settings.hpp"

namespace softarm {

/// Origin of the messages: sent in every status message and in the records of ticks.
struct Provenance {
  std::string version;  ///< release and commit
  std::uint64_t configuration_hash = 0;
  std::uint64_t seed = 0;
  std::string build;  ///< version, commit, compiler and instruction sets
};

/// A count saturated at 2^31 - 1, as in the status message.
std::int32_t counter(std::int64_t value) noexcept;

/// Command and status messages of one tick. After construction nothing allocates.
class OutputMessages {
 public:
  /// Sizes all lists for the arm of `settings`. @param shadow  mark commands and statuses as such
  OutputMessages(const PipelineSettings& settings, const Provenance& provenance, bool shadow);

  /// Fills the command: pressures, or torques where actuation is by torque. The sender fills
  /// `time_us`.
  void set_command(std::int64_t tick, const TickOutput& output) noexcept;
  /// Fills the status except `time_us`, `overruns` and `messages_malformed`, which the pipeline
  /// does not know. The command of the same tick must have been set.
  void set_status(std::int64_t tick, const ControlPipeline& pipeline) noexcept;

  /// Fills what the model-based observer knows, except `time_us`. @return whether there is one
  bool set_observer(std::int64_t tick, const ControlPipeline& pipeline) noexcept;
  /// Fills what an external law is to answer, except `time_us` and `nonce`. The output must have it.
  void set_law_state(std::int64_t tick, const TickOutput& output) noexcept;

  /// Whether commands are torques: another type, which no valve terminal decodes.
  bool by_torque() const noexcept { return by_torque_; }

  softarm_messages::pressure_command_t pressure_command;
  softarm_messages::torque_command_t torque_command;
  softarm_messages::controller_status_t status;
  softarm_messages::observer_status_t observer;
  softarm_messages::law_state_t law_state;

 private:
  Eigen::Index width_;  ///< coordinates of a segment
  ObserverReport report_;
  bool by_torque_;
};

}  // namespace softarm
