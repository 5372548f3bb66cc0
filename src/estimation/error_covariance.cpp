#include "estimation/error_covariance.hpp"

namespace softarm {

template <int kSegments>
bool ErrorCovariance<kSegments>::propagate(double step_s, const Model& model) noexcept {
  if (!transition(step_s, model)) return false;
  const int m = 2 * dof_, rest = dof_ + parameter_count();
  // Covariance of the total unknown force, d + regressors p, with everything.
  auto& force = force_;
  force.resize(dof_, P_.cols());
  force = P_.middleRows(disturbance(), dof_);
  for (int i = 0; i < dof_ / 2; ++i)
    force.template middleRows<2>(2 * i).noalias() +=
        model.regressors.template middleRows<2>(2 * i) *
        P_.template middleRows<kParameters>(parameters() + kParameters * i);
  force_force_.resize(dof_, dof_);
  force_force_ = force.middleCols(disturbance(), dof_);
  for (int i = 0; i < dof_ / 2; ++i)
    force_force_.template middleCols<2>(2 * i).noalias() +=
        force.template middleCols<kParameters>(parameters() + kParameters * i) *
        model.regressors.template middleRows<2>(2 * i).transpose();

  moved_.noalias() = arm_ * P_.topRows(m);
  moved_.noalias() += by_force_ * force;
  auto& crossed = crossed_;
  crossed.noalias() = arm_ * force.leftCols(m).transpose();
  crossed.noalias() += by_force_ * force_force_;
  auto& own = own_;
  own.noalias() = moved_.leftCols(m) * arm_.transpose();
  own.noalias() += crossed * by_force_.transpose();
  P_.topLeftCorner(m, m) = 0.5 * (own + own.transpose());
  P_.topRightCorner(m, rest) = moved_.rightCols(rest);
  P_.bottomLeftCorner(rest, m) = moved_.rightCols(rest).transpose();
  return true;
}

template <int kSegments>
bool ErrorCovariance<kSegments>::measure(const Vector& innovation, const Square& R, bool hold,
                                         Correction& correction, double& nis) noexcept {
  factor_.compute(P_.topLeftCorner(dof_, dof_) + R);
  if (factor_.info() != Eigen::Success) return false;
  gain_ = P_.topRows(dof_);
  factor_.matrixL().solveInPlace(gain_);
  white_ = innovation;
  factor_.matrixL().solveInPlace(white_);
  nis = white_.squaredNorm();
  if (!(nis < 1e12)) return false;
  const int updated = hold ? 3 * dof_ : static_cast<int>(P_.cols());
  correction.resize(P_.cols());
  correction.setZero();
  correction.head(updated).noalias() = gain_.leftCols(updated).transpose() * white_;
  const auto known = gain_.leftCols(updated);
  P_.topLeftCorner(updated, updated).noalias() -= known.transpose() * known;
  if (hold) {
    const int rest = parameter_count();
    P_.topRightCorner(updated, rest).noalias() -= known.transpose() * gain_.rightCols(rest);
    P_.bottomLeftCorner(rest, updated) = P_.topRightCorner(updated, rest).transpose();
  }
  return true;
}

template <int kSegments>
bool ErrorCovariance<kSegments>::transition(double h, const Model& model) noexcept {
  constexpr double kGamma = 0.29289321881345248;  // 1 - 1/sqrt(2): L-stable
  const int n = dof_;
  step_ = (kGamma * h * kGamma * h) * model.stiffness + model.inertia;
  step_.diagonal() += kGamma * h * model.damping;
  factor_.compute(step_);
  if (factor_.info() != Eigen::Success) return false;
  // One column for every u, every v and every force.
  u_.setZero(n, 3 * n);
  v_.setZero(n, 3 * n);
  u_.leftCols(n).setIdentity();
  v_.middleCols(n, n).setIdentity();
  // Force left over at (u, v), then B k_v and k_u of both stages.
  k1v_ = -model.stiffness * u_ - kGamma * h * (model.stiffness * v_);
  k1v_.noalias() -= model.damping.asDiagonal() * v_;
  k1v_.rightCols(n).diagonal().array() += 1.0;
  factor_.solveInPlace(k1v_);
  k1u_ = v_ + kGamma * h * k1v_;
  u2_ = u_ + h * k1u_;
  v2_ = v_ + h * k1v_;
  rate_ = v2_ - 2.0 * k1u_;
  k2v_.noalias() = -model.stiffness * u2_;
  k2v_.noalias() -= model.damping.asDiagonal() * v2_;
  k2v_.rightCols(n).diagonal().array() += 1.0;
  k2v_.noalias() -= 2.0 * model.inertia * k1v_;
  k2v_.noalias() -= kGamma * h * model.stiffness * rate_;
  factor_.solveInPlace(k2v_);
  u_ += 1.5 * h * k1u_ + 0.5 * h * (rate_ + kGamma * h * k2v_);
  v_ += 1.5 * h * k1v_ + 0.5 * h * k2v_;
  arm_.resize(2 * n, 2 * n);
  arm_.topRows(n) = u_.leftCols(2 * n);
  arm_.bottomRows(n) = v_.leftCols(2 * n);
  by_force_.resize(2 * n, n);
  by_force_.topRows(n) = u_.rightCols(n);
  by_force_.bottomRows(n) = v_.rightCols(n);
  return true;
}

template class ErrorCovariance<1>;
template class ErrorCovariance<6>;

}  // namespace softarm
