#include "model/own_columns.hpp"

#include "model/rotary_inertia.hpp"

namespace softarm {
namespace {

/// (u x e) for both columns e: the vector J u.
Pair turned(double ux, double uy) noexcept { return Pair{-uy, ux}; }

/// Terms of `arc_columns` at constant length, each for both columns e side by side. In the plane of S_{i-1}: J (x, y)
/// = (-y, x), u the bending, e the unit vectors, v = u'.
struct ArcColumnTerms {
  const ArcMoments& m;
  double ux, uy, s;
  Direction v;
  Vector3 spin;
  double spin_u;  ///< u . spin
  Pair u, dv;
  Pair kappa;     ///< u_e (u . v)
  Pair g_x, g_y;  ///< (u . v) e + u_e v + v_e u

  template <bool kExtensible>
  ArcColumnTerms(const SegmentState<kExtensible>& state, const ArcMoments& moments) noexcept
      : m(moments),
        ux(state.ux),
        uy(state.uy),
        s(ux * ux + uy * uy),
        v(state.v),
        spin(state.spin),
        spin_u(ux * spin.x + uy * spin.y),
        u{ux, uy},
        dv{v.x, v.y},
        kappa(v.along * u),
        g_x(Pair{v.along, 0.0} + v.x * u + ux * dv),
        g_y(Pair{0.0, v.along} + v.y * u + uy * dv) {}

  PairVector3 angular() const noexcept {
    const double bend = m.qp1 - m.pq1;
    return {-(Pair{0.0, m.pq} + (bend * uy) * u), Pair{m.pq, 0.0} + (bend * ux) * u,
            m.pp * turned(ux, uy)};
  }

  /// int r x (rate of J_e within S_{i-1}) + int r x (spin x J_e)
  PairVector3 angular_rate() const noexcept {
    const Pair axial = m.pq1 * dv + (m.pq2 - m.qp2) * kappa;
    const double plane = m.pp * spin_u + m.pq * spin.z;
    const Pair stretch = (m.pp1 * spin_u + m.qp1 * spin.z) * u;
    const Pair radial = m.trace_rate(s) * u;
    return {
        uy * axial - m.qp1 * g_y + spin.x * radial - Pair{plane, 0.0} - ux * stretch,
        m.qp1 * g_x - ux * axial + spin.y * radial - Pair{0.0, plane} - uy * stretch,
        m.pp1 * (ux * g_y - uy * g_x) + spin.z * radial - (m.pq1 * spin_u + m.qq1 * spin.z) * u};
  }

  /// int (spin x r) x J_e + int (dr along v) x J_e
  PairVector3 flow() const noexcept {
    const Pair spin_e{spin.x, spin.y};
    const Pair plane = m.pp * spin_e + (m.pp1 * spin_u + m.pq1 * spin.z) * u;
    const Pair radial = m.trace_rate(s) * u;
    const double across = v.x * uy - v.y * ux;
    return {ux * plane - spin.x * radial + m.pq1 * (v.y * u - Pair{0.0, v.along}),
            uy * plane - spin.y * radial + m.pq1 * (Pair{v.along, 0.0} - v.x * u),
            m.pq * spin_e + (m.qp1 * spin_u + m.qq1 * spin.z) * u - spin.z * radial +
                m.pp * turned(v.x, v.y) + m.pp1 * (across * u + v.along * turned(ux, uy))};
  }

  /// Row e of int J_e . J_f' without the part of the spin; f side by side.
  Pair coriolis_row(double u_e, const Pair& g_e) const noexcept {
    return m.pp1 * g_e + u_e * ((m.pp2 + 2.0 * m.p1p1 + m.p1p2 * s + m.q1q2) * kappa +
                                (m.p1p1 * s + m.q1q1) * dv);
  }

