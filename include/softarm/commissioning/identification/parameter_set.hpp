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
  bool venting = false;  ///< another lag for venting than for filling, the same in all chambers
  bool chamber_lags = false;    ///< filling and venting of every chamber
  bool one_saturation = false;  ///< p counts as p (1 + q p), the same q in all chambers
  bool saturation = false;      ///< the same with a q of every chamber
  bool hysteresis = false;      ///< slip springs, at radii taken from the motion
  bool remanence = false;  ///< the rest creeps after use: share, time, and where it is at first
  bool second_remanence = false;  ///< another one that is faster, from rest at first
  bool stiffening = false;        ///< k (1 + s sum p)
  bool by_length = false;         ///< k (l / L)^q, l by an elongation that is known
  /// Chambers act on the segments nearer the base, too, which their tendons or tubes pass.
  bool cross = false;
  bool mass = false;    ///< one factor on all masses, against the configured ones
  bool length = false;  ///< one factor on all lengths
  bool load = false;    ///< a point mass at the tip
  /// How the segments stretch, instead of how they bend: only the elongation is identified.
  bool elongation = false;
  bool set = false;      ///< of the elongation: part of the largest stretch so far stays
  bool by_bend = false;  ///< of the elongation: a bent segment has another length
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
  /// Where the prior has it, in its unit; NaN: as configured.
  double expected = std::numeric_limits<double>::quiet_NaN();
  double highest = std::numeric_limits<double>::infinity();  ///< in its unit
  bool linear = false;                                       ///< whether (16) is linear in it
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
  Eigen::VectorXd expected() const;                          ///< centre of the prior
  Eigen::VectorXd lowest() const;                            ///< lower limits
  Eigen::VectorXd highest() const;                           ///< upper limits
  bool of_elongation() const { return elongation_; }         ///< of lengths, not of the bend
  /// The arm with the unknowns x.
  ArmHypothesis arm(const Eigen::VectorXd& x) const;
  /// Whether the arm is physically possible: no negative stiffness, damping or lag.
  bool possible(const Eigen::VectorXd& x) const;
  /// Cubic stiffness may soften the springs only so far that they still are stiff at this bend: what
  /// lets go there has no bounded response.
  void stay_stiff_to(double bend_rad);
  /// Whether (16) is linear in this unknown.
  bool linear(Eigen::Index i) const;

 private:
  void add_impedance(const FitChoice& choice);
  void add_gains(const FitChoice& choice);
  void add_times(const FitChoice& choice);
  template <class Read, class Write>
  void add_lags(const char* filling, const char* venting, bool each, Read read, Write write);
  template <class Of>
  void add_saturation(const char* name, bool each, Of of);
  void add_memory(const FitChoice& choice);
  void add_masses(const FitChoice& choice);
  void add_elongation(const FitChoice& choice);

  ArmHypothesis start_;
  bool elongation_ = false;
  std::vector<Parameter> parameters_;
};

}  // namespace softarm
