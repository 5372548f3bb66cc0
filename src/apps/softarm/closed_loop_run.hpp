// A run of softarmd on an experiment, from its start to its end.
#pragma once

#include <filesystem>
#include <string>

#include "softarm/config/experiment.hpp"

namespace softarm {

struct ClosedLoopRun {
  std::string failure;         ///< why it ended early, for a person; empty: it did not
  double error_rms_rad = 0.0;  ///< of the estimated u from its reference, from 1 s of ACTIVE on
  std::string table;           ///< of softarm watch
};

/// Starts the softarmd beside this program on the file `config`, arms, records `duration_s` of ACTIVE
/// in `folder` (the files of softarm watch, run.log, and what softarmd prints), disarms and ends it.
/// A stop signal vents. @throws TransportError, OutputError
ClosedLoopRun run_closed_loop(const std::filesystem::path& config,
                              const std::filesystem::path& folder, double duration_s);

}  // namespace softarm
