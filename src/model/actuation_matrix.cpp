#include "softarm/model/actuation_matrix.hpp"

#include <cmath>

#include "model/entire_series.hpp"

namespace softarm {

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
  const double c1 = entire<8>(u_rad.squaredNorm())[1];  // det A without a subtraction of products
  const double determinant =
      std::abs(c1) < min_determinant ? std::copysign(min_determinant, c1) : c1;
  return Eigen::Vector2d(A(1, 1) * force_nm.x() - A(0, 1) * force_nm.y(),
                         A(0, 0) * force_nm.y() - A(1, 0) * force_nm.x()) /
         determinant;
}

void apply_actuation(const ArmParameters& arm, ConstVectorRef u, ConstVectorRef tau_actuation_nm,
                     VectorRef out) noexcept {
  for (int i = 0; i < arm.size(); ++i) {
    out.segment<2>(2 * i) =
        actuation_matrix(arm.actuation, u.segment<2>(2 * i)) * tau_actuation_nm.segment<2>(2 * i);
  }
}

void solve_actuation(const ArmParameters& arm, ConstVectorRef u, ConstVectorRef force_nm,
                     VectorRef tau_actuation_nm, double min_determinant) noexcept {
  for (int i = 0; i < arm.size(); ++i) {
    const Eigen::Vector2d force = force_nm.segment<2>(2 * i);
    tau_actuation_nm.segment<2>(2 * i) =
        solve_actuation(arm.actuation, u.segment<2>(2 * i), force, min_determinant);
  }
}

}  // namespace softarm
