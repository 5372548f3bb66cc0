// The paper's three-segment arm (section VII) for tests of the plant.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "softarm/simulation/settings.hpp"

namespace softarm {

inline PlantSettings paper_arm(MassModel mass = MassModel::distributed, int segments = 3) {
  PlantSettings settings;
  settings.arm.segments.assign(static_cast<std::size_t>(segments), SegmentParameters{});
  settings.arm.mass = mass;
  settings.method = IntegratorMethod::cash4;
  settings.relative_tolerance = 1e-6;
  settings.absolute_tolerance = 1e-8;
  settings.max_step_s = 0.0;
  std::vector<Chamber> chambers;
  for (int j = 0; j < 4; ++j) chambers.push_back({.angle_rad = j * std::numbers::pi / 2});
  settings.actuation.segments.assign(static_cast<std::size_t>(segments), chambers);
  return settings;
}

/// The same with segments that stretch.
inline PlantSettings stretching(PlantSettings settings) {
  settings.arm.extensible = true;
  return settings;
}

/// The built-in kinds with `parts` a segment, where they have parts.
using MakeKind = PlantKind (*)(int parts);
inline constexpr MakeKind kPcc = [](int) -> PlantKind { return PccSettings{}; };
inline constexpr MakeKind kRefined = [](int parts) -> PlantKind {
  return RefinedSettings{.pieces = parts};
};
inline constexpr MakeKind kLinks = [](int parts) -> PlantKind {
  return LinkSettings{.links_per_segment = parts};
};

/// A drive with steps every `hold_s`: the pressures at time t, smooth but for the holding.
inline std::vector<double> drive_bar(double t_s, int segments = 3) {
  std::vector<double> pressures;
  const double rise = std::min(t_s, 1.0);
  for (int i = 0; i < segments; ++i) {
    for (int j = 0; j < 4; ++j) {
      const double phase = 2.0 * t_s + i * std::numbers::pi / 3 - j * std::numbers::pi / 2;
      pressures.push_back(0.4 * rise * (segments - i) / segments * (1.0 + std::cos(phase)));
    }
  }
  return pressures;
}

/// -g p (cos chi, sin chi), summed by hand.
inline Eigen::VectorXd chamber_force_nm(const PlantSettings& settings,
                                        const Eigen::VectorXd& pressures_bar) {
  Eigen::VectorXd force = Eigen::VectorXd::Zero(settings.arm.dof());
  Eigen::Index valve = 0;
  for (int i = 0; i < settings.arm.size(); ++i) {
    for (const Chamber& chamber : settings.actuation.segments[static_cast<std::size_t>(i)]) {
      const double moment = chamber.gain_nm_per_bar * pressures_bar[valve++];
      force[2 * i] -= moment * std::cos(chamber.angle_rad);
      force[2 * i + 1] -= moment * std::sin(chamber.angle_rad);
    }
  }
  return force;
}

}  // namespace softarm
