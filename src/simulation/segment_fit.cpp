#include <cmath>

#include "softarm/simulation/plant_system.hpp"

namespace softarm {

void fit_segment(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& chord,
                 const Eigen::Vector3d& velocity_radps, Eigen::Vector2d& u, Eigen::Vector2d& rate) {
  const Eigen::Quaterniond q(rotation);
  // q' = 1/2 omega q for omega in the frame of the start.
  const double scalar_rate = -0.5 * velocity_radps.dot(q.vec());
  const Eigen::Vector3d vector_rate =
      0.5 * (q.w() * velocity_radps + velocity_radps.cross(q.vec()));
  Eigen::Vector3d m(q.y(), -q.x(), q.w());
  Eigen::Vector3d m_rate(vector_rate.y(), -vector_rate.x(), scalar_rate);
  if (m.dot(chord) < 0.0) {
    m = -m;
    m_rate = -m_rate;
  }
  constexpr double kStraight = 1e-150;  // its square is still a number
  const double sine = m.head<2>().norm();
  if (sine < kStraight) {
    u = 2.0 / m.z() * m.head<2>();
    rate = 2.0 / m.z() * m_rate.head<2>();
    return;
  }
  const Eigen::Vector2d direction = m.head<2>() / sine;
  const double theta = 2.0 * std::atan2(sine, m.z());
  const double along = direction.dot(m_rate.head<2>());
  const double theta_rate = 2.0 * (along * m.z() - sine * m_rate.z()) / m.squaredNorm();
  u = theta * direction;
  rate = theta_rate * direction + theta / sine * (m_rate.head<2>() - along * direction);
}

}  // namespace softarm
