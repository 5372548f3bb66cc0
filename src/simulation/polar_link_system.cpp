#include "simulation/polar_link_system.hpp"

#include <Eigen/Cholesky>
#include <cmath>

namespace softarm {
namespace {

/// P: columns d(a, b) / d phi and d(a, b) / d theta.
Eigen::Matrix2d chart(double phi, double theta) {
  Eigen::Matrix2d p;
  p << -theta * std::cos(phi), -std::sin(phi), -theta * std::sin(phi), std::cos(phi);
  return p;
}

}  // namespace

PolarLinkSystem::PolarLinkSystem(const PlantSettings& settings) : LinkSystem(settings) {
  rotor_.setZero(links());
  for (Eigen::Index j = 0; j < links(); ++j) {
    rotor_[j] = kRotor * turning_inertia_kgm2(static_cast<std::size_t>(j));
  }
  for (Eigen::VectorXd* vector :
       {&crossed_, &crossed_rate_, &crossed_acceleration_, &shifted_, &above_, &below_}) {
    vector->setZero(size());
  }
  inertia_.setZero(size(), size());
  unused_.setZero(size(), size());
}

Eigen::VectorXd PolarLinkSystem::angles(ConstVector q) const {
  Eigen::VectorXd x(q.size());
  for (Eigen::Index k = 0; k < q.size(); k += 2) {
    x[k] = -q[k + 1] * std::sin(q[k]);
    x[k + 1] = q[k + 1] * std::cos(q[k]);
  }
  return x;
}

Eigen::VectorXd PolarLinkSystem::angle_rates(ConstVector q, ConstVector v) const {
  Eigen::VectorXd rate(q.size());
  for (Eigen::Index k = 0; k < q.size(); k += 2) {
    rate.segment<2>(k) = chart(q[k], q[k + 1]) * v.segment<2>(k);
  }
  return rate;
}

void PolarLinkSystem::residual(double t_s, ConstVector q, ConstVector v, ConstVector a,
                               Vector out) {
  for (Eigen::Index k = 0; k < size(); k += 2) {
    const double sine = std::sin(q[k]), cosine = std::cos(q[k]);
    const double theta = q[k + 1], phi_rate = v[k], theta_rate = v[k + 1];
    const Eigen::Matrix2d p = chart(q[k], theta);
    const Eigen::Vector2d curved(
        theta * phi_rate * phi_rate * sine - 2.0 * theta_rate * phi_rate * cosine,
        -theta * phi_rate * phi_rate * cosine - 2.0 * theta_rate * phi_rate * sine);  // P' v
    crossed_.segment<2>(k) = Eigen::Vector2d(-theta * sine, theta * cosine);
    crossed_rate_.segment<2>(k) = p * v.segment<2>(k);
    crossed_acceleration_.segment<2>(k) = p * a.segment<2>(k) + curved;
  }
  LinkSystem::residual(t_s, crossed_, crossed_rate_, crossed_acceleration_, out);
  for (Eigen::Index k = 0; k < size(); k += 2) {
    const Eigen::Vector2d force = out.segment<2>(k);
    out.segment<2>(k) = chart(q[k], q[k + 1]).transpose() * force;
    out[k] += rotor_[k / 2] * a[k];
  }
}

bool PolarLinkSystem::acceleration(double t_s, ConstVector q, ConstVector v, Vector a) {
  shifted_.setZero();
  residual(t_s, q, v, shifted_, above_);
  linearize(t_s, q, v, shifted_, inertia_, unused_, unused_);
  const Eigen::LDLT<Eigen::MatrixXd> factors(inertia_);
  if (factors.info() != Eigen::Success || !factors.isPositive()) {
    return false;
  }
  residual(t_s, q, v, Eigen::VectorXd::Zero(size()), above_);
  a = -factors.solve(above_);
  return a.allFinite();
}

void PolarLinkSystem::linearize(double t_s, ConstVector q, ConstVector v, ConstVector a,
                                Matrix by_a, Matrix by_v, Matrix by_q) {
  // Each column by differences: r is linear in a, and smooth in the others.
  constexpr double kStep = 1e-5;
  const auto differences = [&](Eigen::VectorXd base, double step, const auto& evaluate,
                               Matrix out) {
    for (Eigen::Index j = 0; j < size(); ++j) {
      const double kept = base[j];
      base[j] = kept + step;
      evaluate(base, above_);
      base[j] = kept - step;
      evaluate(base, below_);
      base[j] = kept;
      out.col(j) = (above_ - below_) / (2.0 * step);
    }
  };
  differences(
      v, kStep, [&](const auto& at, auto& r) { residual(t_s, q, at, a, r); }, by_v);
  differences(
      q, kStep, [&](const auto& at, auto& r) { residual(t_s, at, v, a, r); }, by_q);
  LinkSystem::linearize(t_s, angles(q), angle_rates(q, v), a, by_a, unused_, unused_);
  for (Eigen::Index k = 0; k < size(); k += 2) {
    const Eigen::Matrix2d p = chart(q[k], q[k + 1]);
    by_a.middleCols<2>(k) = (by_a.middleCols<2>(k) * p).eval();
    by_a.middleRows<2>(k) = (p.transpose() * by_a.middleRows<2>(k)).eval();
  }
  for (Eigen::Index k = 0; k < size(); k += 2) by_a(k, k) += rotor_[k / 2];
}

SecondOrderSystem::Powers PolarLinkSystem::powers(double t_s, ConstVector q, ConstVector v) {
  return LinkSystem::powers(t_s, angles(q), angle_rates(q, v));
}

double PolarLinkSystem::kinetic_energy_j(ConstVector q, ConstVector v) {
  double energy = LinkSystem::kinetic_energy_j(angles(q), angle_rates(q, v));
  for (Eigen::Index j = 0; j < links(); ++j) energy += 0.5 * rotor_[j] * v[2 * j] * v[2 * j];
  return energy;
}

double PolarLinkSystem::potential_energy_j(ConstVector q) {
  return LinkSystem::potential_energy_j(angles(q));
}

void PolarLinkSystem::spread(ConstVector u, Vector q) const {
  LinkSystem::spread(u, q);
  for (Eigen::Index k = 0; k < size(); k += 2) {
    const double a = q[k], b = q[k + 1];
    q[k] = a == 0.0 && b == 0.0 ? 0.0 : std::atan2(-a, b);
    q[k + 1] = std::hypot(a, b);
  }
}

void PolarLinkSystem::spread_rate(ConstVector u, ConstVector rate, Vector v) const {
  Eigen::VectorXd q(size());
  spread(u, q);
  LinkSystem::spread(rate, v);
  for (Eigen::Index k = 0; k < size(); k += 2) {
    const double phi = q[k], theta = q[k + 1], a = v[k], b = v[k + 1];
    // Where it is straight a rate across phi has no q'; the part along phi is kept.
    v[k] = theta > 0.0 ? -(a * std::cos(phi) + b * std::sin(phi)) / theta : 0.0;
    v[k + 1] = b * std::cos(phi) - a * std::sin(phi);
  }
}

void PolarLinkSystem::segment_ends(ConstVector q, std::span<Eigen::Isometry3d> ends) const {
  LinkSystem::segment_ends(angles(q), ends);
}

void PolarLinkSystem::curvature(ConstVector q, ConstVector v, Vector u, Vector rate) const {
  LinkSystem::curvature(angles(q), angle_rates(q, v), u, rate);
}

}  // namespace softarm
