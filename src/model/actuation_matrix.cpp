#include "softarm/model/actuation_matrix.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "model/entire_series.hpp"

namespace softarm {
namespace {

/// sin theta / theta with relative accuracy also where it vanishes: theta = |u| carries its
/// rounding error along, which near pi would otherwise decide the quotient.
double accurate_sinc(double x, double y) noexcept {
  const double xx = x * x, yy = y * y;
  const double s = xx + yy;
  if (s < 1.0) return entire<8>(s)[1];
  const double larger = std::max(xx, yy), smaller = std::min(xx, yy);
  const double lost = std::fma(x, x, -xx) + std::fma(y, y, -yy) + (smaller - (s - larger));
  const double theta = std::sqrt(s);
  const double correction = (lost - std::fma(theta, theta, -s)) / (2.0 * theta);
  return (std::sin(theta) + std::cos(theta) * correction) / theta;
}

/// The axial force on e is N itself; a `couple` has none.
double axial_force(ActuationModel model, double force_n) noexcept {
  return model == ActuationModel::chamber ? force_n : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

Eigen::Matrix2d actuation_matrix(ActuationModel model, const Eigen::Vector2d& u_rad) noexcept {
  Eigen::Matrix2d A;
  if (model == ActuationModel::chamber) {
    A << 0.0, 1.0, -1.0, 0.0;
    return A;
  }
  const double x = u_rad.x(), y = u_rad.y();
  const auto c = entire<8>(x * x + y * y);
  A << -c[3] * x * y, c[1] + c[3] * x * x, -(c[1] + c[3] * y * y), c[3] * x * y;
  return A;
}

Eigen::Vector2d solve_actuation(ActuationModel model, const Eigen::Vector2d& u_rad,
                                const Eigen::Vector2d& force_nm, double min_determinant) noexcept {
  if (model == ActuationModel::chamber) return {-force_nm.y(), force_nm.x()};
  const Eigen::Matrix2d A = actuation_matrix(model, u_rad);
  const double c1 = accurate_sinc(u_rad.x(), u_rad.y());  // det A
  const double determinant =
      std::abs(c1) < min_determinant ? std::copysign(min_determinant, c1) : c1;
  return Eigen::Vector2d(A(1, 1) * force_nm.x() - A(0, 1) * force_nm.y(),
                         A(0, 0) * force_nm.y() - A(1, 0) * force_nm.x()) /
         determinant;
}

void apply_actuation(const ArmParameters& arm, ConstVectorRef u, ConstVectorRef tau_actuation_nm,
                     VectorRef out) noexcept {
  const int width = arm.segment_dof();
  for (int i = 0; i < arm.dof(); i += width) {
    out.segment<2>(i) =
        actuation_matrix(arm.actuation, u.segment<2>(i)) * tau_actuation_nm.segment<2>(i);
    if (arm.extensible) out(i + 2) = axial_force(arm.actuation, tau_actuation_nm(i + 2));
  }
}

void solve_actuation(const ArmParameters& arm, ConstVectorRef u, ConstVectorRef force_nm,
                     VectorRef tau_actuation_nm, double min_determinant) noexcept {
  const int width = arm.segment_dof();
  if (arm.actuation == ActuationModel::chamber) {  // the same matrix everywhere
    const Eigen::Index size = force_nm.size();
    const double* const force = force_nm.data();
    double* const tau = tau_actuation_nm.data();
    for (Eigen::Index i = 0; i < size; i += width) {
      const double x = force[i], y = force[i + 1];
      tau[i] = -y;
      tau[i + 1] = x;
      if (width == 3) tau[i + 2] = force[i + 2];
    }
    return;
  }
  for (Eigen::Index i = 0; i < force_nm.size(); i += width) {
    const Eigen::Vector2d force = force_nm.segment<2>(i);
    tau_actuation_nm.segment<2>(i) =
        solve_actuation(arm.actuation, u.segment<2>(i), force, min_determinant);
    if (arm.extensible) tau_actuation_nm(i + 2) = std::numeric_limits<double>::quiet_NaN();
  }
}

}  // namespace softarm
