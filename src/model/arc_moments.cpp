#include "model/arc_moments.hpp"

#include <cmath>

namespace softarm {
namespace {

/// d_k = c_k(4s) from c_j(s): integrate the addition theorem of cos k times,
/// 2^k d_k = c0 c_k + c1 c_{k-1} + sum_{j=0}^{k-2} c_{k-j} / j!. All terms are positive for theta <
/// pi/2.
template <int K, class T>
T doubled(const std::array<T, 12>& c) noexcept {
  constexpr auto k = static_cast<std::size_t>(K);
  T sum = c[0] * c[k] + c[1] * c[k - 1];
#pragma GCC unroll 16
  for (std::size_t j = 0; j < k - 1; ++j) sum += c[k - j] * detail::kInverseFactorial[j];
  return sum * (1.0 / static_cast<double>(1 << K));
}

/// Below the limit. Each coefficient set is the only combination of c_k(4s) and c_k(s), k = 3 ...
/// 11, whose power series in s is that of the integral: products of sines and cosines of x theta
/// become those of 2 x theta, and the polynomials in x in front are what raises k.
template <class S, class T>
ArcMomentsOf<T> from_entire(const S& scale, const std::array<T, 12>& c) noexcept {
  const T d3 = doubled<3>(c), d4 = doubled<4>(c), d5 = doubled<5>(c), d6 = doubled<6>(c),
          d7 = doubled<7>(c), d8 = doubled<8>(c), d9 = doubled<9>(c), d10 = doubled<10>(c),
          d11 = doubled<11>(c);
  ArcMomentsOf<T> m;
  m.pp = scale * (8.0 * d5 - 2.0 * c[5]);
  m.pq = scale * (4.0 * d4 - c[4]);
  m.qq = scale * (2.0 * d3);
  m.pp1 = scale * (80.0 * d7 - 16.0 * d6 + c[6] - 5.0 * c[7]);
  m.pq1 = scale * (24.0 * d6 - 8.0 * d5 + c[5] - 2.0 * c[6]);
  m.qp1 = scale * (40.0 * d6 - 8.0 * d5 - 2.0 * c[6]);
  m.qq1 = scale * (12.0 * d5 - 4.0 * d4);
  m.pp2 = scale * (1408.0 * d9 - 384.0 * d8 + 32.0 * d7 - c[7] + 7.0 * c[8] - 23.0 * c[9]);
  m.pq2 = scale * (320.0 * d8 - 128.0 * d7 + 16.0 * d6 - c[6] + 5.0 * c[7] - 8.0 * c[8]);
  m.qp2 = scale * (704.0 * d8 - 192.0 * d7 + 16.0 * d6 - 8.0 * c[8]);
  m.qq2 = scale * (160.0 * d7 - 64.0 * d6 + 8.0 * d5);
  m.p1p1 = scale * (832.0 * d9 - 320.0 * d8 + 32.0 * d7 + 4.0 * c[8] - 12.0 * c[9]);
  m.q1q1 = scale * (80.0 * d7 - 48.0 * d6 + 8.0 * d5);
  m.p1p2 = scale * (14976.0 * d11 - 6784.0 * d10 + 1088.0 * d9 - 64.0 * d8 - 2.0 * c[9] +
                    22.0 * c[10] - 54.0 * c[11]);
  m.q1q2 = scale * (1120.0 * d9 - 736.0 * d8 + 176.0 * d7 - 16.0 * d6);
  return m;
}

/// Integrals of y^k cos(w y) and y^k sin(w y) over [0, theta], k = 0 ... 3, by parts.
template <class T>
struct TrigonometricMoments {
  T cosine[4], sine[4];

