#include "commissioning/identification/quasi_static.hpp"

#include <algorithm>
#include <cmath>

#include "softarm/model/statics.hpp"

namespace softarm {
namespace {

constexpr double kLargest_rad = 20.0;  ///< a response beyond it is not that of an arm
constexpr double kBalanced_rad = 1e-10;
constexpr double kSlow = 0.2;  ///< a round that shortens the step less needs the slope of its place
constexpr int kMostNewtonRounds = 30;
constexpr double kShortest = 0.1;  ///< of the configured length: shorter is no segment

// Alexander's method of order 3: gamma is the root of x^3 - 3 x^2 + 3 x / 2 - 1/6 in (1/6, 1/2).
constexpr double kGamma = 0.435866521508459;
constexpr double kWeights[3][3] = {{kGamma, 0.0, 0.0},
                                   {0.5 * (1.0 - kGamma), kGamma, 0.0},
                                   {-0.25 * (6.0 * kGamma * kGamma - 16.0 * kGamma + 1.0),
                                    0.25 * (6.0 * kGamma * kGamma - 20.0 * kGamma + 5.0), kGamma}};

}  // namespace

const double QuasiStaticMotion::kNodes[kStages] = {kGamma, 0.5 * (1.0 + kGamma), 1.0};

void RemanentRest::begin(const ArmHypothesis& arm, Eigen::VectorXd& rest) {
  slow_.setZero(arm.arm.dof());
  second_.setZero(arm.arm.dof());
  if (arm.remanent_rad.size() == slow_.size() && arm.remanence.share != 0.0)
    slow_ = arm.remanent_rad;
  rest = arm.rest_rad + slow_;
}

void RemanentRest::step(const ArmHypothesis& arm, const Eigen::VectorXd& u, double step_s,
                        Eigen::VectorXd& rest) {
  if (arm.remanence.share == 0.0 && arm.remanence_2.share == 0.0) return;
  for (Eigen::Index c = 0; c < u.size(); ++c) {
    const double bend = u[c] - arm.rest_rad[c];
    if (arm.remanence.share != 0.0) slow_[c] = arm.remanence.step(slow_[c], bend, step_s);
    if (arm.remanence_2.share != 0.0) second_[c] = arm.remanence_2.step(second_[c], bend, step_s);
  }
  rest = arm.rest_rad + slow_ + second_;
}

void StretchedStiffness::at(Eigen::Index k, const KnownLengths& lengths) {
  if (lengths.pressed_m.rows() == 0) return;
  pressed_m_ =
      0.5 * (lengths.pressed_m.row(std::max<Eigen::Index>(0, k - 1)) + lengths.pressed_m.row(k));
  by_bend_m_per_rad2_ = lengths.by_bend_m_per_rad2;
}

double StretchedStiffness::length_ratio(Eigen::Index i, const Eigen::Vector2d& u) const {
  const double ratio = (pressed_m_[i] + by_bend_m_per_rad2_ * u.squaredNorm()) /
                       arm_.arm.segments[static_cast<std::size_t>(i)].length_m;
  return std::max(kShortest, ratio);
}

double StretchedStiffness::factor(Eigen::Index i, const Eigen::Vector2d& u) const {
  return given() ? std::pow(length_ratio(i, u), arm_.stiffening_by_length) : 1.0;
}

Eigen::Vector2d StretchedStiffness::gradient(Eigen::Index i, const Eigen::Vector2d& u) const {
  return 2.0 * by_bend_m_per_rad2_ * arm_.stiffening_by_length * factor(i, u) /
         (length_ratio(i, u) * arm_.arm.segments[static_cast<std::size_t>(i)].length_m) * u;
}

QuasiStaticMotion::QuasiStaticMotion(const ArmHypothesis& arm)
    : arm_(arm), plain_(arm.arm), workspace_(arm.arm), stretched_(arm) {
  const Eigen::Index dof = arm.arm.dof();
  damping_.resize(dof);
  for (Eigen::Index c = 0; c < dof; ++c)
    damping_[c] = arm.arm.segments[static_cast<std::size_t>(c / 2)].damping_nms_per_rad;
  for (SegmentParameters& segment : plain_.segments) {
    segment.stiffness_nm_per_rad = 0.0;  // springs are added here
    heavy_ = heavy_ || segment.mass_kg > 0.0;
  }
  gravity_slope_.setZero(dof, dof);
  if (heavy_) gravity_slope_ = gravity_slope(plain_, Eigen::VectorXd::Zero(dof));
  for (Eigen::VectorXd* each : {&stiffness_, &force_, &u_, &left_, &change_, &base_, &stage_})
    each->setZero(dof);
  for (Eigen::VectorXd& each : rates_) each.setZero(dof);
  remanents_.begin(arm, rest_);
  slope_.setZero(dof, dof);
}

void QuasiStaticMotion::load(const Eigen::VectorXd& input) {
  input_ = input;
  for (Eigen::Index c = 0; c < stiffness_.size(); ++c)
    stiffness_[c] = arm_.arm.segments[static_cast<std::size_t>(c / 2)].stiffness_nm_per_rad;
  if (arm_.stiffening_1pbar != 0.0) {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(arm_.arm.size());
    for (std::size_t j = 0; j < arm_.segment_of.size(); ++j)
      sum[arm_.segment_of[j]] += input[static_cast<Eigen::Index>(j)];
    for (Eigen::Index c = 0; c < stiffness_.size(); ++c)
      stiffness_[c] *= std::max(0.05, 1.0 + arm_.stiffening_1pbar * sum[c / 2]);
  }
  if (arm_.arm.actuation == ActuationModel::chamber) actuation_force(arm_, u_, input_, force_);
}

/// What is left of the balance: springs + G - input.
void QuasiStaticMotion::balance(const Eigen::VectorXd& u, Eigen::VectorXd& out) {
  if (heavy_) {
    gravity_moments(plain_, workspace_, u, out);
  } else {
    out.setZero();
  }
  if (arm_.load_kg > 0.0) add_load_moments(arm_, u, out);
  // Chambers push alike in every shape: what `load` found holds.
  if (arm_.arm.actuation != ActuationModel::chamber) actuation_force(arm_, u, input_, force_);
  out -= force_;
  for (Eigen::Index i = 0; i < u.size(); i += 2) {
    const Eigen::Vector2d bend = u.segment<2>(i) - rest_.segment<2>(i);
    out.segment<2>(i) += (stiffness_[i] * stretched_.factor(i / 2, u.segment<2>(i)) +
                          arm_.cubic_nm_per_rad3 * bend.squaredNorm()) *
                         bend;
    for (std::size_t k = 0; k < centres_.size(); ++k)
      out.segment<2>(i) += arm_.slip_springs[k].moment(centres_[k].segment<2>(i), u.segment<2>(i));
  }
}

/// Its slope in u, but for that of gravity, which is taken at the straight arm, and of the input.
void QuasiStaticMotion::slope(const Eigen::VectorXd& u) {
  slope_ = gravity_slope_;
  for (Eigen::Index i = 0; i < u.size(); i += 2) {
    const Eigen::Vector2d bend = u.segment<2>(i) - rest_.segment<2>(i);
    Eigen::Matrix2d own = (stiffness_[i] * stretched_.factor(i / 2, u.segment<2>(i)) +
                           arm_.cubic_nm_per_rad3 * bend.squaredNorm()) *
                          Eigen::Matrix2d::Identity();
    if (stretched_.given())
      own += stiffness_[i] * bend * stretched_.gradient(i / 2, u.segment<2>(i)).transpose();
    own += 2.0 * arm_.cubic_nm_per_rad3 * bend * bend.transpose();
    for (std::size_t k = 0; k < centres_.size(); ++k)
      own += arm_.slip_springs[k].slope(centres_[k].segment<2>(i), u.segment<2>(i));
    slope_.block<2, 2>(i, i) += own;
  }
}

/// u with D (u - base) / damped_s + balance = 0, from the u given. Newton's method, with the slope of
/// an earlier place as long as that converges well; where friction makes it alternate, steps are
/// halved.
bool QuasiStaticMotion::solve(double damped_s, const Eigen::VectorXd& base, Eigen::VectorXd& u) {
  double before = std::numeric_limits<double>::infinity();
  bool fresh = false;
  for (int round = 0; round < kMostNewtonRounds; ++round) {
    balance(u, left_);
    if (damped_s > 0.0) left_ += damping_.cwiseProduct(u - base) / damped_s;
    if (damped_s != factored_for_s_ || fresh) {
      slope(u);
      if (damped_s > 0.0) slope_.diagonal() += damping_ / damped_s;
      lu_.compute(slope_);
      factored_for_s_ = damped_s;
    }
    change_ = lu_.solve(left_);
    const double length = change_.cwiseAbs().maxCoeff();
    if (!(length < kLargest_rad)) {
      if (fresh) return false;
      fresh = true;
      continue;
    }
    if (fresh && length > 0.7 * before) change_ *= 0.5;
    fresh = fresh || length > kSlow * before;
    u -= change_;
    // What is left behind a step, as long as they shorten in the same ratio.
    const double ratio = length / before;  // 0 in the first round, which says nothing
    const double left = ratio > 0.0 && ratio < 0.5 ? length * ratio / (1.0 - ratio) : length;
    before = length;
    if (left < kBalanced_rad) return u.cwiseAbs().maxCoeff() < kLargest_rad;
  }
  return before < 1e-7 && u.cwiseAbs().maxCoeff() < kLargest_rad;
}

bool QuasiStaticMotion::settle(const Eigen::VectorXd& input) {
  load(input);
  u_ = rest_;
  if (!solve(0.0, u_, u_)) return false;
  // Friction starts without tension.
  centres_.assign(arm_.slip_springs.size(), u_);
  return true;
}

bool QuasiStaticMotion::step(double step_s, const Eigen::VectorXd (&inputs)[kStages]) {
  for (int i = 0; i < kStages; ++i) {
    base_ = u_;
    for (int j = 0; j < i; ++j) base_ += step_s * kWeights[i][j] * rates_[j];
    load(inputs[i]);
    // From where the stage before, or the last of the step before, would lead.
    stage_ = base_ + kGamma * step_s * rates_[i > 0 ? i - 1 : kStages - 1];
    if (!solve(kGamma * step_s, base_, stage_)) return false;
    rates_[i] = (stage_ - base_) / (kGamma * step_s);
  }
  u_ = stage_;
  remember(step_s);
  return true;
}

void QuasiStaticMotion::remember(double step_s) {
  for (std::size_t k = 0; k < centres_.size(); ++k)
    for (Eigen::Index i = 0; i < u_.size(); i += 2)
      centres_[k].segment<2>(i) =
          play(centres_[k].segment<2>(i), u_.segment<2>(i), arm_.slip_springs[k].radius_rad);
  remanents_.step(arm_, u_, step_s, rest_);
}

}  // namespace softarm
