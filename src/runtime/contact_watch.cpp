#include "softarm/runtime/contact_watch.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "softarm/base/time.hpp"
#include "softarm/model/kinematics.hpp"

namespace softarm {
namespace {

/// Standard deviations of a force that begins a contact, and that keeps it.
constexpr double kSigmas = 5.0, kSigmasInContact = 2.0;

ArmParameters up_to(const ArmParameters& arm, int segment) {
  if (segment < 0 || segment > arm.size())
    throw std::invalid_argument(
        fmt::format("contact: expected a segment from 1 to {}, or 0, got {}", arm.size(), segment));
  ArmParameters part = arm;
  if (segment > 0) part.segments.resize(static_cast<std::size_t>(segment));
  return part;
}

struct MassFactor {
  double value, log_variance;
};

/// Corrections and disturbance are relative to the configured mass: an arm that is heavier shows as
/// one with less stiffness, damping, gain and disturbance. If all four are off by equal deviations,
/// what the corrections have in common is shared with the mass, and this is the factor of the mass
/// that is most likely. The force behind d is so many times d.
MassFactor mass_factor(const SegmentCorrection& correction, const SegmentCorrection& deviation) {
  constexpr double kPrior = 0.2;  // of each of the four
  const double corrections[] = {correction.stiffness, correction.damping, correction.gain};
  const double deviations[] = {deviation.stiffness, deviation.damping, deviation.gain};
  double sum = 0.0, weights = 1.0 / (kPrior * kPrior);
  for (std::size_t j = 0; j < 3; ++j) {
    const double weight = 1.0 / (kPrior * kPrior + deviations[j] * deviations[j]);
    sum -= weight * std::log1p(corrections[j]);
    weights += weight;
  }
  return {std::exp(sum / weights), 1.0 / weights};
}

}  // namespace

ContactWatch::ContactWatch(const ArmParameters& arm, const SafetySettings& settings)
    : part_(up_to(arm, settings.contact_segment)),
      threshold_n_(settings.contact_force_n),
      jacobian_(Eigen::Matrix3Xd::Zero(3, arm.dof())),
      slow_nm_(SegmentVector::Zero(arm.dof())),
      sudden_nm_(slow_nm_) {}

void ContactWatch::reset() noexcept {
  last_ns_ = above_ns_ = kNever;
  contact_ = pressure_loss_ = false;
  force_n_.setZero();
  covariance_n2_.setZero();
}

double ContactWatch::fit(const ModelObserver& observer, ConstVectorRef disturbance_nm,
                         Eigen::Vector3d& force_n) noexcept {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Eigen::Vector3d weighted = Eigen::Vector3d::Zero();
  if (!observer.project_disturbance(jacobian_, disturbance_nm, information, weighted)) {
    force_n.setZero();
    return 0.0;
  }
  information.diagonal().array() += 1.0 / (kExpected_n * kExpected_n);
  const Eigen::LLT<Eigen::Matrix3d> factor(information);
  force_n = factor.solve(weighted);
  covariance_n2_ = factor.solve(Eigen::Matrix3d::Identity());
  return std::sqrt(std::max(0.0, force_n.dot(information * force_n)));
}

void ContactWatch::judge(std::int64_t capture_ns, const ModelObserver& observer,
                         ConstVectorRef missing_nm) noexcept {
  if (!observer.running()) return reset();
  const SegmentVector& disturbance_nm = observer.correction().disturbance_nm;
  if (last_ns_ == kNever) slow_nm_ = disturbance_nm;
  const double since_s =
      last_ns_ == kNever ? 0.0 : std::max(0.0, to_seconds(capture_ns - last_ns_));
  last_ns_ = capture_ns;
  const SegmentVector& u = observer.newest_u_rad();
  tip_jacobian(part_, u.head(part_.dof()), jacobian_.leftCols(part_.dof()));
  ModelCorrection deviation;
  observer.deviation(deviation);
  double log_variance = 0.0;
  for (int i = 0; i < part_.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    const MassFactor mass = mass_factor(observer.correction().segment[k], deviation.segment[k]);
    jacobian_.middleCols<2>(2 * i) /= mass.value;
    log_variance += mass.log_variance / part_.size();
  }

  sudden_nm_ = disturbance_nm - slow_nm_;
  const double sigmas = fit(observer, sudden_nm_, force_n_);
  if (threshold_n_ > 0.0) {
    // Innovations that are too large are evidence before the force is known well.
    const bool sudden = observer.surprised();
    bool above = contact_
                     ? sudden || (force_n_.norm() > 0.5 * threshold_n_ && sigmas > kSigmasInContact)
                     : force_n_.norm() > threshold_n_ && (sudden || sigmas > kSigmas);
    pressure_loss_ = false;
    if (above && missing_nm.size() == sudden_nm_.size()) {
      fit(observer, missing_nm, missing_n_);
      pressure_loss_ = missing_n_.norm() > 0.5 * std::min(force_n_.norm(), threshold_n_);
      above = !pressure_loss_;
    }
    if (above) above_ns_ = capture_ns;
    contact_ = above || (contact_ && capture_ns - above_ns_ < to_ns(kEnd_s));
  }
  covariance_n2_ += log_variance * force_n_ * force_n_.transpose();
  if (!contact_) slow_nm_ += -std::expm1(-since_s / kMemory_s) * (disturbance_nm - slow_nm_);
}

}  // namespace softarm
