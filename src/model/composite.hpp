// Everything beyond a point of the arm, as one body that still moves inside: what B and C need of
// it.
#pragma once

#include "model/segment_geometry.hpp"

namespace softarm {

/// Moments about p of mass at y = x - p with velocity y' relative to p. A Pair holds {y, y'} side
/// by side.
struct Composite {
  double mass = 0.0;
  PairVector3 first{Pair{0, 0}, Pair{0, 0}, Pair{0, 0}};  ///< {int y, int y'}
  Vec3<PairVector3> second{first, first, first};          ///< row i: {int y_i y, int y_i y'}

  /// From S_i to S_{i-1} axes.
  void rotate_by(const Turn& turn) noexcept {
    first = rotate(turn, first);
    const PairVector3 a = rotate(turn, second.x), b = rotate(turn, second.y),
                      c = rotate(turn, second.z);
    const PairVector3 x = rotate(turn, PairVector3{a.x, b.x, c.x});
    const PairVector3 y = rotate(turn, PairVector3{a.y, b.y, c.y});
    const PairVector3 z = rotate(turn, PairVector3{a.z, b.z, c.z});
    second = {{x.x, y.x, z.x}, {x.y, y.y, z.y}, {x.z, y.z, z.z}};
  }

  /// New reference point p - t, which moves at -t' against p; `step` is {t, t'}.
  void move_by(const Vector3& t, const PairVector3& step) noexcept {
    const Vector3 y = column(first, 0);
    first += mass * step;
    second.x += y.x * step + t.x * first;
    second.y += y.y * step + t.y * first;
    second.z += y.z * step + t.z * first;
  }

  void add(double more_mass, const PairVector3& more_first,
           const Vec3<PairVector3>& more_second) noexcept {
    mass += more_mass;
    first += more_first;
    second += more_second;
  }
};

/// The second moments as plain numbers, applied to a vector or to columns.
struct SecondMoments {
  Vector3 x, y, z;  ///< rows
  double trace;

  SecondMoments(const Vec3<PairVector3>& both, int lane) noexcept
      : x(column(both.x, lane)),
        y(column(both.y, lane)),
        z(column(both.z, lane)),
        trace(x.x + y.y + z.z) {}

  /// (trace - M) v
  template <class T>
  Vec3<T> off_trace(const Vec3<T>& v) const noexcept {
    return trace * v - Vec3<T>{dot(x, v), dot(y, v), dot(z, v)};
  }
  /// (trace - M^T) v
  template <class T>
  Vec3<T> off_trace_transposed(const Vec3<T>& v) const noexcept {
    return {trace * v.x - (x.x * v.x + y.x * v.y + z.x * v.z),
            trace * v.y - (x.y * v.x + y.y * v.y + z.y * v.z),
            trace * v.z - (x.z * v.x + y.z * v.y + z.z * v.z)};
  }
};

}  // namespace softarm
