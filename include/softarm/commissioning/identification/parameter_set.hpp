// Which numbers of an arm are sought, and how they change it.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "softarm/commissioning/identification/response_model.hpp"
#include "softarm/config/experiment.hpp"

namespace softarm {

/// Which chambers share one gain.
enum class GainSharing {
  arm,      ///< one gain for all chambers
  side,     ///< chamber j of every segment alike: the paper's four sides
  segment,  ///< all chambers of a segment alike
  chamber   ///< every chamber its own
};

/// Which parameters are sought; the others stay as configured.
struct FitChoice {
  bool stiffness = true;     ///< false: as configured, where the record tells ratios only
  bool damping = true;       ///< false: as configured
  bool inertia = true;       ///< false: none, for motions so slow that it does not count
  bool per_segment = false;  ///< k and beta of every segment, instead of one for all as in VII-B1
  GainSharing gains = GainSharing::chamber;
  bool gains_free = true;  ///< false: as configured (always with actuation by torque)
  /// Into which direction a chamber pushes, too. Nothing is configured of its push then: the
  /// configured gain is a scale.
  bool directions = false;
  bool lag = true;
  bool delay = true;
  bool rest = false;
  bool cubic = false;
};

/// One unknown. Everything is sought in units of its scale.
struct Parameter {
  std::string name;
  std::string unit;
  double scale = 1.0;
  std::function<double(const ArmHypothesis&)> get;           ///< in its unit
  std::function<void(ArmHypothesis&, double value)> set;     ///< in its unit
  double lowest = -std::numeric_limits<double>::infinity();  ///< in its unit
  double difference = 1e-5;                                  ///< over its scale: for sensitivities
};

/// The unknowns of one identification, and how they change an arm.
class ParameterSet {
 public:
  /// Scales are taken from `start`, which also lends every number that is not sought.
  ParameterSet(const ArmHypothesis& start, ActuationKind kind, const FitChoice& choice);

  Eigen::Index size() const { return static_cast<Eigen::Index>(parameters_.size()); }
  const Parameter& operator[](Eigen::Index i) const {
    return parameters_[static_cast<std::size_t>(i)];
  }

  Eigen::VectorXd of(const ArmHypothesis& arm) const;  ///< over their scales
  Eigen::VectorXd configured() const { return of(start_); }
  Eigen::VectorXd lowest() const;  ///< over their scales
  ArmHypothesis arm(const Eigen::VectorXd& x) const;
  /// Whether the arm is one: springs and damping that are not negative, no negative lag.
  bool possible(const Eigen::VectorXd& x) const;
  /// Whether (16) is linear in it.
  bool linear(Eigen::Index i) const;

 private:
  void add_impedance(const FitChoice& choice);
  void add_gains(const FitChoice& choice);
  void add_times(const FitChoice& choice);

  ArmHypothesis start_;
  std::vector<Parameter> parameters_;
};

}  // namespace softarm
