// What acts on an arm beside gravity and valves: loads on the segments' ends, and a base that
// moves.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace softarm {

struct PlantSettings;

/// How an external load changes in time.
enum class LoadShape {
  constant,  ///< switched on and off
  half_sine  ///< a blow: half a sine wave over the duration
};

/// A force and a moment on the end of a segment, in world axes.
struct ExternalLoad {
  int segment = 0;  ///< 1..n from the base; 0: the tip
  Eigen::Vector3d force_n = Eigen::Vector3d::Zero();
  Eigen::Vector3d moment_nm = Eigen::Vector3d::Zero();
  LoadShape shape = LoadShape::constant;
  double start_s = 0.0;
  double duration_s = 0.0;
};

/// A base that is carried to and fro, without turning: base_position + amplitude sin(2 pi frequency
/// t + phase).
struct BaseMotion {
  Eigen::Vector3d amplitude_m = Eigen::Vector3d::Zero();  ///< world axes
  double frequency_hz = 0.0;
  double phase_rad = 0.0;
};

/// External loads and the motion of the base, as functions of time. Loads begin and end at known
/// instants; the integrator must stop there, so that it can neither step over a short blow nor see
/// across a step: `until` returns when, `enter` sets what holds from an instant on.
class ExternalLoads {
 public:
  /// A load with its time window, s.
  struct Load {
    int segment;  ///< from 0
    Eigen::Vector3d force_n, moment_nm;
    LoadShape shape;
    double start_s, end_s;
    bool on;
  };

  /// @throw std::invalid_argument for loads or a motion that cannot be.
  explicit ExternalLoads(const PlantSettings& settings);

  bool any_load_on() const { return any_on_; }
  bool base_moves() const { return base_moves_; }
  const std::vector<Load>& loads() const { return loads_; }
  /// The factor on force and moment at t_s.
  static double scale(const Load& load, double t_s);

  /// The first instant after t_s at which a load begins or ends; infinity if none does.
  double until(double t_s) const;
  /// From t_s until the next of these instants. Returns whether a load was switched on or off.
  bool enter(double t_s);

  Eigen::Vector3d base_displacement_m(double t_s) const;
  Eigen::Vector3d base_acceleration_mps2(double t_s) const;

 private:
  std::vector<Load> loads_;
  bool any_on_ = false;
  BaseMotion motion_;
  bool base_moves_;
};

}  // namespace softarm
