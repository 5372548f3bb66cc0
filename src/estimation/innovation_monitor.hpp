// What the innovations say about the disturbance: how fast it moves, and whether it has jumped.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>

#include "softarm/model/arm.hpp"

namespace softarm {

/// Tunes the disturbance's random walk from the estimated disturbance itself, and sees a jump in
/// innovations that are too large for 25 ms. All disturbances relative to a torque scale a
/// coordinate.
class InnovationMonitor {
 public:
  InnovationMonitor(const SegmentVector& torque_scale_nm, double least_drift, double largest_drift)
      : per_nm_(torque_scale_nm.cwiseInverse()),
        least_(least_drift * least_drift),
        largest_(largest_drift * largest_drift) {
    reset();
  }

  void reset() noexcept {
    nis_mean_ = 1.0;
    jump_left_s_ = 0.0;
    drift_ = least_;
    count_ = 0;
    since_snapshot_s_ = 0.0;
  }

  /// After a frame `since_s` after the last one. Returns whether a jump has just been got over.
  bool add(double nis, const SegmentVector& disturbance_nm, double since_s) noexcept {
    constexpr double kMemory_s = 0.025, kJump = 2.5, kJump_s = 0.1;
    nis_mean_ += -std::expm1(-since_s / kMemory_s) * (std::min(nis, 50.0) - nis_mean_);
    const bool jumped = jump_left_s_ > 0.0;
    jump_left_s_ = nis_mean_ > kJump ? kJump_s : std::max(0.0, jump_left_s_ - since_s);
    tune(disturbance_nm, since_s);
    return jumped && jump_left_s_ <= 0.0;
  }

  bool jump() const noexcept { return jump_left_s_ > 0.0; }
  double mean() const noexcept { return nis_mean_; }
  /// Variance a second of the disturbance's walk, relative to the square of the torque scale.
  double drift_per_s() const noexcept {
    constexpr double kJumpDrift = 0.07;
    return jump() ? std::max(drift_, kJumpDrift * kJumpDrift) : drift_;
  }

 private:
  void tune(const SegmentVector& disturbance_nm, double since_s) noexcept {
    constexpr double kInterval_s = 0.025, kShare = 0.3, kRise_s = 0.1, kFall_s = 1.0;
    since_snapshot_s_ += since_s;
    if (count_ >= kSnapshots) {
      const SegmentVector& old = snapshot_[static_cast<std::size_t>(count_ % kSnapshots)];
      double moved = 0.0;
      for (Eigen::Index i = 0; i < old.size(); ++i) {
        const double part = per_nm_[i] * (disturbance_nm[i] - old[i]);
        moved += part * part;
      }
      const double over_s = kInterval_s * kSnapshots;
      const double seen = kShare * moved / (static_cast<double>(old.size()) * over_s);
      const double wanted = std::clamp(seen, least_, largest_);
      drift_ += -std::expm1(-since_s / (wanted > drift_ ? kRise_s : kFall_s)) * (wanted - drift_);
    }
    if (since_snapshot_s_ >= kInterval_s || count_ == 0) {
      since_snapshot_s_ = 0.0;
      snapshot_[static_cast<std::size_t>(count_ % kSnapshots)] = disturbance_nm;
      // Only whether the ring is full, and where its oldest entry stands, matters.
      count_ = count_ + 1 < 2 * kSnapshots ? count_ + 1 : kSnapshots;
    }
  }

  static constexpr int kSnapshots = 8;
  SegmentVector per_nm_;
  double least_, largest_;
  double nis_mean_ = 1.0, jump_left_s_ = 0.0, drift_ = 0.0, since_snapshot_s_ = 0.0;
  int count_ = 0;
  std::array<SegmentVector, kSnapshots> snapshot_;
};

}  // namespace softarm
