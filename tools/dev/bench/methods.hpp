// The routes to the model's terms that `softarm-dev bench model` compares.
#pragma once

#include <memory>
#include <vector>

#include "dev/bench/states.hpp"
#include "softarm/control/settings.hpp"
#include "softarm/model/arm.hpp"

namespace softarm {

enum class Route {
  augmented,             ///< B, C, G by the augmented rigid robot, (6) to (13)
  matrices,              ///< B, C, G directly
  recursion,             ///< B x + C(q, q') y + G in O(n) without a matrix
  controller,            ///< (17) with A^-1
  kdl_maps,              ///< m, J_m, J_m' q' of (6), (11) for KDL's chain
  kdl_matrices,          ///< KDL's B, C q', G and the projections, maps included
  kdl_inverse_dynamics,  ///< KDL's recursive Newton-Euler B q'' + C q' + G, maps included
};

struct Method {
  Route route = Route::matrices;
  bool polar = false;
  MassModel mass = MassModel::point;
  bool extensible = false;  ///< segments stretch: direct routes in (u, e)

  bool operator==(const Method&) const = default;
};

const char* name(Route route) noexcept;
const char* coordinates(const Method& method) noexcept;
const char* name(MassModel mass) noexcept;

/// Every method that this build has and that takes n segments.
std::vector<Method> bench_methods(int segments);

/// What one call of a method leaves: matrices fill B, C, G; KDL's matrices B, C q' (one column), G;
/// all others the vector G alone.
struct MethodResult {
  Eigen::MatrixXd B, C;
  Eigen::VectorXd G;
};

/// A method made ready for one arm.
class Evaluator {
 public:
  virtual ~Evaluator() = default;
  virtual void evaluate(const BenchState& state) = 0;
  /// Of the last call; not part of what is timed.
  virtual MethodResult result() const { return result_; }

 protected:
  MethodResult result_;
};

/// @param arm its mass model and whether it stretches are overruled by the method's.
std::unique_ptr<Evaluator> make_evaluator(const Method& method, ArmParameters arm,
                                          const ControllerSettings& settings);

/// The controller's settings for the benchmark: gains 1 N m/rad and 0.002 N m s/rad.
ControllerSettings bench_controller(const Method& method, int segments);

}  // namespace softarm
