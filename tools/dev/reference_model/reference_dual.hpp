// Dual numbers in long double with vectors and rotations of them: a value and its rate in time, for
// the reference model.
#pragma once

#include <array>

#include "dev/reference_model/reference_model.hpp"

namespace softarm::reference {

/// A number and its rate along the velocity.
struct Dual {
  Real v = 0, d = 0;
};
inline Dual operator+(Dual a, Dual b) { return {a.v + b.v, a.d + b.d}; }
inline Dual operator-(Dual a, Dual b) { return {a.v - b.v, a.d - b.d}; }
inline Dual operator-(Dual a) { return {-a.v, -a.d}; }
inline Dual operator*(Dual a, Dual b) { return {a.v * b.v, a.d * b.v + a.v * b.d}; }
inline Dual operator*(Real a, Dual b) { return {a * b.v, a * b.d}; }

using Triple = std::array<Dual, 3>;
inline Triple operator+(const Triple& a, const Triple& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
inline Triple cross(const Triple& a, const Triple& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

using Rotation = std::array<Triple, 3>;  ///< rows
inline Triple operator*(const Rotation& R, const Triple& x) {
  Triple y;
  for (std::size_t i = 0; i < 3; ++i) y[i] = R[i][0] * x[0] + R[i][1] * x[1] + R[i][2] * x[2];
  return y;
}
inline Triple operator*(Real x, const Triple& t) { return {x * t[0], x * t[1], x * t[2]}; }
inline Rotation operator*(const Rotation& A, const Rotation& B) {
  Rotation R;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      R[i][j] = A[i][0] * B[0][j] + A[i][1] * B[1][j] + A[i][2] * B[2][j];
    }
  }
  return R;
}
inline Rotation constant(const Matrix3& M) {
  Rotation R;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      R[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)] = {M(i, j), 0};
    }
  }
  return R;
}

inline Real dot(const Triple& a, const Triple& b) {
  return a[0].v * b[0].v + a[1].v * b[1].v + a[2].v * b[2].v;
}
inline Real dot_rate(const Triple& a, const Triple& b) {
  return a[0].v * b[0].d + a[1].v * b[1].d + a[2].v * b[2].d;
}

inline Vector3 values(const Triple& t) { return {t[0].v, t[1].v, t[2].v}; }
inline Vector3 rates(const Triple& t) { return {t[0].d, t[1].d, t[2].d}; }
inline Matrix3 values(const Rotation& R) {
  Matrix3 M;
  for (int i = 0; i < 3; ++i) M.row(i) = values(R[static_cast<std::size_t>(i)]).transpose();
  return M;
}

}  // namespace softarm::reference
