// What the recursions keep of every segment between their passes.
#pragma once

#include <Eigen/Core>
#include <type_traits>
#include <vector>

#include "model/own_columns.hpp"
#include "model/segment_lanes.hpp"
#include "softarm/model/dynamics.hpp"

namespace softarm {

/// Inverse dynamics: what a segment's own mass does, in S_{i-1}.
template <class S>
struct SegmentForcesOf {
  Vec3<S> force;
  Vec3<S> moment;        ///< about the segment's base p_{i-1}
  S torque_x, torque_y;  ///< on the segment's own u
};
/// Where segments stretch.
template <class S>
struct ExtensibleForcesOf : SegmentForcesOf<S> {
  S virial;  ///< sum of r . F, of which 1/l is the force on e
};

/// Full matrices: a segment's columns, all in S_{i-1}. A dot is a time derivative in the world,
/// seen from S_{i-1}.
template <bool kExtensible>
struct SegmentColumns {
  using Column = Columns<kExtensible>;

  Turn turn;
  double mass;
  Vector3 tip;       ///< p_i - p_{i-1}
  Vector3 tip_rate;  ///< its rate
  Vector3 gravity;
  Vec3<Column> translation, translation_rate;  ///< v: motion of p_i for unit u_x', u_y', e'
  Vec3<Column> rotation, rotation_rate;        ///< w: angular velocity of S_i for the same
  OwnColumns<kExtensible> own;
};

template <bool kExtensible, class S>
using ForcesOf = std::conditional_t<kExtensible, ExtensibleForcesOf<S>, SegmentForcesOf<S>>;

template <bool kExtensible>
struct SegmentStorage {
  std::vector<LanesOf<kExtensible, Lanes>> lanes;  // four segments each
  std::vector<ForcesOf<kExtensible, double>> forces;
  std::vector<SegmentColumns<kExtensible>> columns;

  explicit SegmentStorage(std::size_t segments)
      : lanes((segments + kLanes - 1) / kLanes), forces(segments), columns(segments) {}
};

struct DynamicsWorkspace::Storage {
  explicit Storage(const ArmParameters& arm);

  template <bool kExtensible>
  SegmentStorage<kExtensible>& of() noexcept {
    if constexpr (kExtensible) {
      return extensible;
    } else {
      return inextensible;
    }
  }

  SegmentStorage<false> inextensible;  ///< one of the two is empty
  SegmentStorage<true> extensible;
  Eigen::VectorXd zeros, bias, inverse_pivots, rhs, solution, residual;
  Eigen::MatrixXd B, factor;
};

/// f(size) with the number of rows as a constant, or 0: sizes that the compiler knows (arms of up to
/// three segments) take half of the time.
template <class Function>
inline auto of_size(Eigen::Index rows, const Function& f) noexcept {
  switch (rows) {
    case 2:
      return f(std::integral_constant<int, 2>{});
    case 3:
      return f(std::integral_constant<int, 3>{});
    case 4:
      return f(std::integral_constant<int, 4>{});
    case 6:
      return f(std::integral_constant<int, 6>{});
    case 9:
      return f(std::integral_constant<int, 9>{});
    default:
      return f(std::integral_constant<int, 0>{});
  }
}

/// B of the shape that the last `inverse_dynamics` with Coriolis terms on this workspace left.
void inertia_of_last_shape(const ArmParameters& arm, DynamicsWorkspace& workspace,
                           Eigen::Ref<Eigen::MatrixXd> B) noexcept;

/// The inverse of the matrix of the last `solve_inertia`; overwrites the workspace's B.
void inverse_of_last_inertia(DynamicsWorkspace& workspace,
                             Eigen::Ref<Eigen::MatrixXd> out) noexcept;

}  // namespace softarm
