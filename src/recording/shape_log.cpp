#include "softarm/recording/shape_log.hpp"

#include <fmt/format.h>

#include <iterator>

#include "softarm/recording/experiment_log.hpp"

namespace softarm {
namespace {

constexpr double kPeriod_s = 0.02;

}  // namespace

ShapeLog::ShapeLog(const std::filesystem::path& folder, const Experiment& experiment,
                   const Files& inputs)
    : path_(folder / "shape.csv"),
      origin_(provenance_line(experiment)),
      plant_(experiment.plant),
      inputs_(inputs_of(experiment, inputs)) {
  refuse_input(path_, inputs_);
  std::error_code error;
  std::filesystem::remove(path_, error);
}

void ShapeLog::open(Eigen::Index parts, std::size_t points) {
  file_.emplace(path_, inputs_, OutputFile::Kind::record);
  std::string header = origin_ + "\nt_s";
  for (Eigen::Index j = 1; j <= parts; ++j)
    header += fmt::format(",bend{0}_x_rad,bend{0}_y_rad", j);
  for (std::size_t j = 0; j < points; ++j)
    header += fmt::format(",point{0}_x_m,point{0}_y_m,point{0}_z_m", j);
  file_->write(header + "\n");
}

void ShapeLog::add(const LogRow& row) {
  if (row.coordinates.size() == 0 || row.t_s < next_s_) return;
  if (!arm_) arm_ = plant_.kind.make(plant_);
  const PlantShape shape = arm_->shape(row.coordinates);
  if (!file_) open(shape.bend_rad.size() / 2, shape.points_m.size());
  line_.clear();
  auto out = std::back_inserter(line_);
  fmt::format_to(out, "{:.6g}", row.t_s);
  for (const double bend : shape.bend_rad) fmt::format_to(out, ",{:.7g}", bend);
  for (const Eigen::Vector3d& point : shape.points_m)
    for (const double value : point) fmt::format_to(out, ",{:.7g}", value);
  line_ += '\n';
  file_->write(line_);
  next_s_ = row.t_s + kPeriod_s - 1e-9;
}

void ShapeLog::close() {
  if (file_) file_->commit();
}

}  // namespace softarm
