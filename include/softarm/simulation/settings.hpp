// What an experiment says about the simulated arm: its parameters, valves, sensing and integrator.
// config/template.yaml documents every setting.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "softarm/actuation/settings.hpp"
#include "softarm/model/arm.hpp"
#include "softarm/simulation/external_loads.hpp"
#include "softarm/simulation/plant_kinds.hpp"

namespace softarm {

/// First-order valves between a commanded and a real pressure. Left out (lag 0): the command is the
/// pressure. With actuation by torque, read N m for bar.
struct ValveSettings {
  double lag_s = 0.0;
  double supply_pressure_bar = 2.0;
  double dead_time_s = 0.0;
  double vent_lag_s = 0.0;  ///< where a pressure falls; 0: `lag_s`
  double slew_bar_per_s = 0.0;
  double resolution_bar = 0.0;
  double play_bar = 0.0;       ///< half the backlash between set point and what the valve aims at
  double dead_band_bar = 0.0;  ///< set points nearer to what the valve aims at do nothing
  /// The common supply falls by this times the sum of the rates at which pressures rise. Needs a lag.
  double supply_sag_s = 0.0;
};

/// How the body of an arm differs from a linear spring and damper. Left out, it costs nothing.
struct MaterialSettings {
  /// Part of every pressure that acts on the arm through play operators (Prandtl-Ishlinskii) of
  /// these half widths, in equal shares: loops between pressure and moment.
  double hysteresis = 0.0;
  std::vector<double> play_bar = {0.02, 0.05, 0.1};
  double cubic_per_rad2 = 0.0;  ///< K u becomes K u (1 + cubic |u|^2)
  double stiffening_per_bar =
      0.0;  ///< K becomes K (1 + stiffening sum p) by the segment's pressures
  /// A Maxwell element beside K: the moment remanence K (u - z) with z' = (u - z) / remanence_s. An
  /// arm that was held bent comes back bent.
  double remanence = 0.0;
  double remanence_s = 10.0;
  double remanence_2 = 0.0;  ///< a second one, of another time
  double remanence_2_s = 2.0;
  /// The same elements beside K_a of an arm that stretches, in parts of that: as its bend, its length
  /// follows what was before, within the same times.
  double axial_remanence = 0.0, axial_remanence_2 = 0.0;
  /// Hysteresis of the moment by Bouc and Wen (`BoucWen`), beside K: the moment bouc_wen K z.
  double bouc_wen = 0.0;
  double bouc_wen_rad = 0.1;  ///< its limit
  double bouc_wen_exponent = 1.0;
  double bouc_wen_shape = 0.5;

  /// The moment depends on more than u, u' and pressures behind valves.
  bool bends_otherwise() const {
    return cubic_per_rad2 != 0.0 || stiffening_per_bar != 0.0 || relaxes() || bouc_wen != 0.0;
  }
  /// Any of the Maxwell elements is there.
  bool relaxes() const {
    return remanence != 0.0 || remanence_2 != 0.0 || axial_remanence != 0.0 ||
           axial_remanence_2 != 0.0;
  }
};

/// Simulated motion capture.
struct MocapSettings {
  double rate_hz = 200.0;
  double latency_s = 0.0;
  double position_noise_m = 0.0;
  double orientation_noise_rad = 0.0;
  double position_resolution_m = 0.0;
  double dropout_probability = 0.0;
  bool noise_on_base = true;
};

/// Which method of SUNDIALS integrates; docs/results/plant_methods.md has what each costs. The
/// first three are diagonally implicit Runge-Kutta methods (stiffly accurate, no explicit first
/// stage): a sampled command costs them nothing. All but `erk` work on the O(n) residual.
enum class IntegratorMethod {
  sdirk2,    ///< ARKODE: Alexander's two stages, order 2: least work under a sampled command
  cash4,     ///< ARKODE: Cash's five stages, order 4: least error under a sampled command
  sdirk4,    ///< ARKODE: Hairer and Wanner's five stages, order 4: least error of a free motion
  erk,       ///< ARKODE: Dormand and Prince, order 5, on the explicit x'': an independent check
  cvode_bdf  ///< CVODE: backward differences, order 1 to 5: fastest in a smooth motion; starts
             ///< again wherever the torque itself jumps
};

/// The absolute tolerance of u' (rad/s) over that of u (rad), in 1/s.
inline constexpr double kVelocityTolerance = 1000.0;

/// What the integrator has done so far.
struct IntegratorCounters {
  std::int64_t steps = 0;
  std::int64_t rejected_steps = 0;
  std::int64_t residual_evaluations = 0;  ///< Newton iterations of all stages
  std::int64_t linearizations = 0;
  std::int64_t retries = 0;  ///< calls that failed once and then succeeded
};

/// The simulated arm. Its `arm` and `actuation` may differ from the controller's model.
struct PlantSettings {
  PlantKind kind;  ///< what it is made of
  ArmParameters arm;
  ActuationSettings actuation;
  ValveSettings valves;
  MaterialSettings material;
  /// Generalized force of every chamber in turn on all segments, beside its own moment: 2n numbers a
  /// chamber, N m/bar. Empty or all zero: none.
  std::vector<double> cross_nm_per_bar;
  bool crosses() const {
    return std::any_of(cross_nm_per_bar.begin(), cross_nm_per_bar.end(),
                       [](double force) { return force != 0.0; });
  }
  MocapSettings mocap;
  /// At rest. Where a segment has several parts, each takes its share, as under a uniform moment.
  SegmentVector initial_u_rad;
  Eigen::Vector3d tip_force_n = Eigen::Vector3d::Zero();
  std::vector<ExternalLoad> loads;
  std::vector<double> payload_kg;  ///< point masses on the segments' ends; empty: none, else n
  BaseMotion base_motion;
  IntegratorMethod method = IntegratorMethod::sdirk2;
  /// Of the integrator. The defaults are for closed loops: tolerances that see no more of a sampled
  /// torque than a motion shows, and steps short enough to be far more exact than these.
  double relative_tolerance = 1e-3;
  double absolute_tolerance = 1e-4;  ///< of u (rad); kVelocityTolerance times that of u' (rad/s)
  double max_step_s = 1e-3;
  bool account_energy = false;  ///< integrate work and dissipation along
  std::uint64_t seed = 1;
};

}  // namespace softarm
