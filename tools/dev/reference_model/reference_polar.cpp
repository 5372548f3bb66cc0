#include <cmath>

#include "dev/reference_model/reference_model.hpp"

namespace softarm::reference {

Vector polar_to_u(const Vector& q) {
  Vector u(q.size());
  for (Eigen::Index i = 0; i < q.size(); i += 2) {
    u(i) = q(i + 1) * std::cos(q(i));
    u(i + 1) = q(i + 1) * std::sin(q(i));
  }
  return u;
}

Vector polar_velocity_to_u(const Vector& q, const Vector& velocity) {
  Vector v(q.size());
  for (Eigen::Index i = 0; i < q.size(); i += 2) {
    const Real c = std::cos(q(i)), s = std::sin(q(i)), turn = q(i + 1) * velocity(i);
    v(i) = velocity(i + 1) * c - turn * s;
    v(i + 1) = velocity(i + 1) * s + turn * c;
  }
  return v;
}

Dynamics to_polar(const Dynamics& terms, const Vector& q, const Vector& velocity) {
  Matrix P = Matrix::Zero(q.size(), q.size()), rate = P;
  Dynamics out = terms;
  for (Eigen::Index i = 0; i < q.size(); i += 2) {
    const Real c = std::cos(q(i)), s = std::sin(q(i)), theta = q(i + 1);
    const Real phi_rate = velocity(i), theta_rate = velocity(i + 1);
    P.block<2, 2>(i, i) << -theta * s, c, theta * c, s;
    rate.block<2, 2>(i, i) << -theta_rate * s - theta * phi_rate * c, -phi_rate * s,
        theta_rate * c - theta * phi_rate * s, phi_rate * c;
  }
  out.B = P.transpose() * terms.B * P;
  out.C = P.transpose() * (terms.B * rate + terms.C * P);
  out.G = P.transpose() * terms.G;
  out.s = P.cwiseAbs().transpose() * terms.s;
  out.r = rate.cwiseAbs().transpose() * terms.s + P.cwiseAbs().transpose() * terms.r;
  return out;
}

}  // namespace softarm::reference
