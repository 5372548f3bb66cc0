// Does the arm do what it is told? Measured pressures against the commanded ones, curvature against
// pressure.
#pragma once

#include <cstdint>

#include "softarm/actuation/pressure_allocator.hpp"
#include "softarm/model/arm.hpp"
#include "softarm/model/dynamics.hpp"
#include "softarm/runtime/settings.hpp"

namespace softarm {

/// A valve, however slow, gives a pressure between the smallest and the largest of its latest
/// commands. A measured pressure outside that range is one that does not follow: a burst, a leak, a
/// blocked tube, a valve that is not ours. The range spans at least the settling time, at most
/// twice that. No allocation, no clock.
class PressureWatch {
 public:
  /// Measurements in a row that must stray: one may be a disturbance.
  static constexpr int kInRow = 3;

  PressureWatch(const SafetySettings& settings, int chambers) noexcept;

  /// What is commanded from `now_ns` on (bar, one a chamber).
  void command(std::int64_t now_ns, const PressureVector& commanded_bar) noexcept;

  /// The next measurement (bar, one a chamber). Believed whatever it says until the commands of a
  /// whole settling time are known.
  void measure(const PressureVector& measured_bar) noexcept;

  /// Forgets everything: for a gap in which valves may have vented by themselves.
  void reset() noexcept;

  /// The latest measurements were more than the tolerance outside of the range.
  bool strays() const noexcept { return in_row_ >= kInRow; }

 private:
  struct Range {
    PressureVector low, high;
  };

  double tolerance_bar_;
  std::int64_t settling_ns_;
  Range now_, before_;  // of the settling time that runs, and of the one before it
  std::int64_t since_ns_ = 0;
  int known_ = 0;  // of the two
  int in_row_ = 0;
};

/// At rest a segment balances: K u + G(u) = A(u) tau_A. A residual that stays means the model or
/// the arm is wrong: an obstacle, a burst chamber, a body that slipped. It cannot be told from a
/// wrong model or from inertia and damping of a fast motion, so the limit must exceed both. O(n),
/// no allocation, no clock.
class CurvatureWatch {
 public:
  /// @throws std::invalid_argument as DynamicsWorkspace
  CurvatureWatch(const SafetySettings& settings, const ArmParameters& arm);

  /// u: 2n, rad; tau_actuation: 2n, N m, of the pressures in force. What is not to be judged is
  /// left out: a gap longer than the settling time begins anew.
  void judge(std::int64_t now_ns, ConstVectorRef u_rad, ConstVectorRef tau_actuation_nm) noexcept;

  bool used() const noexcept { return limit_nm_ > 0.0; }
  /// Some segment's residual was above the limit throughout the settling time.
  bool strays() const noexcept { return strays_; }
  void reset() noexcept { strays_ = beyond_ = false; }

 private:
  double largest_residual_nm(ConstVectorRef u_rad, ConstVectorRef tau_actuation_nm) noexcept;

  double limit_nm_;
  std::int64_t settling_ns_;
  ArmParameters arm_;
  DynamicsWorkspace workspace_;
  SegmentVector force_, actuated_;
  std::int64_t since_ns_ = 0;
  bool beyond_ = false;
  bool strays_ = false;
};

}  // namespace softarm
