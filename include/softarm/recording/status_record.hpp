// A run as its status messages tell it, from the wire or from an LCM log: the rows of log.csv.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <optional>
#include <softarm_messages/timing_t.hpp>
#include <span>
#include <string>
#include <string_view>

#include "softarm/config/experiment.hpp"
#include "softarm/recording/experiment_log.hpp"
#include "softarm/recording/tracking_summary.hpp"
#include "softarm/transport/arm_messages.hpp"

namespace softarm {

/// A simulated arm's state between two of its reports.
class TruthTrack {
 public:
  void add(const PlantState& state);
  bool reaches(std::int64_t time_us) const { return after_ && after_->time_us >= time_us; }

  /// True u, real pressures and tip at time_us into the row; nothing where that is not between two
  /// reports.
  void fill(std::int64_t time_us, LogRow& row) const;

 private:
  std::optional<PlantState> before_, after_;
};

/// Takes the daemon's status and timing, and what a simulated arm says of itself; every status
/// becomes a row once the truth about its instant is known, or is not to be expected any more.
class StatusRecord {
 public:
  /// @param folder for log.csv, summary.json and timing.json; empty: no files
  /// @throws std::runtime_error if the folder or a file cannot be made
  StatusRecord(const Experiment& experiment, const std::filesystem::path& folder);

  /// A message of the channel, as the configuration names it; of other channels and other arms
  /// nothing is taken. Returns whether it was a status of this arm.
  bool take(std::string_view channel, std::span<const std::byte> bytes);

  /// Writes the last rows and the files. @throws std::runtime_error if anything could not be
  /// written
  void close();

  /// What there is to say at the end, for people.
  std::string table() const;

  /// The newest status, and how long ago the first one was.
  const ArmStatus& status() const { return status_; }
  double time_s() const;
  std::int64_t rows() const { return rows_; }
  double active_s() const { return active_s_; }

 private:
  struct WaitingRow {
    std::int64_t time_us;
    LogRow row;
  };
  bool take_status(std::span<const std::byte> bytes);
  /// The rows that are complete, or all of them.
  void write_rows(bool all);
  std::string timing_text() const;
  std::string timing_table() const;

  const Experiment& experiment_;
  std::filesystem::path folder_;
  TrackingSummary summary_;
  std::optional<ExperimentLog> log_;
  TruthTrack truth_;
  std::deque<WaitingRow> waiting_;
  ArmStatus status_;
  bool commander_heard_ = false;  ///< a daemon that is no shadow
  softarm_messages::timing_t timing_{};
  bool timing_received_ = false;
  std::int64_t start_us_ = 0;
  std::int64_t rows_ = 0;
  double active_s_ = 0.0;
};

}  // namespace softarm
