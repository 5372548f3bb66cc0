// Arms, random numbers and a fine integrator for the tests of this module.
#pragma once

#include <Eigen/Core>
#include <random>

#include "softarm/control/curvature_controller.hpp"
#include "softarm/control/reference.hpp"
#include "softarm/model/actuation_matrix.hpp"
#include "softarm/model/arm.hpp"
#include "softarm/model/dynamics.hpp"

namespace softarm::test {

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double uniform(double a, double b) { return std::uniform_real_distribution<>(a, b)(engine_); }
  Eigen::VectorXd vector(int size, double limit) {
    Eigen::VectorXd v(size);
    for (double& x : v) x = uniform(-limit, limit);
    return v;
  }

 private:
  std::mt19937 engine_;
};

/// The paper's arm (section VII) with any number of segments.
inline ArmParameters paper_arm(int n) {
  ArmParameters arm;
  arm.segments.resize(static_cast<std::size_t>(n));
  return arm;
}

inline ArmParameters random_arm(int n, Random& random) {
  ArmParameters arm = paper_arm(n);
  for (SegmentParameters& s : arm.segments) {
    s = {random.uniform(0.08, 0.2), random.uniform(0.1, 0.3), random.uniform(0.3, 1.0),
         random.uniform(0.01, 0.05)};
  }
  return arm;
}

inline ControllerSettings gains(int n, double kp, double kd) {
  ControllerSettings settings;
  settings.kp.assign(static_cast<std::size_t>(2 * n), kp);
  settings.kd.assign(static_cast<std::size_t>(2 * n), kd);
  return settings;
}

inline ReferenceWindow at(const Eigen::VectorXd& u, const Eigen::VectorXd& velocity,
                          const Eigen::VectorXd& acceleration) {
  ReferenceWindow window;
  window.now.u = u;
  window.now.velocity = velocity;
  window.now.acceleration = acceleration;
  return window;
}

/// One step of the classic Runge-Kutta method for y' = f(t, y).
template <class Function>
void runge_kutta(Function&& f, double t, double h, Eigen::VectorXd& y) {
  const Eigen::VectorXd a = f(t, y), b = f(t + 0.5 * h, y + 0.5 * h * a),
                        c = f(t + 0.5 * h, y + 0.5 * h * b), d = f(t + h, y + h * c);
  y += h / 6.0 * (a + 2.0 * b + 2.0 * c + d);
}

inline ReferenceSample sampled(const Reference& reference, double t) {
  ReferenceSample sample;
  reference.sample(t, sample);
  return sample;
}

}  // namespace softarm::test
