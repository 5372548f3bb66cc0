#include "softarm/recording/shape_log.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <iterator>
#include <numeric>
#include <stdexcept>

#include "softarm/model/segment.hpp"
#include "softarm/recording/experiment_log.hpp"

namespace softarm {
namespace {

constexpr double kPeriod_s = 0.02;
constexpr int kPointsOfAnArc = 6;

/// Lengths in m of the arcs that make up the plant.
std::vector<double> arc_lengths(const PlantSettings& plant) {
  std::vector<double> lengths;
  for (const SegmentParameters& segment : plant.arm.segments) {
    if (plant.kind != PlantKind::refined) {
      lengths.push_back(segment.length_m);
      continue;
    }
    const auto pieces = static_cast<std::size_t>(plant.refined.pieces);
    std::vector<double> weights = plant.refined.length_weights;
    weights.resize(pieces, 1.0);
    const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
    for (const double weight : weights) lengths.push_back(segment.length_m * weight / sum);
  }
  return lengths;
}

}  // namespace

Eigen::VectorXd part_bends(const PlantSettings& plant, const Eigen::VectorXd& coordinates) {
  Eigen::VectorXd bends = coordinates;
  if (plant.kind != PlantKind::links) return bends;
  for (Eigen::Index k = 0; k + 1 < bends.size(); k += 2) {
    bends[k] = coordinates[k + 1];
    bends[k + 1] = -coordinates[k];
  }
  return bends;
}

std::vector<Eigen::Vector3d> arm_points(const PlantSettings& plant,
                                        const Eigen::VectorXd& coordinates) {
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();
  frame.linear() = plant.arm.base_rotation;
  frame.translation() = plant.arm.base_position_m;
  std::vector<Eigen::Vector3d> points = {frame.translation()};
  if (plant.kind == PlantKind::links) {
    const int links = plant.links.links_per_segment;
    for (Eigen::Index j = 0; 2 * j + 1 < coordinates.size(); ++j) {
      const auto segment = static_cast<std::size_t>(j / links);
      frame.rotate(Eigen::AngleAxisd(coordinates[2 * j], Eigen::Vector3d::UnitX()));
      frame.rotate(Eigen::AngleAxisd(coordinates[2 * j + 1], Eigen::Vector3d::UnitY()));
      frame.translate(plant.arm.segments[segment].length_m / links * Eigen::Vector3d::UnitZ());
      points.emplace_back(frame.translation());
    }
    return points;
  }
  const std::vector<double> lengths = arc_lengths(plant);
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    const Eigen::Vector2d u = coordinates.segment<2>(static_cast<Eigen::Index>(2 * i));
    for (int k = 1; k <= kPointsOfAnArc; ++k)
      points.emplace_back(frame * segment_point(lengths[i], u, double(k) / kPointsOfAnArc));
    frame.translate(segment_tip(lengths[i], u));
    frame.rotate(segment_rotation(u));
  }
  return points;
}

ShapeLog::ShapeLog(const std::filesystem::path& folder, const Experiment& experiment)
    : path_(folder / "shape.csv"), origin_(provenance_line(experiment)), plant_(experiment.plant) {
  std::error_code error;
  std::filesystem::remove(path_, error);
}

void ShapeLog::open(Eigen::Index parts, std::size_t points) {
  file_.reset(std::fopen(path_.c_str(), "w"));
  if (!file_)
    throw std::runtime_error(fmt::format("cannot write {}: choose another --out", path_.string()));
  std::string header = origin_ + "\nt_s";
  for (Eigen::Index j = 1; j <= parts; ++j)
    header += fmt::format(",bend{0}_x_rad,bend{0}_y_rad", j);
  for (std::size_t j = 0; j < points; ++j)
    header += fmt::format(",point{0}_x_m,point{0}_y_m,point{0}_z_m", j);
  std::fputs((header + "\n").c_str(), file_.get());
}

void ShapeLog::add(const LogRow& row) {
  if (row.coordinates.size() == 0 || row.t_s < next_s_) return;
  const Eigen::VectorXd bends = part_bends(plant_, row.coordinates);
  const std::vector<Eigen::Vector3d> points = arm_points(plant_, row.coordinates);
  if (!file_) open(bends.size() / 2, points.size());
  line_.clear();
  auto out = std::back_inserter(line_);
  fmt::format_to(out, "{:.6g}", row.t_s);
  for (const double bend : bends) fmt::format_to(out, ",{:.7g}", bend);
  for (const Eigen::Vector3d& point : points)
    for (const double value : point) fmt::format_to(out, ",{:.7g}", value);
  line_ += '\n';
  std::fputs(line_.c_str(), file_.get());
  next_s_ = row.t_s + kPeriod_s - 1e-9;
}

}  // namespace softarm
