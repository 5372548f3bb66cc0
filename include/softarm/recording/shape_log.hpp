// The simulated arm's shape while it runs: DIR/shape.csv, for pictures of what u alone cannot show.
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
  /// Takes away what an earlier run left.
  ShapeLog(const std::filesystem::path& folder, const Experiment& experiment);

  /// Rows without the plant's coordinates are passed over.
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
