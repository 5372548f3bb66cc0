// What the model observer knows, and its work on one frame.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "estimation/arm_predictor.hpp"
#include "estimation/axial_observer.hpp"
#include "estimation/base_average.hpp"
#include "estimation/error_covariance.hpp"
#include "estimation/innovation_monitor.hpp"
#include "estimation/orientation_noise.hpp"
#include "softarm/estimation/model_observer.hpp"

namespace softarm {

/// The motion at one instant.
struct Motion {
  LaggedTorque torque;
  SegmentVector u, velocity;
};

struct ModelObserver::State {
  static constexpr int kJoint = kJointSegments;

  State(const ArmParameters& arm_, const EstimationSettings& settings_,
        std::span<const BodyNoise> noise_, const ObserverTiming& timing_);

  void start(std::int64_t capture_ns) noexcept;
  bool advance_motion(std::int64_t time_ns, Motion& motion) noexcept;
  bool advance_base(std::int64_t time_ns, const KnownMotion* reference) noexcept;
  void find_regressors(const KnownMotion* reference) noexcept;
  void find_gravity_slope() noexcept;
  void note_excitation(double step_s, const KnownMotion* reference) noexcept;
  void measure(const MocapFrame& frame, const CurvatureEstimate& estimate, double since_s) noexcept;
  bool correct(double since_s) noexcept;
  void limit_corrections() noexcept;
  void fail() noexcept;
  void forget_parameters() noexcept;
  void take_lengths() noexcept;

  template <int k>
  bool propagate(ErrorCovariance<k>& errors, GroupModel<2 * k>& model, int first,
                 double step_s) noexcept;
  template <int k>
  bool correct_group(ErrorCovariance<k>& errors, int first, double& nis) noexcept;
  template <class Work>
  bool for_groups(const Work& work) noexcept {
    if (joint_) return work(*joint_, joint_model_, 0);
    for (std::size_t i = 0; i < single_.size(); ++i)
      if (!work(single_[i], single_model_, static_cast<int>(i))) return false;
    return true;
  }

  ArmParameters arm;  ///< at its present lengths, not extensible
  ModelObserverSettings settings;
  int predicted_frames;
  std::int64_t max_latency_ns, delay_ns;
  std::vector<BodyNoise> noise;
  CurvatureEstimator estimator;
  TorqueHistory history;
  ArmPredictor predictor;
  BaseAverage base_average;
  InnovationMonitor monitor;
  SegmentVector scale_nm;
  /// What a payload of one standard deviation makes of stiffness, damping and gain, all relative to
  /// the weight: one number a segment.
  std::vector<double> payload_part;

  std::unique_ptr<AxialObserver> axial;  ///< where segments stretch
  SegmentScalars e_m, rate_mps;          ///< predicted
  ArmParameters whole;                   ///< extensible, for splitting and joining coordinates
  KnownMotion bends;                     ///< the bends of a reference

  std::optional<ErrorCovariance<kJoint>> joint_;
  GroupModel<2 * kJoint> joint_model_;
  std::vector<ErrorCovariance<1>> single_;
  GroupModel<2> single_model_;

  Motion base;   ///< at the newest frame, or the oldest instant a frame can still show
  Motion ahead;  ///< under all the commands that are known
  Motion last;   ///< and on to the instant asked for
  bool ahead_is_stale = true;
  ModelCorrection correction;
  bool running = false, may_learn = true, learns = false, at_limit = false;
  std::int64_t failures = 0;
  std::int64_t newest_ns = 0;
  double nis = 1.0;

  // What one frame measured.
  SegmentVector measured_u;
  std::array<bool, kMaxSegments> seen{};
  std::array<int, kMaxSegments> unseen_frames{};
  std::array<BodyNoiseJacobians, kMaxSegments> noise_jacobian;
  // What the motion has shown of a segment's parameters lately.
  using Parameters = Eigen::Matrix<double, 5, 5>;
  std::array<Parameters, kMaxSegments> information;
  bool regressors_known = false;
  // About the present motion.
  Eigen::Matrix<double, Eigen::Dynamic, 5, Eigen::ColMajor, 2 * kMaxSegments, 5> regressors,
      previous_regressors;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 2 * kJoint, 2 * kJoint>
      gravity_slope;
  SegmentVector mean_torque, along_x, along_y, force, gravity, shifted;
};

}  // namespace softarm
