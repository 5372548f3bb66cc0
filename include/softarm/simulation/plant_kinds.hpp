// The kinds of simulated arm that are built in.
// config/template.yaml documents every setting.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "softarm/simulation/plant_kind.hpp"

namespace softarm {

/// The model itself: one constant-curvature piece a segment.
struct PccSettings {
  const char* name() const noexcept { return "pcc"; }
  std::unique_ptr<PlantSystem> make(const PlantSettings& settings) const;
};

/// Several constant-curvature pieces a segment; converges to a bending rod. Weights say how a
/// segment's length, mass and bending rigidity E I (and damping with it) vary along it, one number
/// a piece; empty: all alike. Only their ratios count: length, mass, and the bend under a uniform
/// moment stay those of the segment.
struct RefinedSettings {
  int pieces = 8;  ///< a segment; kMaxSegments pieces at most in the whole arm
  std::vector<double> length_weights = {};
  std::vector<double> mass_weights = {};
  std::vector<double> rigidity_weights = {};

  const char* name() const noexcept { return "refined"; }
  void describe(Keys& key);
  std::unique_ptr<PlantSystem> make(const PlantSettings& settings) const;
};

inline constexpr int kMaxLinksPerSegment = 64;

/// The two angles of a link's joint: a about x, then b about y.
enum class LinkJoints { crossed };

/// The paper's section VI: rigid links joined by two crossed revolute joints. Stiffness and damping
/// act about each of the two axes of a joint; left out they are those of the segment times the
/// number of its links, so that equal moments on the joints bend it as they bend the segment.
struct LinkSettings {
  int links_per_segment = 6;
  LinkJoints joints = LinkJoints::crossed;
  std::optional<double> joint_stiffness_nm_per_rad = {};
  std::optional<double> joint_damping_nms_per_rad = {};

  const char* name() const noexcept { return "links"; }
  void describe(Keys& key);
  std::unique_ptr<PlantSystem> make(const PlantSettings& settings) const;
};

}  // namespace softarm