  /// int {y, y'} y_i: second moment and, from it, spin and bending.
  template <bool kRates>
  PairVector3 second_row(const Vector3& W, double on_v, double on_u, double on_z) const noexcept {
    if constexpr (!kRates) return side_by_side(W, {0.0, 0.0, 0.0});
    const Vector3 rate = cross(spin, W) + Vector3{on_v * v.x + on_u * v.along * ux,
                                                  on_v * v.y + on_u * v.along * uy, on_z * v.along};
    return side_by_side(W, rate);
  }
};

template <bool kRates>
[[gnu::always_inline]] inline OwnColumns<false> at_constant_length(double mass,
                                                                   const ArcColumnTerms& t,
                                                                   const Curve& centre) noexcept {
  const ArcMoments& m = t.m;
  const double ux = t.ux, uy = t.uy;
  const auto c = point_motion(centre, SegmentState<false>{ux, uy, t.v, t.spin, {}});
  OwnColumns<false> out;
  out.momentum = mass * c.J;
  out.first = mass * side_by_side(c.place, kRates ? c.rate : Vector3{0.0, 0.0, 0.0});
  out.angular = t.angular();
  const double stretch = 2.0 * m.pp1 + m.p1p1 * t.s + m.q1q1;
  out.inertia = {Pair{m.pp, 0.0} + (stretch * ux) * t.u, Pair{0.0, m.pp} + (stretch * uy) * t.u};
  if constexpr (kRates) {
    out.momentum_rate = mass * c.J_rate;
    out.angular_rate = t.angular_rate();
    out.flow = t.flow();
    // spin . int J_y x J_x, skew in the two columns
    const double skew = m.pq1 * t.spin_u - t.spin.z * (m.pp + m.pp1 * t.s);
    out.coriolis = {t.coriolis_row(ux, t.g_x) + Pair{0.0, skew},
                    t.coriolis_row(uy, t.g_y) + Pair{-skew, 0.0}};
  }
  const auto row = [&t](const Vector3& W, double on_v, double on_u, double on_z) {
    return t.template second_row<kRates>(W, on_v, on_u, on_z);
  };
  out.second = {row({m.pp * ux * ux, m.pp * ux * uy, m.pq * ux}, m.pp * ux, m.pp1 * ux, m.pq1 * ux),
                row({m.pp * ux * uy, m.pp * uy * uy, m.pq * uy}, m.pp * uy, m.pp1 * uy, m.pq1 * uy),
                row({m.pq * ux, m.pq * uy, m.qq}, m.pq, m.qp1, m.qq1)};
  return out;
}

/// Of four discs side by side, summed: both columns along u, and where segments stretch none along e.
template <bool kExtensible>
Columns<kExtensible> sums(const Lanes& x, const Lanes& y) noexcept {
  const Pair both{detail::sum(x), detail::sum(y)};
  if constexpr (kExtensible) {
    return beside(both, 0.0);
  } else {
    return both;
  }
}
template <bool kExtensible>
Vec3<Columns<kExtensible>> sums(const std::array<Vec3<Lanes>, 2>& v) noexcept {
  return {sums<kExtensible>(v[0].x, v[1].x), sums<kExtensible>(v[0].y, v[1].y),
          sums<kExtensible>(v[0].z, v[1].z)};
}

/// {y, y'} where y grows at `strain_rate` as well.
PairVector3 grown(const PairVector3& y, double strain_rate) noexcept {
  return y + Pair{0.0, strain_rate} * column(y, 0);
}

/// All points are linear in l: the columns along u grow, and that along e is r / l.
template <bool kRates>
OwnColumns<true> with_elongation(const ArcColumnTerms& t, const OwnColumns<false>& held,
                                 const Stretch<true>& stretch) noexcept {
  const double grow = stretch.strain_rate, per_length = stretch.inverse_length;
  const double per_area = per_length * per_length;
  const ArcMoments& m = t.m;
  const Pair radial = m.trace_rate(t.s) * t.u;  // int r . J_e at constant length

  OwnColumns<true> out;
  out.momentum = beside(held.momentum, per_length * column(held.first, 0));
  out.angular = without_elongation<true>(held.angular);
  for (int e = 0; e < 2; ++e) {
    const auto row = static_cast<std::size_t>(e);
    out.inertia[row] = beside(held.inertia[row], per_length * radial[e]);
  }
  out.inertia[2] = beside(per_length * radial, per_area * (m.pp * t.s + m.qq));
  out.first = held.first;
  out.second = held.second;
  if constexpr (!kRates) return out;
  // int r x r', int r . J_e' and int J_e . r' at constant length
  const Vector3 angular = t.v.x * column(held.angular, 0) + t.v.y * column(held.angular, 1) +
                          SecondMoments(held.second, 0).off_trace(t.spin);
  const Pair turning = dot(t.spin, held.angular);
  const Pair radial_rate =
      (2.0 * m.pp1 + m.pp2 * t.s + m.qq2) * t.kappa + (m.pp1 * t.s + m.qq1) * t.dv - turning;
  const Pair along_rate = t.v.x * held.inertia[0] + t.v.y * held.inertia[1] + turning;
  out.momentum_rate =
      beside(held.momentum_rate + grow * held.momentum, per_length * column(held.first, 1));
  out.angular_rate = beside(held.angular_rate + grow * held.angular, per_length * angular);
  out.flow = beside(held.flow + grow * held.angular, -per_length * angular);
  for (int e = 0; e < 2; ++e) {
    const auto row = static_cast<std::size_t>(e);
    out.coriolis[row] =
        beside(held.coriolis[row] + grow * held.inertia[row], per_length * along_rate[e]);
  }
  out.coriolis[2] =
      beside(per_length * (radial_rate + grow * radial), per_area * m.trace_rate(t.s) * t.v.along);
  out.first = grown(held.first, grow);
  out.second = {grown(held.second.x, grow), grown(held.second.y, grow), grown(held.second.z, grow)};
  return out;
}

}  // namespace

template <bool kRates, bool kExtensible>
OwnColumns<kExtensible> arc_columns(double mass, const SegmentState<kExtensible>& state,
                                    const Curve& centre, const ArcMoments& m) noexcept {
  const ArcColumnTerms t(state, m);
  const OwnColumns<false> held = at_constant_length<kRates>(mass, t, centre);
  if constexpr (kExtensible) {
    return with_elongation<kRates>(t, held, state.stretch);
  } else {
    return held;
  }
}

// A disc's points are rho with int rho rho' = M = j (1 - e e'), j = dm r^2 / 4 and e the tangent, so
// that int rho x (W x rho) = (tr M - M) W = j (1 + e e') W; with rho' = w x rho, int rho_i rho' = w x
// M_i, which has no trace.
template <bool kRates, bool kExtensible>
void add_discs(double inertia, const SegmentState<kExtensible>& state,
               OwnColumns<kExtensible>& own) noexcept {
  using ColumnPair = std::array<Vec3<Lanes>, 2>;
  const Lanes none{};
  const auto spread = [](const Vector3& v) {
    return Vec3<Lanes>{Lanes{} + v.x, Lanes{} + v.y, Lanes{} + v.z};
  };
  const Vec3<Lanes> spin_of_frame = spread(state.spin);
  for (std::size_t node = 0; node < detail::kArcNodes.size(); ++node) {
    const Lanes x = detail::kArcNodes[node], j = inertia * detail::kArcWeights[node];
    // Bent by x u; .d are rates within S_{i-1}.
    const SlopeLanes ux{x * state.ux, x * state.v.x}, uy{x * state.uy, x * state.v.y};
    const auto c = entire<8>(ux * ux + uy * uy);
    const Vec3<Lanes> e{c[1].v * ux.v, c[1].v * uy.v, c[0].v};
    const auto times_M = [&](const Vec3<Lanes>& v) { return j * (v - dot(e, v) * e); };
    const auto off_trace_M = [&](const Vec3<Lanes>& v) { return j * (v + dot(e, v) * e); };
    ColumnPair W, W_rate, angular, angular_rate, flow;
    for (std::size_t f = 0; f < 2; ++f) {
      const auto along = direction(ux, uy, f == 0 ? x : none, f == 0 ? none : x);
      const Vec3<SlopeLanes> both = first(spin(c), ux, uy, along);
      W[f] = {both.x.v, both.y.v, both.z.v};
      W_rate[f] = Vec3<Lanes>{both.x.d, both.y.d, both.z.d} + cross(spin_of_frame, W[f]);
      angular[f] = off_trace_M(W[f]);
    }
    const Vec3<Lanes> w = spin_of_frame + state.v.x * W[0] + state.v.y * W[1];
    for (std::size_t f = 0; f < 2; ++f) {
      angular_rate[f] = off_trace_M(W_rate[f]) - cross(w, times_M(W[f]));
      flow[f] = times_M(cross(w, W[f]));
    }
    own.angular += sums<kExtensible>(angular);
    for (std::size_t f = 0; f < 2; ++f) {
      own.inertia[f] += sums<kExtensible>(dot(W[f], angular[0]), dot(W[f], angular[1]));
    }
    const auto second_row = [&](const Lanes& e_i, const Vector3& unit) {
      const Vec3<Lanes> M = j * (spread(unit) - e_i * e), rate = cross(w, M);
      return PairVector3{Pair{detail::sum(M.x), detail::sum(rate.x)},
                         Pair{detail::sum(M.y), detail::sum(rate.y)},
                         Pair{detail::sum(M.z), detail::sum(rate.z)}};
    };
    own.second.x += second_row(e.x, {1.0, 0.0, 0.0});
    own.second.y += second_row(e.y, {0.0, 1.0, 0.0});
    own.second.z += second_row(e.z, {0.0, 0.0, 1.0});
    if constexpr (!kRates) continue;
    own.angular_rate += sums<kExtensible>(angular_rate);
    own.flow += sums<kExtensible>(flow);
    for (std::size_t f = 0; f < 2; ++f) {
      own.coriolis[f] += sums<kExtensible>(dot(W[f], angular_rate[0]), dot(W[f], angular_rate[1]));
    }
  }
}

#define SOFTARM_ARC_COLUMNS(rates, extensible)                                                  \
  template OwnColumns<extensible> arc_columns<rates>(double, const SegmentState<extensible>&,   \
                                                     const Curve&, const ArcMoments&) noexcept; \
  template void add_discs<rates>(double, const SegmentState<extensible>&,                       \
                                 OwnColumns<extensible>&) noexcept
SOFTARM_ARC_COLUMNS(false, false);
SOFTARM_ARC_COLUMNS(false, true);
SOFTARM_ARC_COLUMNS(true, false);
SOFTARM_ARC_COLUMNS(true, true);
#undef SOFTARM_ARC_COLUMNS

}  // namespace softarm
