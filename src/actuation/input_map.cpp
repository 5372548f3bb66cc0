#include "softarm/actuation/input_map.hpp"

#include <cmath>

namespace softarm {

Eigen::Matrix2Xd input_map(ActuationKind kind, const std::vector<Chamber>& segment) {
  Eigen::Matrix2Xd map(2, segment.size());
  for (std::size_t j = 0; j < segment.size(); ++j) {
    const double gain = segment[j].gain_nm_per_bar, angle_rad = segment[j].angle_rad;
    const auto column = static_cast<Eigen::Index>(j);
    if (kind == ActuationKind::chambers) {
      map.col(column) << -gain * std::cos(angle_rad), -gain * std::sin(angle_rad);
    } else {
      map.col(column) << (j == 0 ? 0.0 : gain), (j == 0 ? -gain : 0.0);
    }
  }
  return map;
}

Eigen::RowVectorXd axial_input_map(ActuationKind kind, const std::vector<Chamber>& segment) {
  Eigen::RowVectorXd map = Eigen::RowVectorXd::Zero(static_cast<Eigen::Index>(segment.size()));
  if (kind == ActuationKind::torque) return map;
  for (std::size_t j = 0; j < segment.size(); ++j) {
    map[static_cast<Eigen::Index>(j)] = segment[j].gain_nm_per_bar / segment[j].offset_m;
  }
  return map;
}

Eigen::MatrixXd input_map(const ActuationSettings& settings, bool extensible) {
  const Eigen::Index width = extensible ? 3 : 2;
  Eigen::MatrixXd map = Eigen::MatrixXd::Zero(
      width * static_cast<Eigen::Index>(settings.segments.size()), chamber_count(settings));
  Eigen::Index row = 0, column = 0;
  for (const std::vector<Chamber>& segment : settings.segments) {
    const auto count = static_cast<Eigen::Index>(segment.size());
    map.block(row, column, 2, count) = input_map(settings.kind, segment);
    if (extensible) {
      map.block(row + 2, column, 1, count) = axial_input_map(settings.kind, segment);
    }
    row += width;
    column += count;
  }
  return map;
}

}  // namespace softarm
