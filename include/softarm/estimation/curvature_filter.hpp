// u and u' at the tick, from frames that are noisy, late, irregular, repeated or missing.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "softarm/estimation/curvature_estimator.hpp"
#include "softarm/estimation/settings.hpp"
#include "softarm/model/arm.hpp"

namespace softarm {

/// A motion that the caller expects of the arm at one instant - its reference, say. The filter then
/// smooths only the deviation from it, so that even a slow filter adds no lag to a motion that was
/// commanded.
struct KnownMotion {
  SegmentVector u_rad;                ///< 2n
  SegmentVector velocity_radps;       ///< 2n
  SegmentVector acceleration_radps2;  ///< 2n
  /// Which motion this is a sample of. When it changes, the filter carries its memory over; samples
  /// of one source must belong to one smooth function of time.
  std::uint32_t source = 0;
};

/// The filter's word about one instant.
struct FilteredMotion {
  int segments = 0;
  SegmentVector u_rad;           ///< 2n; zero where not valid
  SegmentVector velocity_radps;  ///< 2n; zero where not valid
  std::array<bool, kMaxSegments> valid{};

  /// True where every segment is valid (and there is one).
  bool all_valid() const noexcept;
};

/// Standard deviations of a filtered motion, in units of the measurement's own standard deviation.
struct FilterNoise {
  double u = 0.0;               ///< 1
  double velocity_per_s = 0.0;  ///< 1/s
};

/// Noise gain in the steady state, with a frame every `period_s`, of an estimate `horizon_s` after
/// the newest frame. Exact for a regular period. For small bandwidth * period and horizon 0 about
/// sqrt(33/16 bandwidth period) and sqrt(7/4 bandwidth^3 period).
FilterNoise filter_noise(double bandwidth_radps, double period_s, double horizon_s);

/// One filter a segment: the quadratic in time that fits the measurements of u at their own capture
/// times best, in the least-squares sense with weights exp(-bandwidth * age), evaluated at the
/// instant asked for.
///
/// For regular frames this is the critically damped third-order observer of (u, u', u'') with its
/// three poles at -bandwidth; for irregular ones it stays an exact fit, which fixed gains would
/// not. A motion that is quadratic in time passes without any lag; the lag of u' behind a jerk j is
/// about 3 j / bandwidth^2, the error of u j / bandwidth^3. A segment starts as if it had been at
/// rest where it was first seen, with the weight of one frame. Allocates nothing after
/// construction.
class CurvatureFilter {
 public:
  /// @throws std::invalid_argument where n is out of range, the bandwidth not positive and finite,
  /// or predicted_frames negative.
  CurvatureFilter(const EstimationSettings& settings, int segments);

  /// Takes one accepted frame. `known`, if any, is the expected motion at `capture_ns`.
  /// A capture that is not later than the last one is ignored. A segment that the estimate does not
  /// observe is predicted on; after more than predicted_frames such frames in a row it is no longer
  /// valid and starts from rest when seen again. So does every segment after a gap of more than
  /// reset_gap_s(), or of another known-motion size.
  void update(std::int64_t capture_ns, const CurvatureEstimate& estimate,
              const KnownMotion* known = nullptr) noexcept;

  /// u and u' at `time_ns`. `known`, if any, is the expected motion at `time_ns`, of the same
  /// source as in the last update; otherwise the last known motion is carried on as a quadratic. No
  /// further ahead of the newest frame than reset_gap_s() / 2: beyond that the values of that
  /// instant are held.
  void predict(std::int64_t time_ns, FilteredMotion& out,
               const KnownMotion* known = nullptr) const noexcept;

  /// Forgets every measurement.
  void reset() noexcept;

  /// 4 / bandwidth: a longer gap leaves nothing of the past worth keeping.
  double reset_gap_s() const noexcept { return 4.0 / bandwidth_radps_; }

  /// Capture time of the newest frame; 0 before the first.
  std::int64_t newest_ns() const noexcept { return newest_ns_; }

 private:
  // Sums over the measurements with weight w = exp(-a) at scaled age a = bandwidth * age:
  // everything the fit needs.
  struct Memory {
    std::array<double, 5> weight{};            // sum w a^m
    std::array<Eigen::Vector2d, 3> deviation;  // sum w a^m (u - known)
    std::array<Eigen::Vector2d, 3> fit;  // deviation and its scaled derivatives at the newest frame
    int unseen = 0;                      // frames in a row
    bool valid = false;
  };
  using Quadratic =
      std::array<Eigen::Vector2d, 3>;  // value and derivatives with respect to scaled time

  Quadratic known_at(int segment, double scaled_time) const noexcept;
  void adopt(const KnownMotion* known, double step) noexcept;
  static void age(Memory& memory, double step) noexcept;
  static void shift(Memory& memory, const Quadratic& change) noexcept;
  static void start(Memory& memory, const Eigen::Vector2d& deviation) noexcept;
  static void observe(Memory& memory, const Eigen::Vector2d& deviation) noexcept;
  static void solve(Memory& memory) noexcept;

  double bandwidth_radps_;
  int predicted_frames_;
  std::vector<Memory> memory_;
  std::vector<Quadratic> known_;  // at the newest frame, scaled time
  std::uint32_t source_ = 0;
  bool has_known_ = false;
  bool has_frame_ = false;
  std::int64_t newest_ns_ = 0;
};

}  // namespace softarm
