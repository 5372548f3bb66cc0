#include "simulation/stage_solver.hpp"

#include <algorithm>
#include <cmath>

namespace softarm {

StageSolver::StageSolver(SecondOrderSystem& system) : system_(system) {
  const Eigen::Index n = system.size();
  for (Eigen::VectorXd* vector : {&x_, &v_, &a_, &guess_, &residual_, &correction_}) {
    vector->setZero(n);
  }
  for (Eigen::MatrixXd* matrix : {&by_a_, &by_v_, &by_x_, &matrix_}) {
    matrix->setZero(n, n);
  }
  lu_ = Eigen::PartialPivLU<Eigen::MatrixXd>(n);
}

void StageSolver::reset(SecondOrderSystem::ConstVector acceleration) {
  a_ = acceleration;
  linearized_ = false;
}

void StageSolver::place(const Stage& stage) {
  v_.noalias() = stage.s_v + stage.gamma_s * a_;
  x_.noalias() = stage.s_x + stage.gamma_s * v_;
}

void StageSolver::factorize(double gamma_s) {
  matrix_.noalias() = by_a_ + gamma_s * (by_v_ + gamma_s * by_x_);
  lu_.compute(matrix_);
  gamma_s_ = gamma_s;
  rate_ = 1.0;
}

void StageSolver::linearize(const Stage& stage) {
  system_.linearize(stage.t_s, x_, v_, a_, by_a_, by_v_, by_x_);
  linearized_ = true;
  age_ = 0;
  wasted_ = 0;
  ++linearizations_;
  factorize(stage.gamma_s);
}

StageSolver::Outcome StageSolver::iterate(const Stage& stage) {
  double previous = 0.0;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    system_.residual(stage.t_s, x_, v_, a_, residual_);
    correction_.noalias() = lu_.solve(residual_);
    ++iterations_;
    a_ -= correction_;
    place(stage);
    const double gamma = stage.gamma_s;
    const double squares = gamma * gamma *
                           (gamma * gamma * correction_.cwiseProduct(stage.weight_x).squaredNorm() +
                            correction_.cwiseProduct(stage.weight_v).squaredNorm());
    const double norm = std::sqrt(squares / stage.components);
    if (!std::isfinite(norm)) {
      return Outcome::failed;
    }
    if (iteration > 0) {
      rate_ = std::max(0.3 * rate_, previous > 0.0 ? norm / previous : 0.0);
    }
    if (norm * std::min(1.0, rate_) <= stage.tolerance) {
      return Outcome::converged;
    }
    if (iteration > 0 && norm > 0.9 * previous) {
      // Where round-off ends the iteration, what it reached may do.
      return norm <= stalled_tolerance_ ? Outcome::converged : Outcome::slow;
    }
    previous = norm;
  }
  return Outcome::slow;
}

bool StageSolver::solve(const Stage& stage) {
  guess_ = a_;
  place(stage);
  const bool fresh = !linearized_ || age_ > kMaxAge;
  if (fresh) {
    linearize(stage);
  } else if (std::abs(stage.gamma_s - gamma_s_) > 1e-3 * gamma_s_) {
    factorize(stage.gamma_s);
  }
  ++age_;
  const std::int64_t before = iterations_;
  Outcome outcome = iterate(stage);
  if (outcome == Outcome::converged) {
    // A new matrix costs about as much as two residuals a coordinate; a good one needs two
    // iterations a stage. Where the old one has wasted as much, it goes.
    wasted_ += std::max<std::int64_t>(0, iterations_ - before - 2);
    linearized_ = wasted_ < 2 * a_.size();
    return true;
  }
  if (!fresh) {
    a_ = guess_;
    place(stage);
    linearize(stage);
    outcome = iterate(stage);
  }
  if (outcome != Outcome::converged) {
    a_ = guess_;
    linearized_ = false;
    return false;
  }
  return true;
}

bool StageSolver::correct(double t_s, double gamma_s, const Eigen::VectorXd& s,
                          const double* prediction, const double* weights, double tolerance,
                          const double* guess, bool energy, double* correction) {
  using ConstMap = Eigen::Map<const Eigen::VectorXd>;
  const Eigen::Index n = a_.size();
  if (guess != nullptr) a_ = ConstMap(guess, n);
  const Stage stage{.t_s = t_s,
                    .gamma_s = gamma_s,
                    .s_x = ConstMap(s.data(), n),
                    .s_v = ConstMap(s.data() + n, n),
                    .weight_x = ConstMap(weights, n),
                    .weight_v = ConstMap(weights + n, n),
                    .tolerance = tolerance,
                    .components = static_cast<double>(s.size())};
  if (!solve(stage)) return false;
  Eigen::Map<Eigen::VectorXd>(correction, n) = x_ - ConstMap(prediction, n);
  Eigen::Map<Eigen::VectorXd>(correction + n, n) = v_ - ConstMap(prediction + n, n);
  if (energy) {
    const auto powers = system_.powers(t_s, x_, v_);
    correction[2 * n] = s[2 * n] + gamma_s * powers.supplied_w - prediction[2 * n];
    correction[2 * n + 1] = s[2 * n + 1] + gamma_s * powers.dissipated_w - prediction[2 * n + 1];
  }
  return true;
}

}  // namespace softarm
