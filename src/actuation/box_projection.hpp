// The point of a box nearest to another, on the flat W p = t of one to three equations.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace softarm {

/// Sine of the angle below which two columns, or a column and a facet, count as parallel.
inline constexpr double kParallel = 1e-12;

/// Solves min 1/2 |p - b|^2 subject to W p = t, lo <= p <= hi, for at most Capacity unknowns, by
/// the dual active-set method (Goldfarb and Idnani, Math. Programming 27, 1983) written for this
/// problem.
///
/// Kept throughout: W p = t and non-negative multipliers of the fixed unknowns. The free
/// unknowns are p_j = b_j + w_j' lambda and may violate their bounds; the most violated one, k, is
/// driven to its bound by raising its multiplier, while a fixed unknown whose multiplier falls to
/// zero on the way is set free. The free columns keep full rank: k is fixed only if the others span
/// without it.
///
/// It ends: every bound that is reached raises the (strictly concave) dual objective by at least
/// half of the violation times the step, so the set of fixed unknowns at such a moment never comes
/// back; there are at most 3^m of them, and at most m releases between two. In practice 2 m steps
/// are plenty; kMaxSteps guards against round-off.
template <int Dimension, int Capacity>
class BoxProjection {
 public:
  using Column = std::array<double, Dimension>;
  using Unknowns = std::array<double, Capacity>;
  static constexpr int kMaxSteps = 32 * Capacity;

  BoxProjection(int size, const Column* columns, double lo, double hi, double bias) noexcept
      : size_(size), columns_(columns), lo_(lo), hi_(hi), bias_(bias) {}

  /// False if round-off hides the solution (t at the very edge of what the box reaches, columns
  /// parallel to 1e-5); p is then unspecified.
  bool solve(const Column& target, Unknowns& p) noexcept {
    const double tolerance = 1e-13 * std::max({1.0, std::abs(lo_), std::abs(hi_)});
    for (steps_ = 0; steps_ < kMaxSteps;) {
      if (!solve_free(target)) return false;
      const int k = most_violated(tolerance);
      if (k < 0) return finish(target, p);
      if (!fix(k)) return false;
    }
    return false;
  }

  int steps() const noexcept { return steps_; }

 private:
  static double dot(const Column& a, const Column& b) noexcept {
    double sum = a[0] * b[0];
    for (int i = 1; i < Dimension; ++i) sum += a[i] * b[i];
    return sum;
  }

  double bound(int j) const noexcept { return side_[j] > 0 ? hi_ : lo_; }
  double unbounded(int j) const noexcept { return bias_ + dot(columns_[j], lambda_); }

  /// x = (sum over free columns w w')^-1 y; false if they do not span.
  bool solve_gram(const Column& y, Column& x) const noexcept {
    if constexpr (Dimension == 3) {
      Eigen::Matrix3d gram = Eigen::Matrix3d::Zero();
      for (int j = 0; j < size_; ++j) {
        if (side_[j] != 0) continue;
        const Eigen::Map<const Eigen::Vector3d> w(columns_[j].data());
        gram += w * w.transpose();
      }
      Eigen::Matrix3d adjugate;  // of a symmetric matrix
      for (int i = 0; i < 3; ++i)
        adjugate.col(i) = gram.col((i + 1) % 3).cross(gram.col((i + 2) % 3));
      const double determinant = gram.col(0).dot(adjugate.col(0));
      Eigen::Map<Eigen::Vector3d>(x.data()) =
          adjugate * Eigen::Map<const Eigen::Vector3d>(y.data()) / determinant;
      return determinant > 1e-15 * gram(0, 0) * gram(1, 1) * gram(2, 2);
    } else {
      return solve_small_gram(y, x);
    }
  }
  bool solve_small_gram(const Column& y, Column& x) const noexcept {
    double a = 0.0;
    [[maybe_unused]] double b = 0.0, c = 0.0;
    for (int j = 0; j < size_; ++j) {
      if (side_[j] != 0) continue;
      const Column& w = columns_[j];
      a += w[0] * w[0];
      if constexpr (Dimension == 2) {
        b += w[0] * w[1];
        c += w[1] * w[1];
      }
    }
    if constexpr (Dimension == 1) {
      x[0] = y[0] / a;
      return a > 0.0;
    } else {
      const double determinant = a * c - b * b;
      x[0] = (c * y[0] - b * y[1]) / determinant;
      x[1] = (a * y[1] - b * y[0]) / determinant;
      return determinant > 1e-15 * a * c;
    }
  }

