// Orocos KDL beside our own routes, where this build found it.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>

#include "dev/bench/kdl_plugin.hpp"
#include "softarm/model/arm.hpp"

namespace softarm {

/// KDL's rigid-body algorithms on the chain of Table I (point masses), taken back to q = [phi_1,
/// theta_1, ...] by m(q) of (6). Not for theta below 0.05.
class KdlChain {
 public:
  /// Whether the module was built and loads.
  static bool available();
  /// @throws std::runtime_error where it does not.
  explicit KdlChain(const ArmParameters& arm);

  /// m(q), J_m and J_m' q' alone.
  void maps(const Eigen::VectorXd& q, const Eigen::VectorXd& velocity) const;
  /// B, C q' and G, 2n x 2n, 2n, 2n.
  void matrices(const Eigen::VectorXd& q, const Eigen::VectorXd& velocity, Eigen::MatrixXd& B,
                Eigen::VectorXd& C_velocity, Eigen::VectorXd& G) const;
  /// B q'' + C q' + G by recursive Newton-Euler.
  void inverse_dynamics(const Eigen::VectorXd& q, const Eigen::VectorXd& velocity,
                        const Eigen::VectorXd& acceleration, Eigen::VectorXd& out) const;

 private:
  const KdlPlugin* plugin_;
  std::unique_ptr<void, void (*)(void*)> chain_;
};

}  // namespace softarm
