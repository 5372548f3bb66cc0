#include "softarm/runtime/elongation_reference.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "softarm/model/actuation_matrix.hpp"
#include "softarm/model/statics.hpp"

namespace softarm {
namespace {

constexpr double kArea = 0.839 / 0.0125;

ArmParameters stretching_arm(int n) {
  ArmParameters arm;
  arm.segments.resize(static_cast<std::size_t>(n));
  arm.extensible = true;
  return arm;
}

ActuationSettings four_chambers(int n, double bias_bar) {
  ActuationSettings settings;
  std::vector<Chamber> chambers;
  for (int j = 0; j < 4; ++j) chambers.push_back({0.5 * std::numbers::pi * j});
  settings.segments.assign(static_cast<std::size_t>(n), chambers);
  settings.bias_pressure_bar = bias_bar;
  return settings;
}

/// A reference at rest.
ReferenceWindow at_rest(const SegmentVector& q, double lookahead_s) {
  ReferenceWindow window;
  window.interval_s = 2.0 * lookahead_s;
  for (ReferenceSample* sample : {&window.before, &window.now, &window.after}) {
    sample->u = q;
    sample->velocity = sample->acceleration = SegmentVector::Zero(q.size());
  }
  return window;
}

// Another way to it: Newton's method on the static balance of the whole arm.
TEST(ElongationReference, StraightElongationIsTheShapeAtRest) {
  for (const double bar : {0.0, 0.3}) {
    ArmParameters arm = stretching_arm(3);
    const ActuationSettings actuation = four_chambers(3, bar);
    Eigen::VectorXd tau = Eigen::VectorXd::Zero(9);
    for (int i = 0; i < 3; ++i) tau[3 * i + 2] = 4.0 * kArea * bar;
    const auto rest = rest_shape(arm, tau);
    ASSERT_TRUE(rest);
    const SegmentScalars found = straight_elongation(arm, actuation, bar);
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(found[i], (*rest)[3 * i + 2], 1e-9);
    arm.segments[1].constant_length = true;
    EXPECT_EQ(straight_elongation(arm, actuation, bar)[1], 0.0);
    arm.segments[0].axial_damping_ns_per_m = 0.0;
    EXPECT_THROW(straight_elongation(arm, actuation, bar), std::invalid_argument);
  }
}

// Straight, the axial weight does not depend on e: what is within reach is approached as exp(-t k_a /
// beta_a).
TEST(ElongationReference, WithinReachItGoesToWhatIsAskedForAsASpringAndADamperDo) {
  const ArmParameters arm = stretching_arm(2);
  const ActuationSettings actuation = four_chambers(2, 0.0);
  const PressureAllocator allocator(actuation, true);
  ElongationReference reference(arm, actuation, allocator);
  constexpr double kWanted_m = 0.02, kTick_s = 0.002, kLookahead_s = 0.01;
  reference.start(0.0, SegmentVector::Zero(6));
  SegmentVector asked = SegmentVector::Zero(6);
  asked[2] = asked[5] = kWanted_m;
  const double rate =
      arm.segments[0].axial_stiffness_n_per_m / arm.segments[0].axial_damping_ns_per_m;
  for (int k = 1; k <= 200; ++k) {
    ReferenceWindow window = at_rest(asked, kLookahead_s);
    reference.advance(k * kTick_s, kLookahead_s, window);
    const double left_m = kWanted_m * std::exp(-rate * k * kTick_s);
    EXPECT_NEAR(window.now.u[2], kWanted_m - left_m, 1e-9);
    EXPECT_NEAR(window.now.velocity[5], rate * left_m, 1e-7);
    EXPECT_NEAR(window.now.acceleration[5], -rate * rate * left_m, 1e-5);
    EXPECT_EQ(window.now.u[0], 0.0);
    ReferenceSample sample = window.now;
    reference.replace(k * kTick_s + kLookahead_s, sample);
    EXPECT_EQ(sample.u, window.after.u);
  }
}

// Another way to it: an arm that is configured as the corrected one.
TEST(ElongationReference, ACorrectedArmReachesWhatThatArmReaches) {
  const ArmParameters arm = stretching_arm(2);
  const ActuationSettings actuation = four_chambers(2, 0.0);
  ArmParameters other = arm;
  ActuationSettings others = actuation;
  ModelCorrection correction;
  correction.disturbance_nm.setZero(4);
  for (std::size_t i = 0; i < 2; ++i) {
    correction.segment[i] = {.stiffness = 0.2,
                             .damping = -0.1,
                             .gain = -0.2,
                             .axial_stiffness = 0.1 + 0.1 * static_cast<double>(i),
                             .axial_damping = 0.3,
                             .axial_gain = -0.2};
    SegmentParameters& segment = other.segments[i];
    segment.stiffness_nm_per_rad *= 1.2;
    segment.damping_nms_per_rad *= 0.9;
    segment.axial_stiffness_n_per_m *= 1.0 + correction.segment[i].axial_stiffness;
    segment.axial_damping_ns_per_m *= 1.3;
    for (Chamber& chamber : others.segments[i]) chamber.gain_nm_per_bar *= 0.8;
  }
  const PressureAllocator allocator(actuation, true), other_allocator(others, true);
  ElongationReference corrected(arm, actuation, allocator);
  ElongationReference configured(other, others, other_allocator);
  SegmentVector asked(6);
  asked << 0.5, 0.2, 0.001, -0.3, 0.1, 0.03;  // the first out of reach, the second within
  for (ElongationReference* each : {&corrected, &configured}) each->start(0.0, asked);
  for (int k = 1; k <= 100; ++k) {
    ReferenceWindow one = at_rest(asked, 0.01), same = one;
    corrected.advance(0.002 * k, 0.01, one, &correction, true);
    configured.advance(0.002 * k, 0.01, same);
    for (const int e : {2, 5}) {
      EXPECT_NEAR(one.now.u[e], same.now.u[e], 1e-12);
      EXPECT_NEAR(one.now.velocity[e], same.now.velocity[e], 1e-10);
    }
    if (k == 100) {
      EXPECT_GT(one.now.u[2], 0.003) << "out of reach";
    }
  }
}

TEST(ElongationReference, BendingAsksForMoreAndGetsIt) {
  const ArmParameters arm = stretching_arm(2);
  const ActuationSettings actuation = four_chambers(2, 0.0);
  const PressureAllocator allocator(actuation, true);
  ElongationReference reference(arm, actuation, allocator);
  constexpr double kLookahead_s = 0.01;
  SegmentVector bent(6);
  bent << 0.4, 0.2, 0.0, -0.3, 0.3, 0.0;  // e asked for: none
  reference.start(0.0, bent);
  ReferenceWindow window;
  for (int k = 1; k <= 2000; ++k) {
    window = at_rest(bent, kLookahead_s);
    reference.advance(0.002 * k, kLookahead_s, window);
  }
  // At rest there, what holds the shape is just within reach: above the least axial force, and not by
  // more than the smoothing.
  DynamicsWorkspace workspace(arm);
  Eigen::VectorXd force(6), tau(6);
  static_moments(arm, workspace, window.now.u, force);
  solve_actuation(arm, window.now.u, force, tau);
  for (int i = 0; i < 2; ++i) {
    const AxialChamberMap& chambers = allocator.axial(i);
    const auto range = chambers.axial_range({tau[3 * i], tau[3 * i + 1]});
    EXPECT_GT(window.now.u[3 * i + 2], 2e-3);
    EXPECT_GE(tau[3 * i + 2], range.low_n - 1e-6);
    EXPECT_LE(tau[3 * i + 2], range.low_n + 3.0 * chambers.smoothing_n());
  }
}

// Where bending decides about e its acceleration, which (17) feeds forward, is the second derivative of
// e: inertia along e must not be left out of it.
TEST(ElongationReference, AccelerationIsTheSecondDerivativeWhereBendingDecides) {
  ArmParameters arm = stretching_arm(1);
  arm.segments[0].mass_kg = 1.0;
  const ActuationSettings actuation = four_chambers(1, 0.0);
  const PressureAllocator allocator(actuation, true);
  ElongationReference reference(arm, actuation, allocator);
  constexpr double kTick_s = 0.001, kLookahead_s = 0.0025, kRate = 8.0;
  reference.start(0.0, SegmentVector::Zero(3));
  const auto sample_at = [](double t) {
    ReferenceSample sample;
    const double c = std::cos(kRate * t), s = std::sin(kRate * t);
    sample.u = Eigen::Vector3d(0.4 * c, 0.3 * s, 0.0);
    sample.velocity = Eigen::Vector3d(-0.4 * kRate * s, 0.3 * kRate * c, 0.0);
    sample.acceleration = -kRate * kRate * sample.u;
    return sample;
  };
  std::vector<double> e, velocity, acceleration;
  for (int k = 1; k <= 2000; ++k) {
    const double t = k * kTick_s;
    ReferenceWindow window;
    window.interval_s = 2.0 * kLookahead_s;
    window.before = sample_at(t - kLookahead_s);
    window.now = sample_at(t);
    window.after = sample_at(t + kLookahead_s);
    reference.advance(t, kLookahead_s, window);
    e.push_back(window.now.u[2]);
    velocity.push_back(window.now.velocity[2]);
    acceleration.push_back(window.now.acceleration[2]);
  }
  double off = 0.0, all = 0.0, off_velocity = 0.0, all_velocity = 0.0;
  for (std::size_t k = 1000; k + 1 < e.size(); ++k) {
    const double second = (e[k + 1] - 2.0 * e[k] + e[k - 1]) / (kTick_s * kTick_s);
    const double first = (e[k + 1] - e[k - 1]) / (2.0 * kTick_s);
    off += (acceleration[k] - second) * (acceleration[k] - second);
    all += second * second;
    off_velocity += (velocity[k] - first) * (velocity[k] - first);
    all_velocity += first * first;
  }
  EXPECT_GT(std::sqrt(all_velocity / 1000.0), 5e-3);
  EXPECT_LT(std::sqrt(off_velocity / all_velocity), 0.01);
  EXPECT_LT(std::sqrt(off / all), 0.08);
}

TEST(ElongationReference, SegmentsOfConstantLengthKeepItAndTheBias) {
  ArmParameters arm = stretching_arm(2);
  arm.segments[0].constant_length = true;
  const ActuationSettings actuation = four_chambers(2, 0.25);
  const PressureAllocator allocator(actuation, true);
  ElongationReference reference(arm, actuation, allocator);
  reference.start(0.0, SegmentVector::Zero(6));
  SegmentVector asked = SegmentVector::Zero(6);
  asked[5] = 0.01;
  for (int k = 1; k <= 100; ++k) {
    ReferenceWindow window = at_rest(asked, 0.01);
    reference.advance(0.002 * k, 0.01, window);
    EXPECT_EQ(window.now.u[2], 0.0);
  }
  SegmentVector tau = SegmentVector::Zero(6);
  reference.hold_constant_lengths(tau);
  EXPECT_NEAR(tau[2], kArea, 1e-9);
  EXPECT_EQ(tau[5], 0.0);
}

}  // namespace
}  // namespace softarm
