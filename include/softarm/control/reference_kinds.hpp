// The kinds of reference that are built in.
// config/template.yaml documents every setting.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "softarm/base/keys.hpp"
#include "softarm/control/reference_kind.hpp"

namespace softarm {

/// Declares the keys of a curvature of every segment, `theta_rad` and `phi_rad` or `u_rad` (2n).
void describe_pose(Keys& key, std::vector<double>& u_rad, Presence presence);

/// Hold u constant.
struct SetPointReference {
  std::vector<double> u_rad;  ///< 2n

  const char* name() const noexcept { return "set_point"; }
  void describe(Keys& key);
  void check(const ReferencePlace& place, const ControllerSettings& control, int segments) const;
  double largest_theta_rad() const noexcept;
  double largest_speed_radps() const noexcept { return 0.0; }
  void evaluate(double time_s, ReferenceSample& out) const noexcept;
};

/// The paper's (24): theta rises to `theta_rad` in `rise_s`, phi_i = phi_centre + phi_amplitude
/// cos(rate t + (i-1) phase). Known in polar coordinates too.
struct PaperReference {
  double theta_rad = 0.4;
  double rise_s = 1.0;
  double phi_centre_rad = std::numbers::pi;
  double phi_amplitude_rad = 1.0;
  double rate_radps = 2.0;
  double phase_step_rad = 1.0471975511965976;

  const char* name() const noexcept { return "paper"; }
  void describe(Keys& key);
  void check(const ReferencePlace& place, const ControllerSettings& control, int segments) const;
  double largest_theta_rad() const noexcept { return theta_rad; }
  double largest_speed_radps() const noexcept;
  double period_s() const noexcept;  ///< of what follows the rise
  void evaluate(double time_s, ReferenceSample& out) const noexcept;
};

/// Where the arm is to be at a time of the phase.
struct WayPoint {
  double time_s = 0.0;
  std::vector<double> u_rad;  ///< 2n
};
/// Smooth motion through way points: minimum-jerk (quintic) pieces, at rest in every point.
struct WayPointReference {
  std::vector<WayPoint> points;
  bool repeat = false;

  const char* name() const noexcept { return "way_points"; }
  void describe(Keys& key);
  void check(const ReferencePlace& place, const ControllerSettings& control, int segments) const;
  double largest_theta_rad() const noexcept;
  double largest_speed_radps() const noexcept;
  double period_s() const noexcept;
  void evaluate(double time_s, ReferenceSample& out) const noexcept;
};

/// References received over LCM; until one arrives, the arm holds where it is.
struct LiveReference {
  double timeout_s = 0.2;

  const char* name() const noexcept { return "live"; }
  void describe(Keys& key);
  void check(const ReferencePlace& place, const ControllerSettings& control, int segments) const;
};

/// Targets of the tip received over LCM, followed by (21); until one arrives, the tip stays.
struct LiveTipReference {
  double timeout_s = 0.2;
  double max_speed_mps = 0.2;
  double max_acceleration_mps2 = 1.0;

  const char* name() const noexcept { return "live_tip"; }
  void describe(Keys& key);
  void check(const ReferencePlace& place, const ControllerSettings& control, int segments) const;
  TipReference tip(double) const noexcept { return {}; }  ///< the tracker knows it
};

class TableCurve;

/// A table of times and of u, of phi and theta, or of the tip: a cubic spline through its points,
/// twice continuously differentiable, at rest at both ends; periodic where it repeats.
class TableReference {
 public:
  std::string file;  ///< CSV, relative to the file that names it
  bool repeat = false;
  double max_acceleration_radps2 = 500.0;
  double max_tip_speed_mps = 1.0;
  double max_tip_acceleration_mps2 = 20.0;
  std::string digest;  ///< of the table's numbers

  const char* name() const noexcept { return "table"; }
  void describe(Keys& key);
  /// Reads the table. What is wrong with it is reported by check().
  void load(const std::filesystem::path& path, int segments);
  void check(const ReferencePlace& place, const ControllerSettings& control, int segments) const;
  double largest_theta_rad() const noexcept;
  double largest_speed_radps() const noexcept;
  void evaluate(double time_s, ReferenceSample& out) const noexcept;
  bool is_tip_path() const noexcept;
  TipReference tip(double time_s) const noexcept;
  /// Time of the last point, from the first; 0 without a table.
  double duration_s() const noexcept;
  double period_s() const noexcept { return repeat ? duration_s() : 0.0; }

 private:
  std::shared_ptr<const TableCurve> curve_;
  std::string fault_;
};

/// Path p_d(t) of the tip in the world.
enum class TipPathShape {
  point,      ///< p_d = centre
  circle,     ///< p_d = centre + first_axis cos(rate t) + second_axis sin(rate t); an ellipse
  lemniscate  ///< p_d = centre + first_axis cos(rate t) + second_axis sin(2 rate t)
};

/// Where the tip should be, in the world frame; the defaults are the paper's lemniscate (22).
struct TipPathReference {
  TipPathShape shape = TipPathShape::lemniscate;
  Eigen::Vector3d centre_m = Eigen::Vector3d(-0.25, 0.0, -0.5);
  Eigen::Vector3d first_axis_m = Eigen::Vector3d(0.0, 1.0 / 3.0, 0.0);
  Eigen::Vector3d second_axis_m = Eigen::Vector3d(0.0, 0.0, 1.0 / 6.0);
  double rate_radps = 0.6283185307179586;

  const char* name() const noexcept;
  void describe(Keys& key);
  void check(const ReferencePlace& place, const ControllerSettings& control, int segments) const;
  double period_s() const noexcept;
  TipReference tip(double time_s) const noexcept;
  /// How far the path goes from a point, at 720 instants of its period.
  double largest_distance_m(const Eigen::Vector3d& from_m) const noexcept;
};

}  // namespace softarm
