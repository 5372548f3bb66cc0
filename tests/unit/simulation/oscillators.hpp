// Oscillators whose motion is known in closed form, and which can break.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <limits>

#include "softarm/simulation/second_order_system.hpp"

namespace softarm {

/// m a + d v + k x = f(t), componentwise.
class Oscillators : public SecondOrderSystem {
 public:
  Oscillators(Eigen::VectorXd m, Eigen::VectorXd d, Eigen::VectorXd k)
      : mass(std::move(m)), damping(std::move(d)), stiffness(std::move(k)), force(mass) {
    force.setZero();
  }
  int size() const override { return static_cast<int>(mass.size()); }
  void residual(double t, ConstVector x, ConstVector v, ConstVector a, Vector out) override {
    out = mass.cwiseProduct(a) + damping.cwiseProduct(v) + stiffness.cwiseProduct(x) - force;
    if (t > broken_from) out.setConstant(std::numeric_limits<double>::quiet_NaN());
    if (failures_left > 0) {
      --failures_left;
      out.setConstant(std::numeric_limits<double>::quiet_NaN());
    }
  }
  bool acceleration(double t, ConstVector x, ConstVector v, Vector out) override {
    out = (force - damping.cwiseProduct(v) - stiffness.cwiseProduct(x)).cwiseQuotient(mass);
    return !(t > broken_from);
  }
  void linearize(double, ConstVector, ConstVector, ConstVector, Matrix by_a, Matrix by_v,
                 Matrix by_x) override {
    by_a = mass.asDiagonal();
    by_v = damping.asDiagonal();
    by_x = stiffness.asDiagonal();
  }
  Powers powers(double, ConstVector, ConstVector v) override {
    return {force.dot(v), v.dot(damping.cwiseProduct(v))};
  }

  Eigen::VectorXd mass, damping, stiffness, force;
  double broken_from = INFINITY;
  int failures_left = 0;
};

inline Eigen::VectorXd vec(std::initializer_list<double> values) {
  Eigen::VectorXd v(static_cast<Eigen::Index>(values.size()));
  std::copy(values.begin(), values.end(), v.data());
  return v;
}

// x of m x'' + d x' + k x = 0 released at rest from x0, under-damped.
inline double released(double m, double d, double k, double x0, double t) {
  const double decay = d / (2.0 * m);
  const double w = std::sqrt(k / m - decay * decay);
  return x0 * std::exp(-decay * t) * (std::cos(w * t) + decay / w * std::sin(w * t));
}

}  // namespace softarm
