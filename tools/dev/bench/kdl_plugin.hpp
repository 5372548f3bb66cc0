// What crosses between the benchmark and the module that holds Orocos KDL: plain numbers, so that
// KDL and Eigen are compiled there for KDL's own instruction set and alignment, whatever ours are.
#pragma once

#include <cstddef>

namespace softarm {

/// KDL on the ten-joint chain of Table I, in the paper's polar coordinates q, point masses. Arrays
/// have 2n numbers; B is 2n x 2n, column by column.
struct KdlPlugin {
  /// @param gravity_mps2 in S_0
  void* (*make)(int segments, const double* length_m, const double* mass_kg,
                const double* gravity_mps2);
  void (*destroy)(void* chain);
  /// (6), (11) alone: xi, xi' and J_m' q' from q and q', and J_m.
  void (*maps)(void* chain, const double* q, const double* velocity);
  /// (13): maps, ChainDynParam's JntToMass, JntToCoriolis and JntToGravity, and the projections.
  void (*matrices)(void* chain, const double* q, const double* velocity, double* B,
                   double* C_velocity, double* G);
  /// B q'' + C q' + G: maps, ChainIdSolver_RNE's CartToJnt, and J_m' of what it gives.
  void (*inverse_dynamics)(void* chain, const double* q, const double* velocity,
                           const double* acceleration, double* out);
};

/// The name under which the module offers `const KdlPlugin*`.
inline constexpr char kKdlPluginSymbol[] = "softarm_kdl_plugin";

}  // namespace softarm
