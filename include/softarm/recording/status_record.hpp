// Builds the rows of log.csv from the status messages of a run, live or from an LCM log.
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

/// Interpolates the true state of a simulated arm between two of its messages.
class TruthTrack {
 public:
  /// Takes the next message.
  void add(const PlantState& state);
  /// Whether the newest message is not before `time_us`.
  bool reaches(std::int64_t time_us) const { return after_ && after_->time_us >= time_us; }

  /// Fills true u, real pressures and tip at `time_us` into the row; nothing if that is not between
  /// the last two messages.
  void fill(std::int64_t time_us, LogRow& row) const;

 private:
  std::optional<PlantState> before_, after_;
};

/// Takes the daemon's status and timing messages and the true states of a simulated arm. Every
/// status becomes a row as soon as the true state at its time is known, or is no longer expected.
class StatusRecord {
 public:
  /// @param folder  for log.csv, summary.json and timing.json; empty: no files
  /// @param inputs  files that are read beside the experiment's
  /// @throws OutputIsInput, OutputError if the folder or a file cannot be made
  StatusRecord(const Experiment& experiment, const std::filesystem::path& folder,
               const Files& inputs = {});

  /// Takes a message of a channel of the configuration; other channels and other arms are ignored.
  /// Returns whether it was a status of this arm.
  bool take(std::string_view channel, std::span<const std::byte> bytes);

  /// Writes the last rows and the files, as far as the disk lets it; failure() is what it did not.
  void close();

  /// Why the record is not complete, as soon as that is known; empty: it is.
  const std::string& failure() const { return failure_; }

  /// The summary at the end of a run, for a person.
  std::string table() const;

  /// Of all rows that were complete; after close() of all.
  const TrackingSummary& summary() const { return summary_; }

  /// The newest status.
  const ArmStatus& status() const { return status_; }
  /// Time from the first status to the newest, in s.
  double time_s() const;
  /// Number of statuses taken.
  std::int64_t rows() const { return rows_; }
  /// Total time in ACTIVE, in s.
  double active_s() const { return active_s_; }

 private:
  struct WaitingRow {
    std::int64_t time_us;
    LogRow row;
  };
  bool take_status(std::span<const std::byte> bytes);
  void take_observer(std::span<const std::byte> bytes);
  /// The rows that are complete, or all of them.
  void write_rows(bool all);
  /// Does what writes to a file; afterwards failure() is why it could not.
  template <class Write>
  void try_to(const Write& write);
  std::string timing_text() const;
  std::string timing_table() const;

  const Experiment& experiment_;
  TrackingSummary summary_;
  std::optional<ExperimentLog> log_;
  std::optional<SummaryFiles> files_;
  std::string failure_;
  TruthTrack truth_;
  std::deque<WaitingRow> waiting_;
  ArmStatus status_;
  ObserverStatus observer_status_;  ///< the newest
  bool commander_heard_ = false;    ///< the newest status was not of a shadow
  softarm_messages::timing_t timing_{};
  bool timing_received_ = false;
  std::int64_t start_us_ = 0;
  std::int64_t rows_ = 0;
  double active_s_ = 0.0;
};

}  // namespace softarm
