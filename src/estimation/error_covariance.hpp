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
  bool propagate(double step_s, const Model& model) noexcept;

  /// A measurement of u with covariance R: `innovation` is measured minus predicted. `hold`: the
  /// parameters, though uncertain, are not corrected (Schmidt's filter).
  /// @param correction what to add to the mean, in the order of the errors
  /// @param nis the innovation's square in units of its covariance; 2g on the average
  /// @return false, with nothing changed, where the covariance cannot be factored
  bool measure(const Vector& innovation, const Square& R, bool hold, Correction& correction,
               double& nis) noexcept;

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
  bool transition(double h, const Model& model) noexcept;

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

// A filter a segment, and ModelObserver::kJointSegments jointly.
extern template class ErrorCovariance<1>;
extern template class ErrorCovariance<6>;

}  // namespace softarm
