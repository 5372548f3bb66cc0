// Logs the shape of the simulated arm to FOLDER/shape.csv, for plots of what u alone does not show.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "softarm/base/output_file.hpp"
#include "softarm/config/experiment.hpp"
#include "softarm/runtime/log_row.hpp"

namespace softarm {

/// Writes a row of the plant's shape every 20 ms; no file where there is no simulated arm.
class ShapeLog {
 public:
  /// Removes the file of an earlier run from `folder`.
  /// @param inputs  files that are read beside the experiment's
  /// @throws OutputIsInput
  ShapeLog(const std::filesystem::path& folder, const Experiment& experiment,
           const Files& inputs = {});

  /// Appends a row; rows without the plant's coordinates are ignored.
  /// @throws OutputError if the file cannot be made or written
  void add(const LogRow& row);

  /// Flushes and closes. @throws OutputError if anything could not be written
  void close();

 private:
  void open(Eigen::Index parts, std::size_t points);

  std::filesystem::path path_;
  std::string origin_;
  PlantSettings plant_;
  std::unique_ptr<PlantSystem> arm_;  // of plant_, made for the first row
  Files inputs_;
  std::optional<OutputFile> file_;
  double next_s_ = 0.0;
  std::string line_;
};

}  // namespace softarm
