// The motion of an arm without inertia: springs, damping, gravity and friction balance the input.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <functional>
#include <optional>
#include <vector>

#include "softarm/commissioning/identification/response_model.hpp"

namespace softarm {

/// Where the springs rest, as the remanence of an arm moves it.
class RemanentRest {
 public:
  /// @param rest  becomes that of the arm with what is remanent, 2n
  void begin(const ArmHypothesis& arm, Eigen::VectorXd& rest);
  /// The same after `step_s` at the bend u.
  void step(const ArmHypothesis& arm, const Eigen::VectorXd& u, double step_s,
            Eigen::VectorXd& rest);

 private:
  Eigen::VectorXd slow_, second_;  // 2n
};

/// Stiffness that follows the length of a segment: k (l / L)^q with l = pressed + c |u|^2.
class StretchedStiffness {
 public:
  /// @param arm  must outlive this
  explicit StretchedStiffness(const ArmHypothesis& arm) : arm_(arm) {}

  /// The lengths from frame k - 1 to frame k, k = 0 at the first; without any it is k alone.
  void at(Eigen::Index k, const KnownLengths& lengths);
  bool given() const { return pressed_m_.size() > 0; }

  /// (l / L)^q of segment i with the bend u.
  double factor(Eigen::Index i, const Eigen::Vector2d& u) const;
  /// Its gradient in u.
  Eigen::Vector2d gradient(Eigen::Index i, const Eigen::Vector2d& u) const;

 private:
  double length_ratio(Eigen::Index i, const Eigen::Vector2d& u) const;

  const ArmHypothesis& arm_;
  Eigen::VectorXd pressed_m_;
  double by_bend_m_per_rad2_ = 0.0;
};

/// D u' = input - springs - slip springs - G(u), by the third-order stiffly accurate SDIRK method
/// (Alexander 1977, L-stable): stable for any step and any damping, D = 0 included, where every step
/// ends in balance. What remembers is advanced at the end of a step.
class QuasiStaticMotion {
 public:
  static constexpr int kStages = 3;
  /// Of the stages, as parts of a step.
  static const double kNodes[kStages];

  /// @param arm  must outlive this
  explicit QuasiStaticMotion(const ArmHypothesis& arm);

  /// Starts in balance under an input. False where there is none.
  [[nodiscard]] bool settle(const Eigen::VectorXd& input);

  /// One step; inputs at the stages. False where it has no bounded solution.
  [[nodiscard]] bool step(double step_s, const Eigen::VectorXd (&inputs)[kStages]);

  StretchedStiffness& stretched() { return stretched_; }

  const Eigen::VectorXd& u_rad() const { return u_; }

 private:
  void balance(const Eigen::VectorXd& u, Eigen::VectorXd& out);
  void slope(const Eigen::VectorXd& u);
  void load(const Eigen::VectorXd& input);
  [[nodiscard]] bool solve(double damped_s, const Eigen::VectorXd& base, Eigen::VectorXd& u);
  void remember(double step_s);

  const ArmHypothesis& arm_;
  ArmParameters plain_;
  DynamicsWorkspace workspace_;
  bool heavy_ = false;
  Eigen::MatrixXd gravity_slope_;
  Eigen::VectorXd damping_, stiffness_;  ///< of every coordinate; stiffness as it counts now
  StretchedStiffness stretched_;
  Eigen::VectorXd input_, force_, rest_;  ///< of the stage; rest with what is remanent
  RemanentRest remanents_;
  std::vector<Eigen::VectorXd> centres_;  ///< 2n, of every slip spring
  Eigen::VectorXd u_, left_, change_, base_, rates_[kStages], stage_;
  Eigen::MatrixXd slope_;
  Eigen::PartialPivLU<Eigen::MatrixXd> lu_;
  double factored_for_s_ = -1.0;  ///< damped_s of lu_
};

}  // namespace softarm
