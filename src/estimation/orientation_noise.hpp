// What the noise of the bodies' orientations does to u as the orientation method measures it.
#pragma once

#include <Eigen/Core>

namespace softarm {

/// d u / d e of one segment, 2 x 3, where the measured relative rotation is exp(-e_upper) R
/// exp(e_lower): du = lower e_lower - upper e_upper, rotation vectors e in S_{i-1} and S_i. Smooth
/// at theta = 0; bounded near theta = 2 pi, where the measurement itself means nothing.
struct BodyNoiseJacobians {
  Eigen::Matrix<double, 2, 3> upper, lower;
};
BodyNoiseJacobians body_noise_jacobians(const Eigen::Vector2d& u_rad) noexcept;

}  // namespace softarm
