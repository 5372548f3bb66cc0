// What an integrator needs to know of an arm: its equation of motion as a residual, whatever the
// arm is made of.
#pragma once

#include <Eigen/Core>

namespace softarm {

/// r(t, x, x', x'') = B(x) x'' + h(t, x, x') = 0 with B symmetric and positive definite. Implicit
/// methods solve the residual, never with B^-1: with point masses cond(B) grows by orders of
/// magnitude a segment.
class SecondOrderSystem {
 public:
  using Vector = Eigen::Ref<Eigen::VectorXd>;
  using ConstVector = const Eigen::Ref<const Eigen::VectorXd>&;
  using Matrix = Eigen::Ref<Eigen::MatrixXd>;

  /// Powers of the equation of motion, W.
  struct Powers {
    double supplied_w = 0.0;    ///< by actuation and external forces
    double dissipated_w = 0.0;  ///< by damping, >= 0
  };

  virtual ~SecondOrderSystem() = default;

  virtual int size() const = 0;
  /// The change of coordinate i (and, a second, of its rate) that matters as much as one radian:
  /// what the absolute tolerances are multiplied by.
  virtual double unit(Eigen::Index i) const {
    (void)i;
    return 1.0;
  }

  /// out = r(t, x, v, a).
  virtual void residual(double t_s, ConstVector x, ConstVector v, ConstVector a, Vector out) = 0;

  /// The a for which r(t, x, v, a) = 0; false where B is not positive definite in double precision.
  virtual bool acceleration(double t_s, ConstVector x, ConstVector v, Vector a) = 0;

  /// Partial derivatives of r by a, v and x. They only steer Newton's iteration: an error slows it,
  /// no more.
  virtual void linearize(double t_s, ConstVector x, ConstVector v, ConstVector a, Matrix by_a,
                         Matrix by_v, Matrix by_x) = 0;

  virtual Powers powers(double t_s, ConstVector x, ConstVector v) = 0;
};

}  // namespace softarm
