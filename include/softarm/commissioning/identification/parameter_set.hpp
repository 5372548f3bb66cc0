// The parameters of an arm that are identified, and how they change it.
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
  side,     ///< one per side: chamber j of every segment (the paper's four sides)
  segment,  ///< one per segment
  chamber   ///< one per chamber
};

/// Which parameters are identified.
struct FitChoice {
  bool stiffness = true;     ///< false: as configured, if the record determines only ratios
  bool damping = true;       ///< false: as configured
  bool inertia = true;       ///< false: none, for quasi-static motion
  bool per_segment = false;  ///< k and beta per segment, instead of one for all as in VII-B1
  GainSharing gains = GainSharing::chamber;
  bool gains_free = true;  ///< false: as configured (always with actuation by torque)
  /// Also identify the direction in which a chamber acts. There is no prior for its input map then:
  /// the configured gain is only a scale.
  bool directions = false;
  bool lag = true;
  bool delay = true;
  bool rest = false;
  bool cubic = false;
};

/// One unknown. The search uses units of its scale.
struct Parameter {
  std::string name;
  std::string unit;
  double scale = 1.0;
  std::function<double(const ArmHypothesis&)> get;           ///< in its unit
  std::function<void(ArmHypothesis&, double value)> set;     ///< in its unit
  double lowest = -std::numeric_limits<double>::infinity();  ///< in its unit
  double difference = 1e-5;  ///< step for sensitivities, in its scale
};

/// The unknowns of a choice. Vectors x have one number per unknown, in its scale.
class ParameterSet {
 public:
  /// Scales are taken from `start`, which also gives every number that is not identified.
  ParameterSet(const ArmHypothesis& start, ActuationKind kind, const FitChoice& choice);

  /// Number of unknowns.
  Eigen::Index size() const { return static_cast<Eigen::Index>(parameters_.size()); }
  /// One unknown, 0 <= i < size().
  const Parameter& operator[](Eigen::Index i) const {
    return parameters_[static_cast<std::size_t>(i)];
  }

  Eigen::VectorXd of(const ArmHypothesis& arm) const;        ///< the unknowns of an arm
  Eigen::VectorXd configured() const { return of(start_); }  ///< those of `start`, as configured
  Eigen::VectorXd lowest() const;                            ///< lower limits
  /// The arm with the unknowns x.
  ArmHypothesis arm(const Eigen::VectorXd& x) const;
  /// Whether the arm is physically possible: no negative stiffness, damping or lag.
  bool possible(const Eigen::VectorXd& x) const;
  /// Whether (16) is linear in this unknown.
  bool linear(Eigen::Index i) const;

 private:
  void add_impedance(const FitChoice& choice);
  void add_gains(const FitChoice& choice);
  void add_times(const FitChoice& choice);

  ArmHypothesis start_;
  std::vector<Parameter> parameters_;
};

}  // namespace softarm
