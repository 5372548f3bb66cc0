// A folder of recorded runs as one table: what their summary.json say, side by side.
#pragma once

#include <filesystem>
#include <string>

namespace softarm {

/// One line a run: its folder below `folder`, duration, time in ACTIVE and last mode, tracking
/// errors of u and of the tip (RMS), largest command, share of saturated ticks. Runs are the folders
/// with a summary.json, at any depth, in the order of their names; an unreadable one has a line
/// that says so.
/// @throw std::runtime_error where `folder` cannot be read or holds no run.
std::string runs_table(const std::filesystem::path& folder);

}  // namespace softarm
