// A folder of recorded runs as one table: what their summary.json say, side by side.
#pragma once

#include <filesystem>
#include <string>

#include "softarm/base/output_file.hpp"

namespace softarm {

/// Of a folder of runs.
struct RunsTable {
  std::string text;
  Files unreadable;  ///< summaries of which the table has a line, but no numbers
};

/// One line a run: its folder below `folder`, duration, time in ACTIVE and last mode, tracking
/// errors of u and of the tip (RMS), largest command, share of saturated ticks. Runs are the folders
/// with a summary.json, at any depth, in the order of their names.
/// @throw std::runtime_error where `folder` cannot be read or holds no run.
RunsTable runs_table(const std::filesystem::path& folder);

}  // namespace softarm
