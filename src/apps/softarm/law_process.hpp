// A control law in Python, for the simulated arm: asked in lock step, so that a run is deterministic.
#pragma once

#include <cstddef>
#include <cstdint>
#include <softarm_messages/law_command_t.hpp>
#include <string>
#include <vector>

#include "softarm/config/experiment.hpp"
#include "softarm/runtime/control_pipeline.hpp"
#include "softarm/transport/output_messages.hpp"

namespace softarm {

/// python -m softarm.law at the other end of a socket, with the messages of a live law: law_state_t
/// there, law_command_t back.
class LawProcess {
 public:
  /// @param law  MODULE:CLASS or FILE.py:CLASS  @throws std::runtime_error where it does not start
  LawProcess(const std::string& law, const std::string& config, const Experiment& experiment);
  ~LawProcess();
  LawProcess(const LawProcess&) = delete;
  LawProcess& operator=(const LawProcess&) = delete;

  /// Waits for the answer. @throws std::runtime_error if the law ended
  bool answer(const TickOutput& output, LawInput& answer);

 private:
  OutputMessages messages_;
  softarm_messages::law_command_t received_;
  std::vector<std::byte> buffer_;
  std::int64_t ticks_ = 0;
  double period_us_;
  int socket_ = -1;
  int pid_ = -1;
};

}  // namespace softarm
