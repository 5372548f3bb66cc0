// The simulated arm: from commanded pressures through valves and B u'' + C u' + D u' + G + K u = A
// tau_A + J' f_ext to where the arm really is.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <span>

#include "softarm/model/arm.hpp"
#include "softarm/model/coordinates.hpp"
#include "softarm/simulation/plant_error.hpp"
#include "softarm/simulation/settings.hpp"
#include "softarm/simulation/valves.hpp"

namespace softarm {

/// Energies in J, as seen from the base if that moves: the forces of its acceleration then count
/// as external ones. For any time, kinetic + potential - (their sum at the start) = supplied -
/// dissipated.
struct PlantEnergies {
  double kinetic = 0.0;
  double potential = 0.0;   ///< of gravity, zero at the world's origin, and of bending
  double supplied = 0.0;    ///< by chambers and loads since the start; 0 unless `account_energy`
  double dissipated = 0.0;  ///< by damping since the start; 0 unless `account_energy`
};

/// One simulated arm with its valves, at rest in `initial_u_rad` at t = 0 with no pressure, segments
/// that stretch at their length at rest.
///
/// Commands may change at any time: the integrator is a one-step method and the pressure behind a
/// valve is known in closed form while a command is held, so neither a step in the command nor one
/// in the pressure costs a restart. The same sequence of calls gives the same bits.
class ArmPlant {
 public:
  /// @throw std::invalid_argument for settings that describe no arm (sizes that do not match,
  /// numbers that are not
  ///        finite, an inertia that is not positive, tolerances that are not positive).
  explicit ArmPlant(const PlantSettings& settings);
  ~ArmPlant();
  ArmPlant(ArmPlant&&) noexcept;
  ArmPlant& operator=(ArmPlant&&) noexcept;

  int segments() const noexcept;
  int dof() const noexcept;       ///< coordinates of the kind at hand
  int chambers() const noexcept;  ///< of all segments together

  /// Sets what the valves are commanded from now on. @param command_bar `chambers()` pressures
  /// above ambient, segment by segment; bounded to the supply. They come into force after the dead
  /// time, if any.
  void command(std::span<const double> command_bar);

  /// Integrates up to `t_end_s` with the command held; nothing happens if that is not ahead. Stops
  /// on its way where a command comes into force after its dead time, or an external load begins or
  /// ends.
  /// @throw PlantError if the tolerance cannot be met; the plant is then where it was before the
  /// call, or at the last of these stops.
  void advance(double t_end_s);

  /// Both of the above.
  void advance(double t_end_s, std::span<const double> command_bar);

  /// Puts the arm into another state (u in rad, velocity in rad/s, 2n each; pressures in bar),
  /// spread over the parts of the segments as in `PlantSettings::initial_u_rad`,
  /// without elongation, keeping the time; `supplied` and `dissipated` count from here. @throw std::invalid_argument
  /// for sizes or numbers that are wrong.
  void reset(ConstVectorRef u_rad, ConstVectorRef velocity_radps,
             std::span<const double> pressure_bar);

  double time_s() const noexcept;

  /// u (2n, rad) and u' (rad/s). Where a segment has several parts: of the PCC segment whose end is
  /// turned as this segment's end is, by the orientation part of the estimator's formula, without
  /// the twist that a PCC segment has not; theta on [0, 2 pi).
  void curvature(SegmentVector& u_rad, SegmentVector& velocity_radps) const noexcept;
  SegmentVector u_rad() const noexcept;
  SegmentVector velocity_radps() const noexcept;
  /// e (n, m) and e' (m/s) where segments stretch, otherwise empty.
  SegmentScalars elongation_m() const noexcept;
  SegmentScalars elongation_rate_mps() const noexcept;

  /// The coordinates of the kind at hand and their rates, `dof()` each: u of every segment (pcc;
  /// where segments stretch [u_x, u_y, e] with e in m) or piece (refined), or the angles about x and
  /// y of every joint (links), base to tip; rad, rad/s.
  Eigen::VectorXd coordinates() const noexcept;
  Eigen::VectorXd coordinate_rates() const noexcept;

  const Eigen::VectorXd& pressures_bar() const noexcept;  ///< behind the valves
  const Eigen::VectorXd& commanded_bar() const noexcept;

  Eigen::Isometry3d base() const noexcept;  ///< world frame
  void segment_ends(
      std::span<Eigen::Isometry3d> segment_ends) const noexcept;  ///< n poses, world frame
  Eigen::Vector3d tip_m() const noexcept;                         ///< world frame
  PlantEnergies energies() const noexcept;
  IntegratorCounters counters() const noexcept;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace softarm
