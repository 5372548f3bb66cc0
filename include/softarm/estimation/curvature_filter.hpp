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
  SegmentVector u_rad;                ///< 2n; [u_x, u_y, e] a segment where segments stretch
  SegmentVector velocity_radps;       ///< the same
  SegmentVector acceleration_radps2;  ///< the same
  /// Which motion this is a sample of. When it changes, the filter carries its memory over; samples
  /// of one source must belong to one smooth function of time.
  std::uint32_t source = 0;
};

/// The filter's word about one instant.
struct FilteredMotion {
  int segments = 0;
  /// 2n; where segments stretch [u_x, u_y, e] of each, e in m. Zero where not valid.
  SegmentVector u_rad;
  SegmentVector velocity_radps;  ///< the same, rad/s and m/s
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
///
/// Where segments stretch, e is the measured length minus the length at rest, fitted in the same
/// way; a frame in which a length says nothing (theta = 2 pi) leaves out the segment.
class CurvatureFilter {
 public:
  /// @throws std::invalid_argument where n is out of range, the bandwidth not positive and finite,
  /// or predicted_frames negative.
  CurvatureFilter(const EstimationSettings& settings, int segments);
  /// Of an arm whose segments may stretch.
  CurvatureFilter(const EstimationSettings& settings, const ArmParameters& arm);

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
  // everything the fit of one quantity of a segment (u, or e) needs.
  template <int D>
  struct Fit {
    using Value = Eigen::Matrix<double, D, 1>;
    std::array<Value, 3> deviation;  // sum w a^m (measured - known)
    std::array<Value, 3> fit;        // deviation and its scaled derivatives at the newest frame
  };
  template <int D>
  using Quadratic =
      std::array<Eigen::Matrix<double, D, 1>, 3>;  // value, derivatives in scaled time
  struct Memory {
    std::array<double, 5> weight{};  // sum w a^m
    Fit<2> u;
    int unseen = 0;  // frames in a row
    bool valid = false;
  };

  template <int D>
  static Quadratic<D> later(const Quadratic<D>& known, double scaled_time) noexcept;
  template <int D>
  Quadratic<D> known_part(const KnownMotion& known, int at) const noexcept;
  template <int D>
  static void adopt(const std::array<double, 5>& weight, double step, bool changed,
                    const Quadratic<D>& now, Quadratic<D>& known, Fit<D>& fit) noexcept;
  void adopt(const KnownMotion* known, double step) noexcept;
  template <int D>
  static void shift(const std::array<double, 5>& weight, const Quadratic<D>& change,
                    Fit<D>& fit) noexcept;
  static void age(Memory& memory, Fit<1>* stretch, double step) noexcept;
  template <int D>
  static void start(const Eigen::Matrix<double, D, 1>& deviation, Fit<D>& fit) noexcept;
  static void start(Memory& memory, const Eigen::Vector2d& deviation) noexcept;
  template <int D>
  static void solve(const std::array<double, 5>& weight, Fit<D>& fit) noexcept;
  template <int D>
  void evaluate(const Fit<D>& fit, const Quadratic<D>& known, double ahead, int at,
                const KnownMotion* same_source, FilteredMotion& out) const noexcept;
  void observe(std::size_t segment, const CurvatureEstimate& estimate) noexcept;
  Eigen::Index width() const noexcept { return stretch_.empty() ? 2 : 3; }

  double bandwidth_radps_;
  int predicted_frames_;
  std::vector<Memory> memory_;
  std::vector<Quadratic<2>> known_;  // at the newest frame, scaled time
  // Where segments stretch; otherwise empty.
  std::vector<Fit<1>> stretch_;
  std::vector<Quadratic<1>> known_stretch_;
  std::vector<double> length_m_;  // at rest
  std::uint32_t source_ = 0;
  bool has_known_ = false;
  bool has_frame_ = false;
  std::int64_t newest_ns_ = 0;
};

}  // namespace softarm
