// Logs the shape of the simulated arm to FOLDER/shape.csv, for plots of what u alone does not show.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

#include "softarm/config/experiment.hpp"
#include "softarm/runtime/log_row.hpp"

namespace softarm {

/// Writes a row of the plant's shape every 20 ms; no file where there is no simulated arm.
class ShapeLog {
 public:
  /// Removes the file of an earlier run from `folder`.
  ShapeLog(const std::filesystem::path& folder, const Experiment& experiment);

  /// Appends a row; rows without the plant's coordinates are ignored.
  /// @throws std::runtime_error if the file cannot be made
  void add(const LogRow& row);

 private:
  struct Closer {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  void open(Eigen::Index parts, std::size_t points);

  std::filesystem::path path_;
  std::string origin_;
  PlantSettings plant_;
  std::unique_ptr<PlantSystem> arm_;  // of plant_, made for the first row
  std::unique_ptr<std::FILE, Closer> file_;
  double next_s_ = 0.0;
  std::string line_;
};

}  // namespace softarm
