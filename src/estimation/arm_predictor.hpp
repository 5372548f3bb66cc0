// The model observer's mean between two instants: commands through the valves' lag, (16) by a
// linearly implicit step.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "softarm/model/dynamics.hpp"
#include "softarm/model/model_correction.hpp"

namespace softarm {

/// tau_A behind the valves at one instant.
struct LaggedTorque {
  std::int64_t time_ns = 0;
  SegmentVector tau_nm;      ///< 2n
  SegmentVector command_nm;  ///< 2n, in force at time_ns
  std::int64_t next = 0;     ///< number of the next command to come into force
};

/// The newest commands and when each comes into force; the first-order lag between them and the
/// torque, exactly.
class TorqueHistory {
 public:
  /// Keeps `commands` of them, of `size` numbers each.
  TorqueHistory(int size, int commands, double lag_s);

  int size() const noexcept { return static_cast<int>(ring_.size()); }

  /// tau_A (2n) in force from `from_ns` on, not earlier than the last one.
  void command(std::int64_t from_ns, ConstVectorRef tau_nm) noexcept;
  /// As if every command so far had been zero.
  void clear() noexcept;

  /// The state at `time_ns` of valves that have followed the command in force for long.
  void settle(std::int64_t time_ns, LaggedTorque& out) const noexcept;
  /// From state.time_ns to `time_ns`, not before it; `mean_nm`: mean torque on the way.
  void advance(std::int64_t time_ns, LaggedTorque& state, SegmentVector& mean_nm) const noexcept;

 private:
  struct Command {
    std::int64_t from_ns = 0;
    SegmentVector tau_nm;
  };
  const Command& at(std::int64_t number) const noexcept {
    return ring_[static_cast<std::size_t>(number) % ring_.size()];
  }

  double lag_s_;
  std::int64_t count_ = 0;
  std::vector<Command> ring_;
  SegmentVector zero_;
};

/// u and u' of the corrected (16) from one instant to the next. Linearly implicit (two-stage
/// Rosenbrock method, L-stable): point masses leave modes of 1e6 1/s that no explicit step can
/// follow. Allocates nothing after construction.
class ArmPredictor {
 public:
  explicit ArmPredictor(const ArmParameters& arm);

  /// Of an arm whose segments stretch: they are now so long (n, m), and their stretching takes so much
  /// of the force (2n, N m) from the next linearize() on.
  void set_stretch(ConstVectorRef length_m, const SegmentVector& coupling_nm) noexcept;

  /// B, and the horizontal load, at u: to be renewed as the arm moves, once a frame.
  void linearize(ConstVectorRef u, const ModelCorrection& correction) noexcept;
  /// One step under a constant torque. False, with u and velocity unchanged, where B + h D + ...
  /// cannot be factored or the result is not finite.
  bool step(double step_s, ConstVectorRef tau_nm, const ModelCorrection& correction,
            SegmentVector& u, SegmentVector& velocity) noexcept;

  const Eigen::MatrixXd& inertia() const noexcept { return inertia_; }
  const SegmentVector& stiffness() const noexcept { return stiffness_; }
  const SegmentVector& damping() const noexcept { return damping_; }
  DynamicsWorkspace& workspace() noexcept { return workspace_; }
  const HorizontalLoad& horizontal() const noexcept { return horizontal_; }

 private:
  void force(ConstVectorRef tau_nm, const ModelCorrection& correction, const SegmentVector& u,
             const SegmentVector& velocity, SegmentVector& out) noexcept;

  ArmParameters arm_;
  DynamicsWorkspace workspace_;
  HorizontalLoad horizontal_;
  Eigen::MatrixXd inertia_, implicit_;
  Eigen::LLT<Eigen::MatrixXd> factor_;
  double factored_step_s_ = 0.0;
  SegmentVector stiffness_, damping_, load_, along_x_, along_y_, coupling_;
  SegmentVector force_, product_, k1u_, k1v_, u2_, v2_, rate_, k2v_;
};

}  // namespace softarm
