// Random arms and states for tests.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <random>

#include "softarm/model/arm.hpp"

namespace softarm::testing_support {

struct State {
  Eigen::VectorXd u, v, a;
};

class RandomArm {
 public:
  explicit RandomArm(unsigned seed) : engine_(seed) {}

  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine_);
  }
  Eigen::VectorXd vector(int size, double bound) {
    Eigen::VectorXd result(size);
    for (int i = 0; i < size; ++i) result(i) = uniform(-bound, bound);
    return result;
  }
  /// Unequal segments, any base pose and gravity.
  ArmParameters arm(int segments, MassModel mass, double ratio = 3.0) {
    ArmParameters result;
    const auto spread = [&] { return std::pow(ratio, uniform(-0.5, 0.5)); };
    for (int i = 0; i < segments; ++i) {
      result.segments.push_back({.length_m = 0.1 * spread(),
                                 .mass_kg = 0.2 * spread(),
                                 .stiffness_nm_per_rad = 0.6 * spread(),
                                 .damping_nms_per_rad = 0.03 * spread()});
    }
    result.mass = mass;
    result.base_rotation =
        Eigen::Quaterniond(Eigen::Vector4d(vector(4, 1.0)).normalized()).toRotationMatrix();
    result.base_position_m = vector(3, 0.5);
    result.gravity_mps2 = Eigen::Vector3d(vector(3, 2.0)) - Eigen::Vector3d(0, 0, 9.81);
    return result;
  }
  /// Cross-sections of up to half a segment's length, every third one thin.
  ArmParameters thick(ArmParameters arm) {
    for (SegmentParameters& segment : arm.segments) {
      segment.radius_m = std::max(0.0, uniform(-0.25, 0.5)) * segment.length_m;
    }
    return arm;
  }
  /// theta up to `theta` a segment, any phi.
  Eigen::VectorXd bending(int segments, double theta) {
    Eigen::VectorXd u(2 * segments);
    for (int i = 0; i < segments; ++i) {
      const double t = uniform(0.0, theta), phi = uniform(-4.0, 4.0);
      u.segment<2>(2 * i) << t * std::cos(phi), t * std::sin(phi);
    }
    return u;
  }
  State state(int segments, double theta, double speed = 2.0) {
    return {bending(segments, theta), vector(2 * segments, speed), vector(2 * segments, 5.0)};
  }

 private:
  std::mt19937 engine_;
};

}  // namespace softarm::testing_support
