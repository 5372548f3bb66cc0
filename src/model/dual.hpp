// Numbers with their derivatives along one segment's coordinates, for templates written for double
// and Lanes: exact but for rounding, with no step to choose.
#pragma once

#include <array>
#include <cmath>
#include <concepts>

#include "model/entire_series.hpp"
#include "model/quad.hpp"

namespace softarm {

/// v and its tangents d = d v / d q_k. T is double or Lanes; D adds and takes factors of T.
template <class T, class D>
struct Dual {
  T v{};
  D d{};

  Dual() noexcept = default;
  Dual(const T& value) noexcept : v(value) {}
  Dual(const T& value, const D& tangents) noexcept : v(value), d(tangents) {}

  Dual operator-() const noexcept { return {-v, -d}; }
  template <class S>
  Dual& operator+=(const S& b) noexcept {
    return *this = *this + b;
  }
  template <class S>
  Dual& operator*=(const S& b) noexcept {
    return *this = *this * b;
  }
  friend Dual operator+(const Dual& a, const Dual& b) noexcept { return {a.v + b.v, a.d + b.d}; }
  friend Dual operator-(const Dual& a, const Dual& b) noexcept { return {a.v - b.v, a.d - b.d}; }
  friend Dual operator*(const Dual& a, const Dual& b) noexcept {
    return {a.v * b.v, b.v * a.d + a.v * b.d};
  }
};

/// What has no tangents: a double, or Lanes of them beside Dual<Lanes>.
template <class S, class T>
concept Constant = std::convertible_to<S, double> || std::same_as<S, T>;

template <class T, class D, Constant<T> S>
Dual<T, D> operator+(const Dual<T, D>& a, const S& b) noexcept {
  return {a.v + b, a.d};
}
template <class T, class D, Constant<T> S>
Dual<T, D> operator+(const S& a, const Dual<T, D>& b) noexcept {
  return {a + b.v, b.d};
}
template <class T, class D, Constant<T> S>
Dual<T, D> operator-(const Dual<T, D>& a, const S& b) noexcept {
  return {a.v - b, a.d};
}
template <class T, class D, Constant<T> S>
Dual<T, D> operator-(const S& a, const Dual<T, D>& b) noexcept {
  return {a - b.v, -b.d};
}
template <class T, class D, Constant<T> S>
Dual<T, D> operator*(const Dual<T, D>& a, const S& b) noexcept {
  return {b * a.v, b * a.d};
}
template <class T, class D, Constant<T> S>
Dual<T, D> operator*(const S& a, const Dual<T, D>& b) noexcept {
  return {a * b.v, a * b.d};
}
template <class T, class D>
Dual<T, D> operator/(const Dual<T, D>& a, double b) noexcept {
  return (1.0 / b) * a;
}
template <class T, class D>
Dual<T, D> operator/(double a, const Dual<T, D>& b) noexcept {
  const T quotient = a / b.v;
  return {quotient, (-quotient / b.v) * b.d};
}
template <class D>
Dual<double, D> sqrt(const Dual<double, D>& a) noexcept {
  const double root = std::sqrt(a.v);
  return {root, (0.5 / root) * a.d};
}

/// What carries no tangents beside numbers of type L.
template <class L>
struct PlainNumber {
  using type = L;
};
template <class T, class D>
struct PlainNumber<Dual<T, D>> {
  using type = T;
};
template <class L>
using PlainOf = typename PlainNumber<L>::type;

/// N tangents of four numbers.
template <int N>
struct LaneTangents {
  std::array<Lanes, N> along{};

  template <class Operation>
  static LaneTangents each(const Operation& operation) noexcept {
    LaneTangents out;
#pragma GCC unroll 3
    for (std::size_t k = 0; k < N; ++k) out.along[k] = operation(k);
    return out;
  }
  LaneTangents operator-() const noexcept {
    return each([this](std::size_t k) { return -along[k]; });
  }
  friend LaneTangents operator+(const LaneTangents& a, const LaneTangents& b) noexcept {
    return each([&](std::size_t k) { return a.along[k] + b.along[k]; });
  }
  friend LaneTangents operator-(const LaneTangents& a, const LaneTangents& b) noexcept {
    return each([&](std::size_t k) { return a.along[k] - b.along[k]; });
  }
  template <class S>
  friend LaneTangents operator*(const S& factor, const LaneTangents& a) noexcept {
    return each([&](std::size_t k) { return factor * a.along[k]; });
  }
};

/// Two or three tangents in one register: along u_x, u_y and, where segments stretch, e.
using BendingDual = Dual<double, Pair>;
using StretchDual = Dual<double, Quad>;
using BendingLanes = Dual<Lanes, LaneTangents<2>>;
using StretchLanes = Dual<Lanes, LaneTangents<3>>;
/// Four numbers with their derivatives by one variable.
using SlopeLanes = Dual<Lanes, Lanes>;

/// The number of one segment of four, or of the only one.
inline double at(const Lanes& v, int l) noexcept { return v[l]; }
inline Dual<double, double> at(const SlopeLanes& a, int l) noexcept { return {a.v[l], a.d[l]}; }
inline double at(double v, int) noexcept { return v; }
template <class D>
Dual<double, D> at(const Dual<double, D>& a, int) noexcept {
  return a;
}

/// c_0 ... c_{N-1} by dc_k/ds = (k c_{k+2} - c_{k+1}) / 2. With N = 12 the tangents of the last two
/// hold only below `kSeriesLimit`, beyond which nothing reads them.
template <int N, class D>
std::array<Dual<Lanes, D>, N> entire(const Dual<Lanes, D>& s) noexcept {
  std::array<Lanes, 14> c;
  const auto known = entire<12>(s.v);
  for (std::size_t k = 0; k < known.size(); ++k) c[k] = known[k];
  if constexpr (N == 12) {
    const Lanes squared = s.v * s.v;
    c[12] = detail::series<12, 14>(s.v, squared);
    c[13] = detail::series<13, 14>(s.v, squared);
  }
  std::array<Dual<Lanes, D>, N> out;
#pragma GCC unroll 12
  for (std::size_t k = 0; k < N; ++k) {
    out[k] = {c[k], (0.5 * (static_cast<double>(k) * c[k + 2] - c[k + 1])) * s.d};
  }
  return out;
}

}  // namespace softarm
