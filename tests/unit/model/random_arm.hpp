// Random arms and states for tests.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>

#include "softarm/model/arm.hpp"

namespace softarm::testing_support {

struct State {
  Eigen::VectorXd u, v, a;
};

/// What every law holds for.
struct ArmKind {
  MassModel mass = MassModel::point;
  bool extensible = false;
};
inline constexpr std::array<ArmKind, 4> kArmKinds = {{{MassModel::point},
                                                      {MassModel::distributed},
                                                      {MassModel::point, true},
                                                      {MassModel::distributed, true}}};
inline std::string name(const ArmKind& kind) {
  return std::string(kind.extensible ? "extensible_" : "") +
         (kind.mass == MassModel::point ? "point" : "distributed");
}

/// The largest sqrt(B_jj) among the coordinates of the same unit as i, for every i.
inline Eigen::VectorXd sizes_by_unit(const ArmParameters& arm, const Eigen::MatrixXd& B) {
  const int width = arm.segment_dof();
  Eigen::VectorXd result = Eigen::VectorXd::Zero(B.rows());
  for (Eigen::Index i = 0; i < B.rows(); ++i) {
    for (Eigen::Index j = 0; j < B.rows(); ++j) {
      if ((i % width == 2) == (j % width == 2)) result(i) = std::max(result(i), std::sqrt(B(j, j)));
    }
  }
  return result;
}

/// Largest |u'| and |e'| / l of the arm.
template <class Vector>
double largest_rate(const ArmParameters& arm, const Vector& u, const Vector& velocity) {
  double result = 0.0;
  for (int i = 0; i < arm.dof(); ++i) {
    const double length =
        i % arm.segment_dof() == 2
            ? double(arm.segments[static_cast<std::size_t>(i / 3)].length_m + u(i))
            : 1.0;
    result = std::max(result, double(std::abs(velocity(i))) / length);
  }
  return result;
}

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
  ArmParameters arm(int segments, const ArmKind& kind, double ratio = 3.0) {
    ArmParameters result = arm(segments, kind.mass, ratio);
    result.extensible = kind.extensible;
    for (SegmentParameters& segment : result.segments) {
      // A solid rod of a tenth of the length: k_a / k = 4 / r^2.
      const double per_area = 400.0 / (segment.length_m * segment.length_m);
      segment.axial_stiffness_n_per_m = per_area * segment.stiffness_nm_per_rad;
      segment.axial_damping_ns_per_m = per_area * segment.damping_nms_per_rad;
    }
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
  /// The same with elongations of -0.3 to 0.5 of the length where the arm is extensible, strain
  /// rates as large as the bending's rates.
  State state(const ArmParameters& arm, double theta, double speed = 2.0) {
    State s = state(arm.size(), theta, speed);
    if (!arm.extensible) return s;
    State wide{Eigen::VectorXd(arm.dof()), Eigen::VectorXd(arm.dof()), Eigen::VectorXd(arm.dof())};
    for (int i = 0; i < arm.size(); ++i) {
      const double length = arm.segments[static_cast<std::size_t>(i)].length_m;
      wide.u.segment<3>(3 * i) << s.u.segment<2>(2 * i), uniform(-0.3, 0.5) * length;
      wide.v.segment<3>(3 * i) << s.v.segment<2>(2 * i), uniform(-speed, speed) * length;
      wide.a.segment<3>(3 * i) << s.a.segment<2>(2 * i), uniform(-5.0, 5.0) * length;
    }
    return wide;
  }

 private:
  std::mt19937 engine_;
};

}  // namespace softarm::testing_support
