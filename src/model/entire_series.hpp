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

/// [c_K(s), c_{K+1}(s)] from their series of `Terms` terms, both at once.
template <int K, int Terms>
inline Pair series(double s) noexcept {
  constexpr auto coefficient = [](int j) {
    const auto k = static_cast<std::size_t>(K + 2 * j);
    return Pair{kInverseFactorial[k], kInverseFactorial[k + 1]};
  };
  Pair sum = coefficient(Terms - 1);
#pragma GCC unroll 16
  for (int j = Terms - 2; j >= 0; --j) sum = coefficient(j) - s * sum;
  return sum;
}

/// c_{K-1} ... c_Last from c_K and c_{K+1}: for small s, where going down loses nothing.
template <int K, int Last>
inline void recur_down(double s, double* c) noexcept {
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
  std::array<double, N> c;
  if (s < kSeriesLimit) {
    const Pair top = detail::series < N - 2, N == 8 ? 14 : 13 > (s);
    c[N - 2] = top[0];
    c[N - 1] = top[1];
    detail::recur_down<N - 2, 0>(s, c.data());
    return c;
  }
  const double theta = std::sqrt(s);
  c[0] = std::cos(theta);
  c[1] = std::sin(theta) / theta;
  const double inverse_s = 1.0 / s;
  if (N == 8 || !(s < kHighSeriesLimit)) {
    detail::recur_up<N>(inverse_s, c.data());
    return c;
  }
  detail::recur_up<8>(inverse_s, c.data());
  const Pair top = detail::series<N - 2, 17>(s);
  c[N - 2] = top[0];
  c[N - 1] = top[1];
  detail::recur_down<N - 2, 8>(s, c.data());
  return c;
}

}  // namespace softarm
