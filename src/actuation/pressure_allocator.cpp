#include "softarm/actuation/pressure_allocator.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "softarm/actuation/input_map.hpp"

namespace softarm {
namespace {

/// Relative to the torque of all chambers at full pressure: below it a direction counts as
/// unreachable.
constexpr double kWeakest = 1e-6;

[[noreturn]] void refuse(int segment, const std::string& what) {
  throw std::invalid_argument(fmt::format("chambers of segment {}: {}", segment + 1, what));
}

void check_limits(const ActuationSettings& settings) {
  const double lo = settings.min_pressure_bar, hi = settings.max_pressure_bar;
  if (!std::isfinite(lo) || !std::isfinite(hi) || !std::isfinite(settings.bias_pressure_bar) ||
      lo > hi) {
    throw std::invalid_argument(fmt::format(
        "pressure limits: expected finite min <= max and a finite bias (bar), got min {}, max {}, "
        "bias {}",
        lo, hi, settings.bias_pressure_bar));
  }
  if (settings.plane_rad && !std::isfinite(*settings.plane_rad)) {
    throw std::invalid_argument("plane: expected a finite angle (rad)");
  }
  if (settings.segments.empty() || settings.segments.size() > kMaxSegments) {
    throw std::invalid_argument(
        fmt::format("chambers: expected those of 1 to {} segments, got {} segments", kMaxSegments,
                    settings.segments.size()));
  }
}

void check_chambers(int segment, const std::vector<Chamber>& chambers, bool planar) {
  const std::size_t least = planar ? 2 : 3;
  if (chambers.size() < least || chambers.size() > kMaxChambersPerSegment) {
    refuse(segment,
           fmt::format("expected {} to {} chambers{}, got {}", least, kMaxChambersPerSegment,
                       planar ? " (planar arm)" : "", chambers.size()));
  }
  for (const Chamber& chamber : chambers) {
    if (!std::isfinite(chamber.angle_rad) || !std::isfinite(chamber.gain_nm_per_bar) ||
        chamber.gain_nm_per_bar <= 0.0) {
      refuse(segment,
             fmt::format("expected a finite angle (rad) and a positive gain (N m per bar), got "
                         "angle {} and gain {}; a chamber that pulls is one at angle + pi",
                         chamber.angle_rad, chamber.gain_nm_per_bar));
    }
  }
}

void check_moments(int segment, const std::vector<Chamber>& moments,
                   const ActuationSettings& settings) {
  if (moments.size() != 2 || !(settings.max_pressure_bar > 0.0) ||
      settings.min_pressure_bar != -settings.max_pressure_bar || settings.plane_rad) {
    refuse(segment,
           fmt::format("expected of actuation by torque two moments, limits -max and max "
                       "(N m) and no plane, got {} moments and limits {} and {}",
                       moments.size(), settings.min_pressure_bar, settings.max_pressure_bar));
  }
}

template <int D>
void check_span(int segment, const ChamberMap<D>& map, const ActuationSettings& settings) {
  const double weakest = map.weakest_torque_nm(), strongest = map.strongest_torque_nm();
  const bool zero_range = settings.min_pressure_bar == settings.max_pressure_bar;
  double together = 0.0;
  for (const Chamber& chamber : settings.segments[static_cast<std::size_t>(segment)]) {
    together += chamber.gain_nm_per_bar *
                std::max(std::abs(settings.min_pressure_bar), std::abs(settings.max_pressure_bar));
  }
  // A box without size reaches one torque; it is of use only where that is zero.
  if (zero_range ? strongest <= 1e-9 * together : weakest > kWeakest * together) {
    return;
  }
  if (settings.min_pressure_bar > 0.0) {
    refuse(segment,
           fmt::format("expected torques in every direction within {} to {} bar, got {:.3g} N m in "
                       "the weakest direction against {:.3g} in the strongest; balance the angles "
                       "and gains, or lower the minimum pressure",
                       settings.min_pressure_bar, settings.max_pressure_bar, weakest, strongest));
  }
  refuse(
      segment,
      fmt::format("expected torques in {}, got {:.3g} N m in the weakest direction against "
                  "{:.3g} in the strongest: all chambers pull to one side; no gap between "
                  "neighbouring angles may reach pi",
                  D == 1 ? "both directions of the plane" : "every direction", weakest, strongest));
}

}  // namespace

PressureAllocator::PressureAllocator(const ActuationSettings& settings, bool extensible)
    : segments_(static_cast<int>(settings.segments.size())),
      planar_(settings.plane_rad.has_value()) {
  check_limits(settings);
  if (extensible && (planar_ || settings.kind == ActuationKind::torque)) {
    throw std::invalid_argument(
        "chambers: expected of segments that stretch pressures and no plane, got a planar arm or "
        "actuation by torque");
  }
  // f along (cos phi, sin phi) is tau_A along (-sin phi, cos phi): the columns of A_chamber^-1.
  if (planar_) plane_ = {-std::sin(*settings.plane_rad), std::cos(*settings.plane_rad)};
  for (int i = 0; i < segments_; ++i) {
    const std::vector<Chamber>& chambers = settings.segments[i];
    if (settings.kind == ActuationKind::torque) {
      check_moments(i, chambers, settings);
      max_torque_nm_ = settings.max_pressure_bar;
      chambers_ += 2;
      continue;
    }
    check_chambers(i, chambers, planar_);
    std::vector<std::array<double, 2>> spatial;
    std::vector<std::array<double, 1>> planar;
    const Eigen::Matrix2Xd map = input_map(settings.kind, chambers);
    for (const auto& force : map.colwise()) {
      const std::array<double, 2> column{-force.y(), force.x()};  // A_chamber^-1
      spatial.push_back(column);
      planar.push_back({plane_[0] * column[0] + plane_[1] * column[1]});
    }
    Segment segment;
    segment.first = chambers_;
    const double lo = settings.min_pressure_bar, hi = settings.max_pressure_bar;
    if (planar_) {
      segment.planar = ChamberMap<1>(planar, lo, hi, settings.bias_pressure_bar);
      check_span(i, segment.planar, settings);
    } else {
      segment.spatial = ChamberMap<2>(spatial, lo, hi, settings.bias_pressure_bar);
      check_span(i, segment.spatial, settings);
    }
    if (extensible) {
      const Eigen::RowVectorXd areas = axial_input_map(settings.kind, chambers);
      axial_.emplace_back(spatial, std::vector<double>(areas.begin(), areas.end()), lo, hi,
                          settings.bias_pressure_bar);
    }
    segment_.push_back(segment);
    chambers_ += static_cast<int>(chambers.size());
  }
}

int PressureAllocator::first_chamber(int segment) const noexcept {
  return max_torque_nm_ > 0.0 ? 2 * segment : segment_[segment].first;
}

int PressureAllocator::chambers_of(int segment) const noexcept {
  if (max_torque_nm_ > 0.0) return 2;
  return planar_ ? segment_[segment].planar.size() : segment_[segment].spatial.size();
}

void PressureAllocator::allocate(ConstVectorRef tau_actuation_nm, Allocation& out) const noexcept {
  out.pressures_bar.resize(chambers_);
  out.scale.resize(segments_);
  out.saturated = false;
  if (max_torque_nm_ > 0.0) {
    for (int i = 0; i < segments_; ++i) {
      const Eigen::Vector2d tau = tau_actuation_nm.segment<2>(2 * i);
      const double largest = tau.cwiseAbs().maxCoeff();
      const bool finite = tau.allFinite();
      out.scale[i] = !finite ? 0.0 : largest > max_torque_nm_ ? max_torque_nm_ / largest : 1.0;
      out.pressures_bar.segment<2>(2 * i) =
          finite ? Eigen::Vector2d(out.scale[i] * tau) : Eigen::Vector2d(Eigen::Vector2d::Zero());
      out.saturated |= out.scale[i] < 1.0;
    }
    return;
  }
  std::array<double, kMaxChambersPerSegment> pressures{};
  const bool extensible = !axial_.empty();
  for (int i = 0; i < segments_; ++i) {
    const Segment& segment = segment_[i];
    if (extensible) {
      const Eigen::Vector3d tau = tau_actuation_nm.segment<3>(3 * i);
      out.scale[i] = axial_[i].allocate({tau.x(), tau.y()}, tau.z(), pressures);
      out.saturated |= out.scale[i] < 1.0;
      std::copy_n(pressures.begin(), chambers_of(i), out.pressures_bar.data() + segment.first);
      continue;
    }
    const double x = tau_actuation_nm[2 * i], y = tau_actuation_nm[2 * i + 1];
    out.scale[i] = planar_ ? segment.planar.allocate({plane_[0] * x + plane_[1] * y}, pressures)
                           : segment.spatial.allocate({x, y}, pressures);
    out.saturated |= out.scale[i] < 1.0;
    std::copy_n(pressures.begin(), chambers_of(i), out.pressures_bar.data() + segment.first);
  }
}

void PressureAllocator::largest_scale(ConstVectorRef tau_actuation_nm,
                                      SegmentScalars& scale) const noexcept {
  scale.resize(segments_);
  for (int i = 0; i < segments_; ++i) {
    const double x = tau_actuation_nm[2 * i], y = tau_actuation_nm[2 * i + 1];
    if (max_torque_nm_ > 0.0) {
      const double largest = std::max(std::abs(x), std::abs(y));
      scale[i] = !std::isfinite(largest) ? 0.0 : std::min(1.0, max_torque_nm_ / largest);
    } else {
      scale[i] = planar_ ? segment_[i].planar.largest_scale({plane_[0] * x + plane_[1] * y})
                         : segment_[i].spatial.largest_scale({x, y});
    }
  }
}

void PressureAllocator::torque(ConstVectorRef pressures_bar,
                               VectorRef tau_actuation_nm) const noexcept {
  if (max_torque_nm_ > 0.0) {
    tau_actuation_nm = pressures_bar;
    return;
  }
  for (int i = 0; i < segments_; ++i) {
    const double* pressures = pressures_bar.data() + segment_[i].first;
    if (!axial_.empty()) {
      const std::array<double, 2> moment = axial_[i].torque(pressures);
      tau_actuation_nm.segment<3>(3 * i) << moment[0], moment[1], axial_[i].axial_force(pressures);
    } else if (planar_) {
      const double moment = segment_[i].planar.torque(pressures)[0];
      tau_actuation_nm[2 * i] = plane_[0] * moment;
      tau_actuation_nm[2 * i + 1] = plane_[1] * moment;
    } else {
      const std::array<double, 2> moment = segment_[i].spatial.torque(pressures);
      tau_actuation_nm[2 * i] = moment[0];
      tau_actuation_nm[2 * i + 1] = moment[1];
    }
  }
}

void PressureAllocator::generalized_force(ConstVectorRef pressures_bar,
                                          VectorRef force_nm) const noexcept {
  torque(pressures_bar, force_nm);
  const Eigen::Index width = axial_.empty() ? 2 : 3;
  for (Eigen::Index i = 0; i < width * segments_; i += width) {
    const double tau_x = force_nm[i];
    force_nm[i] = force_nm[i + 1];
    force_nm[i + 1] = -tau_x;
  }
}

}  // namespace softarm
