// The covariance of the model observer's errors, for one group of segments that are treated
// jointly.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace softarm {

/// Linearized arm (16) of a group of g segments about where it is, and what it does not know.
template <int kDof>
struct GroupModel {
  using Square = Eigen::Matrix<double, kDof == 2 ? 2 : Eigen::Dynamic,
                               kDof == 2 ? 2 : Eigen::Dynamic, Eigen::ColMajor, kDof, kDof>;
  using Vector = Eigen::Matrix<double, kDof == 2 ? 2 : Eigen::Dynamic, 1, Eigen::ColMajor, kDof, 1>;
  using Regressors =
      Eigen::Matrix<double, kDof == 2 ? 2 : Eigen::Dynamic, 5, Eigen::ColMajor, kDof, 5>;

  Square inertia;         ///< B
  Square stiffness;       ///< K + dG/du
  Vector damping;         ///< diagonal of D
  Regressors regressors;  ///< d force / d parameter, two rows a segment: N m for a relative change
};

/// Errors of u, u', d (2g each) and of five parameters a segment, in this order, under
///   B v' = -K u - D v + d + regressors p,   d' and p' white noise.
/// kSegments is the capacity; 1 means exactly one, with everything of fixed size. Nothing allocates
/// after construction.
template <int kSegments>
class ErrorCovariance {
 public:
  static constexpr int kDof = 2 * kSegments;
  static constexpr int kParameters = 5;
  using Model = GroupModel<kDof>;
  using Square = typename Model::Square;
  using Vector = typename Model::Vector;

 private:
  static constexpr bool kOne = kSegments == 1;
  template <int kRows, int kColumns>
  using Block =
      Eigen::Matrix<double, kOne ? kRows : Eigen::Dynamic, kOne ? kColumns : Eigen::Dynamic,
                    Eigen::ColMajor, kRows * kSegments, kColumns * kSegments>;

 public:
  using Matrix = Block<11, 11>;
  using Correction =
      Eigen::Matrix<double, kOne ? 11 : Eigen::Dynamic, 1, Eigen::ColMajor, 11 * kSegments, 1>;

  explicit ErrorCovariance(int segments) : dof_(2 * segments), P_(11 * segments, 11 * segments) {
    P_.setZero();
  }

  int u() const noexcept { return 0; }
  int velocity() const noexcept { return dof_; }
  int disturbance() const noexcept { return 2 * dof_; }
  int parameters() const noexcept { return 3 * dof_; }
  int parameter_count() const noexcept { return kParameters * dof_ / 2; }

  const Matrix& matrix() const noexcept { return P_; }

  /// Independent errors with these variances of u, u', d and the parameters.
  void reset(double u, double velocity, const Vector& disturbance, double parameter) noexcept {
    P_.setZero();
    P_.diagonal().segment(0, dof_).setConstant(u);
    P_.diagonal().segment(dof_, dof_).setConstant(velocity);
    P_.diagonal().segment(2 * dof_, dof_) = disturbance;
    P_.diagonal().tail(parameter_count()).setConstant(parameter);
  }
  /// The motion and the disturbance are no longer known; what the parameters were stays.
  void restart_motion(double u, double velocity, const Vector& disturbance) noexcept {
    P_.topRows(3 * dof_).setZero();
    P_.leftCols(3 * dof_).setZero();
    P_.diagonal().segment(0, dof_).setConstant(u);
    P_.diagonal().segment(dof_, dof_).setConstant(velocity);
    P_.diagonal().segment(2 * dof_, dof_) = disturbance;
  }
  /// The horizontal loads, the last two parameters of every segment, are known so well.
  void set_load_variance(double variance) noexcept {
    for (int i = 0; i < dof_ / 2; ++i)
      P_.diagonal().template segment<2>(parameters() + kParameters * i + 3).setConstant(variance);
  }
  /// Adds a variance to every parameter that is known better than `prior_deviation`.
  void add_to_parameters(double variance, double prior_deviation) noexcept {
    const double prior = prior_deviation * prior_deviation;
    for (int j = parameters(); j < static_cast<int>(P_.cols()); ++j)
      if (P_(j, j) < prior) P_(j, j) += variance;
  }
  /// Adds a covariance to the parameters of a segment of the group, but for those that are not known
  /// better than `prior_deviation`.
  void add_to_parameters(int segment, Eigen::Matrix<double, kParameters, kParameters> covariance,
                         double prior_deviation) noexcept {
    const int at = parameters() + kParameters * segment;
    auto own = P_.template block<kParameters, kParameters>(at, at);
    const double prior = prior_deviation * prior_deviation;
    for (int j = 0; j < kParameters; ++j) {
      if (own(j, j) < prior) continue;
      covariance.row(j).setZero();
      covariance.col(j).setZero();
    }
    own += covariance;
  }
  /// Adds to the parameters' covariance what an error along `direction` (5g) with a standard
  /// deviation of 1 makes of it.
  template <class Direction>
  void add_to_parameters(const Direction& direction) noexcept {
    const int count = parameter_count();
    P_.bottomRightCorner(count, count).noalias() += direction * direction.transpose();
  }
  void add_to_disturbance(const Vector& variance) noexcept {
    P_.diagonal().segment(2 * dof_, dof_) += variance;
  }

  /// From one instant to `step_s` later: the two-stage Rosenbrock step that carries the mean, on
  /// the linearized arm. Disturbance and parameters stay. Returns false, with nothing changed,
  /// where the arm's matrix cannot be factored.
  bool propagate(double step_s, const Model& model) noexcept {
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

  /// A measurement of u with covariance R: `innovation` is measured minus predicted. `hold`: the
  /// parameters, though uncertain, are not corrected (Schmidt's filter).
  /// @param correction what to add to the mean, in the order of the errors
  /// @param nis the innovation's square in units of its covariance; 2g on the average
  /// @return false, with nothing changed, where the covariance cannot be factored
  bool measure(const Vector& innovation, const Square& R, bool hold, Correction& correction,
               double& nis) noexcept {
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

  /// Multiplies `columns` (2g rows) by the inverse of the Cholesky factor of the disturbance's
  /// covariance. Returns false, with nothing changed, where there is none.
  template <class Columns>
  bool whiten_disturbance(Columns& columns) noexcept {
    factor_.compute(P_.block(disturbance(), disturbance(), dof_, dof_));
    if (factor_.info() != Eigen::Success) return false;
    factor_.matrixL().solveInPlace(columns);
    return true;
  }

 private:
  /// arm_: (u, v) after the step from (u, v) before; by_force_: from a constant force.
  bool transition(double h, const Model& model) noexcept {
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

  int dof_;
  Matrix P_;
  Eigen::LLT<Square> factor_;
  Square step_, force_force_;
  Block<2, 6> u_, v_, u2_, v2_, k1u_, k1v_, k2v_, rate_;
  Block<4, 4> arm_, own_;
  Block<4, 2> by_force_, crossed_;
  Block<2, 11> force_, gain_;
  Block<4, 11> moved_;
  Vector white_;
};

}  // namespace softarm
