// u and u' at the instant a command acts, from the arm's model: a Kalman filter on (16) with the
// valves' lag, a disturbance, and what the arm differs from its model by.
//
//   observer.update(frame, validator.estimate(), reference, learn);   // every accepted frame
//   observer.predict(now_ns, act_ns, motion);                         // every tick
//   observer.command(now_ns, tau_actuation_nm);                       // what was sent
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>

#include "softarm/estimation/curvature_estimator.hpp"
#include "softarm/estimation/curvature_filter.hpp"
#include "softarm/estimation/observer_report.hpp"
#include "softarm/estimation/settings.hpp"
#include "softarm/model/model_correction.hpp"

namespace softarm {

/// What lies between a command and the arm, and between the arm and a frame.
struct ObserverTiming {
  double valve_lag_s = 0.0;        ///< first order, from set point to pressure
  double max_latency_s = 0.05;     ///< no frame older than this comes
  double control_period_s = 2e-3;  ///< between commands
  double dead_time_s = 0.0;        ///< of valves and tubes
};

/// State: u, u', a disturbance (generalized force) d, and five parameters a segment: stiffness,
/// damping, gain and a horizontal load (ModelCorrection). The torque behind the valves' lag follows
/// exactly from the commands. d and the parameters are random walks; what d needs grows by itself
/// while it is seen to move.
///
/// Measurements are the relative orientations of the bodies, with the covariance of bodies that two
/// segments share and the base averaged over two seconds. Positions are left out: where an arm is
/// not quite PCC they cost more than they bring.
///
/// Segments that stretch: bends as of an arm of the present lengths, and a separate filter for e of
/// every segment, measured from the chord, with an axial force, k_a, beta_a and areas that differ.
/// tau_A, references and motions have 3n numbers, disturbances and Jacobians 2n.
///
/// Up to kJointSegments segments errors have a joint covariance, O(n^3) a frame; longer arms one
/// small filter a segment, with the arm's joint motion predicted all the same.
///
/// Reads no clock, allocates and throws nothing after construction; bounded work.
class ModelObserver {
 public:
  static constexpr int kJointSegments = 6;

  /// `noise` holds n + 1 bodies, the base first.
  /// @throws std::invalid_argument as CurvatureEstimator, and for times or deviations out of range
  ModelObserver(const ArmParameters& arm, const EstimationSettings& settings,
                std::span<const BodyNoise> noise, const ObserverTiming& timing);
  ~ModelObserver();
  ModelObserver(ModelObserver&&) noexcept;
  ModelObserver& operator=(ModelObserver&&) noexcept;

  /// tau_A (2n, N m) is sent at `now_ns`, and in force from the dead time later on; calls in order
  /// of time.
  void command(std::int64_t now_ns, ConstVectorRef tau_actuation_nm) noexcept;
  /// The valves have vented by themselves: no torque, and everything starts again.
  void vented() noexcept;

  /// Takes one accepted frame; `estimate` says which segments it shows. A frame that is not later
  /// than the last one is ignored.
  /// @param reference the motion that is asked for at the capture, or null: parameters are learnt
  /// along it, as regressors taken from the estimate itself would be biased by its noise
  /// @param learn whether parameters may change; without a reference they do not
  void update(const MocapFrame& frame, const CurvatureEstimate& estimate,
              const KnownMotion* reference, bool learn) noexcept;

  /// u and u' the dead time after `act_ns` >= now_ns, when what is sent at `now_ns` and held beyond
  /// `act_ns` acts. Until then the last command is taken to stay in force. Not valid where the
  /// observer does not run.
  void predict(std::int64_t now_ns, std::int64_t act_ns, FilteredMotion& out) noexcept;

  /// Forgets the motion and the disturbance, and keeps the parameters.
  void reset() noexcept;

  /// It has started from a frame with every segment, and nothing has failed since.
  bool running() const noexcept;
  /// Times that it had to start again because a matrix could not be factored.
  std::int64_t failures() const noexcept;

  const ModelCorrection& correction() const noexcept;
  /// Standard deviations of the correction, in the same units.
  void deviation(ModelCorrection& out) const noexcept;
  /// Standard deviations of u (rad) and u' (rad/s) at the newest frame.
  void deviation(FilteredMotion& out) const noexcept;

  /// The newest innovation's square, in units of its covariance, a component: 1 on the average.
  double nis() const noexcept;
  /// Something sudden: for 25 ms innovations have been larger than the covariance explains.
  bool surprised() const noexcept;
  /// A parameter stands at the limit of what is taken for a correction of the model.
  bool wrong_model() const noexcept;
  /// u (2n, rad) at the newest frame.
  const SegmentVector& newest_u_rad() const noexcept;
  /// tau_A (2n, N m) behind the valves at `time_ns`, as it follows from the commands.
  void modelled_torque(std::int64_t time_ns, SegmentVector& tau_nm) noexcept;
  /// Of a disturbance d (2n, N m) that is thought to be J^T F: the information J P^-1 J^T about F and
  /// J P^-1 d, with P the covariance of the estimated disturbance. O(n) above kJointSegments.
  /// @param jacobian J, 3 x 2n, m
  /// @return false, with both zero, where P cannot be factored
  bool project_disturbance(Eigen::Ref<const Eigen::Matrix3Xd> jacobian,
                           ConstVectorRef disturbance_nm, Eigen::Matrix3d& information,
                           Eigen::Vector3d& weighted) const noexcept;

  /// All of the above for a status; its force and what follows from it stay as they were.
  void report(ObserverReport& out) const noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace softarm
