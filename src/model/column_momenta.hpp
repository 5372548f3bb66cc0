// What the columns of a segment do to everything beyond it, for B, C (dynamics_matrices.cpp) and their
// slopes (derivatives.cpp).
#pragma once

#include "model/dynamics_storage.hpp"

namespace softarm {

/// Which momenta are wanted: those of B, of the slopes, or of B and C.
enum class Momenta { inertia, slopes, rates };

/// Momenta of a segment's columns, handed from ancestor to ancestor.
template <class Column>
struct ColumnMomenta {
  Vec3<Column> P, L, P_rate, L_rate, flow;

  template <Momenta kWhich>
  void rotate_by(const Turn& turn) noexcept {
    P = rotate(turn, P);
    L = rotate(turn, L);
    if constexpr (kWhich == Momenta::rates) {
      P_rate = rotate(turn, P_rate);
      L_rate = rotate(turn, L_rate);
    }
    if constexpr (kWhich != Momenta::inertia) flow = rotate(turn, flow);
  }
  template <Momenta kWhich>
  void move_by(const Vector3& t, const Vector3& t_rate) noexcept {
    L += cross(t, P);
    if constexpr (kWhich == Momenta::rates) L_rate += cross(t, P_rate);
    if constexpr (kWhich != Momenta::inertia) flow += cross(t_rate, P);
  }
  /// From p_j to p_{j-1}, with the mass of segment j.
  template <Momenta kWhich, bool kExtensible>
  void move_past(const SegmentColumns<kExtensible>& k) noexcept {
    move_by<kWhich>(k.tip, k.tip_rate);
    P += k.own.momentum;
    L += k.own.angular;
    if constexpr (kWhich == Momenta::rates) {
      P_rate += k.own.momentum_rate;
      L_rate += k.own.angular_rate;
    }
    if constexpr (kWhich != Momenta::inertia) flow += k.own.flow;
  }
};

struct Output {
  double* data;
  Eigen::Index stride;

  double& operator()(int row, int col) const noexcept { return data[row + col * stride]; }
  Output from(int row, int col) const noexcept { return {data + row + col * stride, stride}; }
};

/// Columns of j over everything beyond p_j, about p_j.
template <Momenta kWhich, bool kExtensible>
inline auto beyond(const SegmentColumns<kExtensible>& k, const Composite& body) noexcept {
  const Vector3 h = column(body.first, 0), h_rate = column(body.first, 1);
  const SecondMoments position(body.second, 0), mixed(body.second, 1);
  ColumnMomenta<Columns<kExtensible>> m;
  m.P = body.mass * k.translation - cross(h, k.rotation);
  m.L = cross(h, k.translation) + position.off_trace(k.rotation);
  if constexpr (kWhich == Momenta::inertia) return m;
  if constexpr (kWhich == Momenta::rates) {
    m.P_rate =
        body.mass * k.translation_rate - cross(h, k.rotation_rate) - cross(h_rate, k.rotation);
    m.L_rate = cross(h, k.translation_rate) + position.off_trace(k.rotation_rate) +
               mixed.off_trace_transposed(k.rotation);
  }
  m.flow = cross(h_rate, k.translation) + mixed.off_trace(k.rotation);
  return m;
}

/// Fills the workspace's columns at this state, as `dynamics_matrices` does.
void set_columns_of(const ArmParameters& arm, DynamicsWorkspace& workspace, const double* u,
                    const double* velocity) noexcept;

}  // namespace softarm
