#include "softarm/model/polar.hpp"

#include <cmath>

namespace softarm {

Eigen::Matrix2d polar_jacobian(const Eigen::Vector2d& q_rad) noexcept {
  const double c = std::cos(q_rad.x()), s = std::sin(q_rad.x()), theta = q_rad.y();
  Eigen::Matrix2d P;
  P << -theta * s, c, theta * c, s;
  return P;
}

Eigen::Matrix2d polar_jacobian_rate(const Eigen::Vector2d& q_rad,
                                    const Eigen::Vector2d& velocity_radps) noexcept {
  const double c = std::cos(q_rad.x()), s = std::sin(q_rad.x()), theta = q_rad.y();
  const double phi_rate = velocity_radps.x(), theta_rate = velocity_radps.y();
  Eigen::Matrix2d rate;
  rate << -theta_rate * s - theta * phi_rate * c, -phi_rate * s,
      theta_rate * c - theta * phi_rate * s, phi_rate * c;
  return rate;
}

void polar_to_u(ConstVectorRef q, VectorRef u) noexcept {
  for (Eigen::Index i = 0; i < q.size(); i += 2) {
    u.segment<2>(i) = q(i + 1) * Eigen::Vector2d(std::cos(q(i)), std::sin(q(i)));
  }
}

void polar_velocity_to_u(ConstVectorRef q, ConstVectorRef velocity, VectorRef u_velocity) noexcept {
  for (Eigen::Index i = 0; i < q.size(); i += 2) {
    const Eigen::Vector2d v = velocity.segment<2>(i);
    u_velocity.segment<2>(i) = polar_jacobian(q.segment<2>(i)) * v;
  }
}

void polar_acceleration_to_u(ConstVectorRef q, ConstVectorRef velocity, ConstVectorRef acceleration,
                             VectorRef u_acceleration) noexcept {
  for (Eigen::Index i = 0; i < q.size(); i += 2) {
    const Eigen::Vector2d a = acceleration.segment<2>(i), v = velocity.segment<2>(i);
    u_acceleration.segment<2>(i) =
        polar_jacobian(q.segment<2>(i)) * a + polar_jacobian_rate(q.segment<2>(i), v) * v;
  }
}

void u_to_polar(ConstVectorRef u, VectorRef q) noexcept {
  for (Eigen::Index i = 0; i < u.size(); i += 2) {
    const double x = u(i), y = u(i + 1);
    const double theta = std::hypot(x, y);
    q(i) = theta == 0.0 ? 0.0 : std::atan2(y, x);
    q(i + 1) = theta;
  }
}

void u_velocity_to_polar(ConstVectorRef q, ConstVectorRef u_velocity, VectorRef velocity) noexcept {
  for (Eigen::Index i = 0; i < q.size(); i += 2) {
    const double c = std::cos(q(i)), s = std::sin(q(i));
    const double x = u_velocity(i), y = u_velocity(i + 1);
    velocity(i) = (c * y - s * x) / q(i + 1);
    velocity(i + 1) = c * x + s * y;
  }
}

void u_acceleration_to_polar(ConstVectorRef q, ConstVectorRef velocity,
                             ConstVectorRef u_acceleration, VectorRef acceleration) noexcept {
  for (Eigen::Index i = 0; i < q.size(); i += 2) {
    const double c = std::cos(q(i)), s = std::sin(q(i)), theta = q(i + 1);
    const double x = u_acceleration(i), y = u_acceleration(i + 1);
    const double phi_rate = velocity(i), theta_rate = velocity(i + 1);
    acceleration(i) = ((c * y - s * x) - 2.0 * theta_rate * phi_rate) / theta;
    acceleration(i + 1) = (c * x + s * y) + theta * phi_rate * phi_rate;
  }
}

void force_to_polar(ConstVectorRef q, ConstVectorRef force_u, VectorRef force_q) noexcept {
  for (Eigen::Index i = 0; i < q.size(); i += 2) {
    const double c = std::cos(q(i)), s = std::sin(q(i));
    const double x = force_u(i), y = force_u(i + 1);
    force_q(i) = q(i + 1) * (c * y - s * x);
    force_q(i + 1) = c * x + s * y;
  }
}

void jacobian_to_polar(ConstVectorRef q, Eigen::Ref<Eigen::MatrixXd> jacobian) noexcept {
  for (Eigen::Index i = 0; i < q.size(); i += 2) {
    const Eigen::Matrix2d P = polar_jacobian(q.segment<2>(i));
    for (Eigen::Index row = 0; row < jacobian.rows(); ++row) {
      const Eigen::RowVector2d old = jacobian.block<1, 2>(row, i);
      jacobian.block<1, 2>(row, i) = old * P;
    }
  }
}

void jacobian_rate_to_polar(ConstVectorRef q, ConstVectorRef velocity,
                            const Eigen::Ref<const Eigen::MatrixXd>& jacobian_u,
                            Eigen::Ref<Eigen::MatrixXd> jacobian_rate) noexcept {
  for (Eigen::Index i = 0; i < q.size(); i += 2) {
    const Eigen::Matrix2d P = polar_jacobian(q.segment<2>(i));
    const Eigen::Matrix2d rate = polar_jacobian_rate(q.segment<2>(i), velocity.segment<2>(i));
    for (Eigen::Index row = 0; row < jacobian_rate.rows(); ++row) {
      const Eigen::RowVector2d old = jacobian_rate.block<1, 2>(row, i);
      const Eigen::RowVector2d J = jacobian_u.block<1, 2>(row, i);
      jacobian_rate.block<1, 2>(row, i) = old * P + J * rate;
    }
  }
}

void dynamics_to_polar(ConstVectorRef q, ConstVectorRef velocity, Eigen::Ref<Eigen::MatrixXd> B,
                       Eigen::Ref<Eigen::MatrixXd> C, VectorRef G) noexcept {
  for (Eigen::Index j = 0; j < q.size(); j += 2) {
    const Eigen::Matrix2d P = polar_jacobian(q.segment<2>(j));
    const Eigen::Matrix2d rate = polar_jacobian_rate(q.segment<2>(j), velocity.segment<2>(j));
    for (Eigen::Index i = 0; i < q.size(); i += 2) {
      const double c = std::cos(q(i)), s = std::sin(q(i)), theta = q(i + 1);
      const Eigen::Matrix2d b = B.block<2, 2>(i, j);
      const Eigen::Matrix2d b_columns = b * P;
      const Eigen::Matrix2d c_columns = b * rate + C.block<2, 2>(i, j) * P;
      // P' from the left, theta taken out so that phi rows keep their relative accuracy.
      B.block<1, 2>(i, j) = theta * (c * b_columns.row(1) - s * b_columns.row(0));
      B.block<1, 2>(i + 1, j) = c * b_columns.row(0) + s * b_columns.row(1);
      C.block<1, 2>(i, j) = theta * (c * c_columns.row(1) - s * c_columns.row(0));
      C.block<1, 2>(i + 1, j) = c * c_columns.row(0) + s * c_columns.row(1);
    }
  }
  force_to_polar(q, G, G);
}

Eigen::Matrix2d polar_actuation_matrix(ActuationModel model,
                                       const Eigen::Vector2d& q_rad) noexcept {
  const double c = std::cos(q_rad.x()), s = std::sin(q_rad.x());
  const double r = model == ActuationModel::couple ? std::sin(q_rad.y()) : q_rad.y();
  Eigen::Matrix2d A;
  A << -r * c, -r * s, -s, c;
  return A;
}

}  // namespace softarm