  /// lambda for the present set of free unknowns.
  bool solve_free(const Column& target) noexcept {
    Column rest = target;
    for (int j = 0; j < size_; ++j) {
      const double p = side_[j] == 0 ? bias_ : bound(j);
      for (int i = 0; i < Dimension; ++i) rest[i] -= columns_[j][i] * p;
    }
    return solve_gram(rest, lambda_);
  }

  int most_violated(double tolerance) const noexcept {
    int worst = -1;
    double largest = tolerance;
    for (int j = 0; j < size_; ++j) {
      if (side_[j] != 0) continue;
      const double p = unbounded(j);
      const double violation = std::max(p - hi_, lo_ - p);
      if (violation > largest) {
        largest = violation;
        worst = j;
      }
    }
    return worst;
  }

  /// Raises the multiplier of unknown k's bound until k is on it; frees others on the way.
  bool fix(int k) noexcept {
    constexpr double kInfinite = std::numeric_limits<double>::infinity();
    const int side = unbounded(k) > hi_ ? 1 : -1;
    const double limit = side > 0 ? hi_ : lo_;
    double multiplier = 0.0;
    while (steps_++ < kMaxSteps) {
      Column direction{};
      if (!solve_gram(columns_[k], direction)) return false;
      // How fast k nears its bound: 1 - w_k' (W_F W_F')^-1 w_k, which is 0 where the others do not
      // span without k.
      const double rate = 1.0 - dot(columns_[k], direction);
      for (double& d : direction) d *= side;
      const double violation = side * (unbounded(k) - limit) - multiplier;
      double step = rate > 1e-10 ? std::max(violation, 0.0) / rate : kInfinite;
      int released = -1;
      for (int j = 0; j < size_; ++j) {
        if (side_[j] == 0) continue;
        const double slope = side_[j] * dot(columns_[j], direction);
        if (slope >= 0.0) continue;
        const double until = std::max(side_[j] * (unbounded(j) - bound(j)), 0.0) / -slope;
        if (until < step) {
          step = until;
          released = j;
        }
      }
      if (!(step < kInfinite)) return false;
      for (int i = 0; i < Dimension; ++i) lambda_[i] += step * direction[i];
      multiplier += step;
      if (released < 0) {
        side_[k] = side;
        return true;
      }
      side_[released] = 0;
    }
    return false;
  }

  /// One step of iterative refinement, then p.
  bool finish(const Column& target, Unknowns& p) noexcept {
    Column residual = target, correction{};
    for (int j = 0; j < size_; ++j) {
      const double value = side_[j] == 0 ? unbounded(j) : bound(j);
      for (int i = 0; i < Dimension; ++i) residual[i] -= columns_[j][i] * value;
    }
    if (!solve_gram(residual, correction)) return false;
    for (int i = 0; i < Dimension; ++i) lambda_[i] += correction[i];
    for (int j = 0; j < size_; ++j) {
      p[j] = side_[j] == 0 ? std::clamp(unbounded(j), lo_, hi_) : bound(j);
    }
    return true;
  }

  int size_;
  const Column* columns_;
  double lo_, hi_, bias_;
  Column lambda_{};
  std::array<int, Capacity> side_{};  ///< 0 free, +1 fixed at hi, -1 fixed at lo
  int steps_ = 0;
};

}  // namespace softarm
