// Vectors of three for the hot loops. A component is a double; a Pair holding the two columns u_x,
// u_y of a segment side by side; or Lanes, the same number of four neighbouring segments. What is
// done to all of them is then done once and in one register (or in two, on a machine without AVX).
#pragma once

#include <Eigen/Core>

namespace softarm {

using Pair = double __attribute__((vector_size(16)));
using Lanes = double __attribute__((vector_size(32)));
inline constexpr int kLanes = 4;

template <class T>
struct Vec3 {
  T x, y, z;

  template <class S>
  Vec3& operator+=(const Vec3<S>& v) noexcept {
    x += v.x;
    y += v.y;
    z += v.z;
    return *this;
  }
};
template <class T>
Vec3(T, T, T) -> Vec3<T>;  // clang 14 deduces none for aggregates

using Vector3 = Vec3<double>;
using PairVector3 = Vec3<Pair>;

template <class S, class T>
inline auto operator+(const Vec3<S>& a, const Vec3<T>& b) noexcept {
  return Vec3<decltype(a.x + b.x)>{a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class S, class T>
inline auto operator-(const Vec3<S>& a, const Vec3<T>& b) noexcept {
  return Vec3<decltype(a.x - b.x)>{a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class S, class T>
inline auto operator*(const S& a, const Vec3<T>& b) noexcept {
  return Vec3<decltype(a * b.x)>{a * b.x, a * b.y, a * b.z};
}
template <class S, class T>
inline auto dot(const Vec3<S>& a, const Vec3<T>& b) noexcept {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class S, class T>
inline auto cross(const Vec3<S>& a, const Vec3<T>& b) noexcept {
  using R = decltype(a.x * b.x);
  return Vec3<R>{a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
/// One number of each component.
template <class T>
inline Vector3 column(const Vec3<T>& v, int k) noexcept {
  return {v.x[k], v.y[k], v.z[k]};
}
inline PairVector3 side_by_side(const Vector3& a, const Vector3& b) noexcept {
  return {Pair{a.x, b.x}, Pair{a.y, b.y}, Pair{a.z, b.z}};
}

inline Vector3 from_eigen(const Eigen::Vector3d& v) noexcept { return {v.x(), v.y(), v.z()}; }
inline Eigen::Vector3d to_eigen(const Vector3& v) noexcept { return {v.x, v.y, v.z}; }

}  // namespace softarm
