// Newton's iteration for one stage of a diagonally implicit method, on the residual of a
// second-order system.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <cstdint>

#include "softarm/simulation/second_order_system.hpp"

namespace softarm {

/// Solves for a in r(t, x, v, a) = 0 with v = s_v + gamma a and x = s_x + gamma v, as a stage of a
/// diagonally implicit Runge-Kutta method asks. Newton's matrix is dr/da + gamma dr/dv + gamma^2
/// dr/dx of size n (not 2n); its three parts are kept from step to step until the iteration slows
/// down.
class StageSolver {
 public:
  explicit StageSolver(SecondOrderSystem& system);

  struct Stage {
    double t_s = 0.0;
    double gamma_s = 0.0;
    Eigen::Map<const Eigen::VectorXd> s_x;
    Eigen::Map<const Eigen::VectorXd> s_v;
    Eigen::Map<const Eigen::VectorXd> weight_x;  ///< 1 / allowed error
    Eigen::Map<const Eigen::VectorXd> weight_v;
    double tolerance = 0.1;   ///< on the weighted norm of the correction
    double components = 1.0;  ///< over which that norm is a root mean square
  };

  /// True on convergence: x(), v(), a() hold the stage. False if it diverges or meets numbers that
  /// are not finite.
  bool solve(const Stage& stage);

  /// The same for SUNDIALS' implicit equation z = s + gamma f(t, z) of y = (x, v) or, with
  /// `energy`, (x, v, work supplied, work dissipated): correction = z - prediction. @param weights
  /// 1 / allowed error of every component. @param guess of a, or null: the last a found.
  bool correct(double t_s, double gamma_s, const Eigen::VectorXd& s, const double* prediction,
               const double* weights, double tolerance, const double* guess, bool energy,
               double* correction);

  /// Forgets everything: the next stage linearizes again and guesses from `acceleration`.
  void reset(SecondOrderSystem::ConstVector acceleration);

  /// A stage whose iteration stalls counts as solved below this norm of the correction. Default:
  /// none does.
  void accept_stalled(double tolerance) { stalled_tolerance_ = tolerance; }

  /// The next stage linearizes again.
  void forget() { linearized_ = false; }

  const Eigen::VectorXd& x() const { return x_; }
  const Eigen::VectorXd& v() const { return v_; }
  const Eigen::VectorXd& a() const { return a_; }

  std::int64_t iterations() const { return iterations_; }
  std::int64_t linearizations() const { return linearizations_; }

 private:
  enum class Outcome { converged, slow, failed };

  Outcome iterate(const Stage& stage);
  void linearize(const Stage& stage);
  void factorize(double gamma_s);
  void place(const Stage& stage);

  static constexpr int kMaxIterations = 8;
  static constexpr int kMaxAge = 400;  // stages

  SecondOrderSystem& system_;
  Eigen::VectorXd x_, v_, a_, guess_, residual_, correction_;
  Eigen::MatrixXd by_a_, by_v_, by_x_, matrix_;
  Eigen::PartialPivLU<Eigen::MatrixXd> lu_;
  double gamma_s_ = 0.0;  // that the factorization is for
  double rate_ = 1.0;     // of convergence, as last seen
  double stalled_tolerance_ = 0.0;
  bool linearized_ = false;
  int age_ = 0;
  std::int64_t wasted_ = 0;  // iterations since the linearization that a better one had saved
  std::int64_t iterations_ = 0;
  std::int64_t linearizations_ = 0;
};

}  // namespace softarm