  TrigonometricMoments(double w, const T& theta, const T& sin_end, const T& cos_end,
                       const T& one_minus_cos_end) noexcept {
    const double inverse = 1.0 / w;
    cosine[0] = sin_end * inverse;
    sine[0] = one_minus_cos_end * inverse;
    T power = theta;
    for (int k = 1; k < 4; ++k) {
      sine[k] = (k * cosine[k - 1] - power * cos_end) * inverse;
      cosine[k] = (power * sin_end - k * sine[k - 1]) * inverse;
      power *= theta;
    }
  }
};

/// Above the limit, with y = x theta, S = sin y, C = cos y, V = 1 - C:
/// P = V / theta^2, P1 = (y S - 2 V) / theta^4, P2 = (y^2 C - 5 y S + 8 V) / theta^6,
/// Q = S / theta,   Q1 = (y C - S) / theta^3,   Q2 = (3 S - 3 y C - y^2 S) / theta^5.
template <class S, class T>
ArcMomentsOf<T> from_trigonometry(const S& scale, const T& s, const T& c0, const T& c1) noexcept {
  using std::sqrt;
  const T theta = sqrt(s);
  const T sine = c1 * theta;
  const TrigonometricMoments<T> once(1.0, theta, sine, c0, 1.0 - c0);
  const TrigonometricMoments<T> twice(2.0, theta, 2.0 * sine * c0, 1.0 - 2.0 * sine * sine,
                                      2.0 * sine * sine);
  T SS[4], SC[4], CC[4], VS[4], VC[4];  // integrals of y^k times the product
  T power = theta;
  for (int k = 0; k < 4; ++k) {
    const T one = power / (k + 1);
    SS[k] = 0.5 * (one - twice.cosine[k]);
    CC[k] = 0.5 * (one + twice.cosine[k]);
    SC[k] = 0.5 * twice.sine[k];
    VS[k] = once.sine[k] - SC[k];
    VC[k] = once.cosine[k] - CC[k];
    power *= theta;
  }
  const T VV = theta - 2.0 * once.cosine[0] + CC[0];
  const T i1 = 1.0 / theta, i2 = i1 * i1;
  const T w3 = scale * i1 * i2, w4 = w3 * i1, w5 = w3 * i2, w6 = w5 * i1, w7 = w5 * i2;
  ArcMomentsOf<T> m;
  m.pp = w5 * VV;
  m.pq = w4 * VS[0];
  m.qq = w3 * SS[0];
  m.pp1 = w7 * (VS[1] - 2.0 * VV);
  m.pq1 = w6 * (VC[1] - VS[0]);
  m.qp1 = w6 * (SS[1] - 2.0 * VS[0]);
  m.qq1 = w5 * (SC[1] - SS[0]);
  m.pp2 = w7 * i2 * (VC[2] - 5.0 * VS[1] + 8.0 * VV);
  m.pq2 = w7 * i1 * (3.0 * VS[0] - 3.0 * VC[1] - VS[2]);
  m.qp2 = w7 * i1 * (SC[2] - 5.0 * SS[1] + 8.0 * VS[0]);
  m.qq2 = w7 * (3.0 * SS[0] - 3.0 * SC[1] - SS[2]);
  m.p1p1 = w7 * i2 * (SS[2] - 4.0 * VS[1] + 4.0 * VV);
  m.q1q1 = w7 * (CC[2] - 2.0 * SC[1] + SS[0]);
  m.p1p2 = w7 * i2 * i2 * (SC[3] - 5.0 * SS[2] + 18.0 * VS[1] - 2.0 * VC[2] - 16.0 * VV);
  m.q1q2 = w7 * i2 * (SS[2] - SC[3] - 3.0 * CC[2] + 6.0 * SC[1] - 3.0 * SS[0]);
  return m;
}

template <class T>
std::array<T*, 15> members(ArcMomentsOf<T>& m) noexcept {
  return {&m.pp,  &m.pq,  &m.qq,  &m.pp1,  &m.pq1,  &m.qp1,  &m.qq1, &m.pp2,
          &m.pq2, &m.qp2, &m.qq2, &m.p1p1, &m.q1q1, &m.p1p2, &m.q1q2};
}

}  // namespace

ArcMoments arc_moments(double mass_length_squared, double s,
                       const std::array<double, 12>& c) noexcept {
  if (s < kArcSeriesLimit) return from_entire(mass_length_squared, c);
  return from_trigonometry(mass_length_squared, s, c[0], c[1]);
}

ArcMomentsOf<Lanes> arc_moments(const Lanes& mass_length_squared, const Lanes& s,
                                const std::array<Lanes, 12>& c) noexcept {
  ArcMomentsOf<Lanes> all = from_entire(mass_length_squared, c);
  for (int lane = 0; lane < kLanes; ++lane) {
    if (s[lane] < kArcSeriesLimit) continue;
    ArcMoments one = from_trigonometry(mass_length_squared[lane], s[lane], c[0][lane], c[1][lane]);
    const auto to = members(all);
    const auto from = members(one);
    for (std::size_t k = 0; k < to.size(); ++k) (*to[k])[lane] = *from[k];
  }
  return all;
}

ArcMomentsOf<SlopeLanes> arc_moments(const Lanes& mass_length_squared, const SlopeLanes& s,
                                     const std::array<SlopeLanes, 12>& c) noexcept {
  ArcMomentsOf<SlopeLanes> all = from_entire(mass_length_squared, c);
  for (int lane = 0; lane < kLanes; ++lane) {
    if (s.v[lane] < kArcSeriesLimit) continue;
    auto one =
        from_trigonometry(mass_length_squared[lane], at(s, lane), at(c[0], lane), at(c[1], lane));
    const auto to = members(all);
    const auto from = members(one);
    for (std::size_t k = 0; k < to.size(); ++k) {
      to[k]->v[lane] = from[k]->v;
      to[k]->d[lane] = from[k]->d;
    }
  }
  return all;
}

}  // namespace softarm
