// What the model observer knows of segments that stretch: e, the axial force that the model does not
// explain, and by how much k_a, beta_a and the chambers' areas differ.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "estimation/arm_predictor.hpp"
#include "estimation/innovation_monitor.hpp"
#include "softarm/estimation/curvature_estimator.hpp"
#include "softarm/estimation/curvature_filter.hpp"
#include "softarm/estimation/settings.hpp"
#include "softarm/model/coordinates.hpp"
#include "softarm/model/dynamics.hpp"
#include "softarm/model/model_correction.hpp"

namespace softarm {

/// One Kalman filter a segment, of e, d and three parameters, under
///
///   (1 + b) beta_a e' = (1 + c) N + d - (1 + a) k_a e - I,
///
/// N the axial force of the chambers behind the valves' lag, I the e row of B q'' + C q' + G. Inertia
/// along e is left out of e' (rates of beta_a / m, thousands per second, beside k_a / beta_a). Bends
/// enter through I alone, and are taken as known. The rows of u are those of an arm of the present
/// lengths and a force, B_ue e'' + C_ue e', that is known from the reference: so bends and elongations
/// have separate filters, not a joint one of 3n coordinates.
///
/// e is measured from the chord. d is a random walk tuned as that of the bends; the parameters are
/// constants that are learnt along a reference, and what changes later is d. No allocation, no clock.
class AxialObserver {
 public:
  /// @param arm extensible  @param commands that are kept, `lag_s` as TorqueHistory
  AxialObserver(const ArmParameters& arm, const ModelObserverSettings& settings, int commands,
                double lag_s);

  /// tau_A (3n) in force from `from_ns` on.
  void command(std::int64_t from_ns, ConstVectorRef tau_actuation) noexcept;
  void clear() noexcept { history_.clear(); }

  /// At rest as measured.
  void start(std::int64_t capture_ns, const CurvatureEstimate& estimate) noexcept;
  void forget_parameters() noexcept;

  /// On to the newest frame or an instant without one.
  /// @param u, velocity of the bends there, 2n  @param reference 3n, or null  @return whether all
  /// is finite
  bool advance(std::int64_t time_ns, ConstVectorRef u_rad, ConstVectorRef velocity_radps,
               const KnownMotion* reference) noexcept;
  /// Takes the lengths of a frame at the instant that advance() came to.
  /// @param learn the parameters too
  bool correct(const CurvatureEstimate& estimate, double since_s, bool learn) noexcept;

  /// e (m) and e' (m/s), n each, at `time_ns` under the commands known by then.
  void predict(std::int64_t time_ns, SegmentScalars& e_m, SegmentScalars& rates_mps) noexcept;

  /// At the newest frame, m.
  const SegmentScalars& e_m() const noexcept { return now_.e_m; }
  /// B_ue e'' + C_ue e' where advance() came to, 2n, N m.
  const SegmentVector& coupling_nm() const noexcept { return coupling_nm_; }
  /// Its axial members.
  void put(ModelCorrection& correction) const noexcept;
  void put_deviation(ModelCorrection& deviation) const noexcept;
  /// e at the newest frame and its standard deviation, m.
  void put_elongation(SegmentScalars& e_m, SegmentScalars& deviation_m) const noexcept;
  bool at_limit() const noexcept { return at_limit_; }

 private:
  static constexpr int kStates = 5;  ///< e, d, a, b, c
  using State = Eigen::Matrix<double, kStates, 1>;
  using Covariance = Eigen::Matrix<double, kStates, kStates>;
  struct Motion {
    LaggedTorque force;  ///< N, n numbers
    SegmentScalars e_m;
  };

  void advance(std::int64_t time_ns, Motion& motion) noexcept;
  double push_n(std::size_t i, double force_n) const noexcept;
  double stiffness(std::size_t i) const noexcept;
  double damping(std::size_t i) const noexcept;
  double rate_mps(std::size_t i, const Motion& motion) const noexcept;
  void propagate(double step_s, const KnownMotion* reference) noexcept;

  ArmParameters arm_;
  ModelObserverSettings settings_;
  ArmParameters bends_;  ///< at the present lengths, not extensible
  DynamicsWorkspace workspace_, bends_workspace_;
  TorqueHistory history_;
  SegmentVector scale_n_;
  InnovationMonitor monitor_;
  Motion now_, ahead_;
  std::array<State, kMaxSegments> error_;  ///< estimates of d, a, b, c; e is in now_
  std::array<Covariance, kMaxSegments> P_;
  SegmentScalars beside_n_, reference_n_;  ///< I at the arm, and N on the reference
  SegmentVector q_, velocity_, acceleration_, force_, mean_force_, forces_;
  SegmentVector coupling_nm_, bends_force_;
  bool at_limit_ = false;
};

}  // namespace softarm
