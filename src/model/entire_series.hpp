// c_0(s) ... c_{N-1}(s) in line, for the hot loops; see include/softarm/model/entire_functions.hpp
// for what they are.
#pragma once

#include <array>
#include <cmath>

#include "model/vec3.hpp"

namespace softarm {

namespace detail {

inline constexpr std::array<double, 44> kInverseFactorial = [] {
  std::array<double, 44> inverse{};
  long double factorial = 1.0L;
  for (std::size_t k = 0; k < inverse.size(); ++k) {
    if (k > 0) factorial *= static_cast<long double>(k);
    inverse[k] = static_cast<double>(1.0L / factorial);
  }
  return inverse;
}();

/// c_K(s) from its series of `Terms` terms (even), those of even and of odd power in two chains so
/// that neither waits for the other. Below s = K^2 the terms fall from the first on, so that the
/// difference of the two loses nothing.
template <int K, int Terms, class T>
inline T series(T s, T s_squared) noexcept {
  static_assert(Terms % 2 == 0);
  constexpr auto coefficient = [](int j) {
    return kInverseFactorial[static_cast<std::size_t>(K + 2 * j)];
  };
  T even = T{} + coefficient(Terms - 2), odd = T{} + coefficient(Terms - 1);
#pragma GCC unroll 16
  for (int j = Terms - 4; j >= 0; j -= 2) {
    even = coefficient(j) + s_squared * even;
    odd = coefficient(j + 1) + s_squared * odd;
  }
  return even - s * odd;
}

/// c_{K-1} ... c_Last from c_K and c_{K+1}: for small s, where going down loses nothing.
template <int K, int Last, class T>
inline void recur_down(T s, T* c) noexcept {
#pragma GCC unroll 16
  for (int k = K - 1; k >= Last; --k)
    c[k] = kInverseFactorial[static_cast<std::size_t>(k)] - s * c[k + 2];
}

/// c_2 ... c_{K-1} from c_0 and c_1: for large s, where going up loses nothing.
template <int K>
inline void recur_up(double inverse_s, double* c) noexcept {
#pragma GCC unroll 16
  for (int k = 0; k + 2 < K; ++k)
    c[k + 2] = (kInverseFactorial[static_cast<std::size_t>(k)] - c[k]) * inverse_s;
}

/// Where the series of the two highest functions reach round-off.
template <int N, class T>
inline std::array<T, N> entire_from_series(T s) noexcept {
  std::array<T, N> c;
  const T s_squared = s * s;
  c[N - 2] = series<N - 2, 14>(s, s_squared);
  c[N - 1] = series<N - 1, 14>(s, s_squared);
  recur_down<N - 2, 0>(s, c.data());
  return c;
}

}  // namespace detail

/// Below this s everything comes down from the series of the two highest functions; above, c0 and
/// c1 are trigonometric.
inline constexpr double kSeriesLimit = 12.0;
/// c_8 and higher still lose digits going up at s = 12; up to here they keep their series.
inline constexpr double kHighSeriesLimit = 33.0;

/// c_0 ... c_{N-1}, N = 8 or 12. A NaN takes the trigonometric branch and comes out as NaN.
template <int N>
inline std::array<double, N> entire(double s) noexcept {
  static_assert(N == 8 || N == 12);
  if (s < kSeriesLimit) return detail::entire_from_series<N>(s);
  std::array<double, N> c;
  const double theta = std::sqrt(s);
  c[0] = std::cos(theta);
  c[1] = std::sin(theta) / theta;
  const double inverse_s = 1.0 / s;
  if (N == 8 || !(s < kHighSeriesLimit)) {
    detail::recur_up<N>(inverse_s, c.data());
    return c;
  }
  detail::recur_up<8>(inverse_s, c.data());
  const double s_squared = s * s;
  c[N - 2] = detail::series<N - 2, 18>(s, s_squared);
  c[N - 1] = detail::series<N - 1, 18>(s, s_squared);
  detail::recur_down<N - 2, 8>(s, c.data());
  return c;
}

/// The same of four segments. A lane's numbers do not depend on its neighbours.
template <int N>
inline std::array<Lanes, N> entire(Lanes s) noexcept {
  std::array<Lanes, N> c = detail::entire_from_series<N>(s);
  for (int lane = 0; lane < kLanes; ++lane) {
    if (s[lane] < kSeriesLimit) continue;
    const auto one = entire<N>(s[lane]);
    for (std::size_t k = 0; k < N; ++k) c[k][lane] = one[k];
  }
  return c;
}

}  // namespace softarm
