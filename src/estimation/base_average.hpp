// The base's orientation, averaged: a base that does not move needs not be measured every frame.
#pragma once

#include <Eigen/Geometry>

namespace softarm {

/// Mean over the last two seconds of a measured orientation. A base that is found turned in three
/// frames in a row, by more than noise explains, is taken as it is then.
class BaseAverage {
 public:
  explicit BaseAverage(double orientation_noise_rad) : noise_rad_(orientation_noise_rad) {}

  void reset() noexcept { weight_ = 0.0; }

  /// A frame `since_s` after the last one.
  const Eigen::Quaterniond& add(const Eigen::Quaterniond& measured, double since_s) noexcept {
    constexpr double kMemory_s = 2.0, kTurned = 8.0;
    constexpr int kInRow = 3;
    const bool turned =
        weight_ > 0.0 && mean_.angularDistance(measured) > kTurned * noise_rad_ + 1e-6;
    turned_in_row_ = turned ? turned_in_row_ + 1 : 0;
    if (turned_in_row_ >= kInRow) weight_ = 0.0;
    if (weight_ <= 0.0) {
      mean_ = measured.normalized();
      weight_ = 1.0;
      turned_in_row_ = 0;
      return mean_;
    }
    weight_ += 1.0;
    const double share = std::max(1.0 / weight_, std::min(1.0, since_s / kMemory_s));
    const double side = mean_.dot(measured) < 0.0 ? -1.0 : 1.0;
    mean_.coeffs() += share * (side * measured.normalized().coeffs() - mean_.coeffs());
    mean_.normalize();
    return mean_;
  }

 private:
  double noise_rad_;
  double weight_ = 0.0;
  int turned_in_row_ = 0;
  Eigen::Quaterniond mean_ = Eigen::Quaterniond::Identity();
};

}  // namespace softarm
