// The rival of `softarm-dev bench plant`: CVODE as most would set it up.
#pragma once

#include <Eigen/Core>
#include <memory>

#include "softarm/simulation/second_order_system.hpp"

namespace softarm {

/// CVODE BDF on y' = (v, x''(t, x, v)) with a dense Jacobian by CVODE's own differences.
class PlainCvode {
 public:
  /// @param smooth may step past the end of a call.
  PlainCvode(SecondOrderSystem& system, double relative, double absolute, bool smooth);
  ~PlainCvode();

  void reset(double t_s, const Eigen::VectorXd& x, const Eigen::VectorXd& v);
  void input_jumped();           ///< starts again
  void advance(double t_end_s);  ///< @throw std::runtime_error
  Eigen::VectorXd x() const;

 private:
  struct Handles;
  std::unique_ptr<Handles> handles_;
  bool smooth_;
};

}  // namespace softarm
