// Special angles, speeds of 1e3 rad/s and dense sweeps over theta, each against the reference model
// in long double.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "against_reference.hpp"
#include "softarm/model/entire_functions.hpp"

namespace softarm {
namespace {

using testing_support::AgainstReference;
using testing_support::expect_within;
using testing_support::RandomArm;
using testing_support::State;

using std::numbers::pi;

/// Straight, where squares underflow, both sides of every switch (s = 1, 4, 12, 33, 64 and what
/// lies beside them), where sin or 1 - cos vanish, and beyond a full turn.
const std::vector<double>& special_angles() {
  static const std::vector<double> angles = [] {
    std::vector<double> all = {0.0,
                               5e-324,
                               1e-310,
                               1e-300,
                               1e-160,
                               1e-155,
                               1e-12,
                               1e-9,
                               1e-8,
                               1e-6,
                               1e-4,
                               1e-3,
                               1e-2,
                               1e-1,
                               0.5,
                               1.0,
                               0.5 * pi,
                               pi - 1e-9,
                               pi,
                               pi + 1e-9,
                               4.4934094579,
                               1.5 * pi,
                               2.0 * pi - 1e-9,
                               2.0 * pi,
                               2.0 * pi + 1e-9,
                               7.0};
    for (const double s : {1.0, 4.0, 12.0, 33.0}) {
      const double theta = std::sqrt(s);
      for (const double beside : {std::nextafter(theta, 0.0), theta, std::nextafter(theta, 9.0)}) {
        all.push_back(beside);
      }
    }
    return all;
  }();
  return angles;
}

class SpecialAngles : public ::testing::TestWithParam<testing_support::ArmKind> {};

TEST_P(SpecialAngles, OfEverySegmentAtOnce) {
  RandomArm random(1);
  for (const double theta : special_angles()) {
    for (const double phi : {0.0, 0.3, 0.5 * pi, pi, -pi, std::nextafter(pi, 4.0), -2.0}) {
      const ArmParameters arm = random.arm(3, GetParam());
      State s = random.state(arm, 1.0, phi == 0.3 ? 1e3 : 2.0);
      for (int i = 0; i < 3; ++i) {
        s.u.segment<2>(arm.segment_dof() * i) << theta * std::cos(phi), theta * std::sin(phi);
      }
      expect_within(AgainstReference(arm, s), 3, theta);
      if (HasFailure()) FAIL() << "theta " << theta << ", phi " << phi;
    }
  }
}

TEST_P(SpecialAngles, MixedAlongTheArm) {
  // Neighbours on different sides of the switches.
  RandomArm random(2);
  const auto& angles = special_angles();
  for (int trial = 0; trial < 400; ++trial) {
    const int n = 2 + trial % 6;
    const ArmParameters arm = random.arm(n, GetParam());
    State s = random.state(arm, 1.0, trial % 3 == 0 ? 1e3 : 2.0);
    for (int i = 0; i < n; ++i) {
      const auto pick =
          static_cast<std::size_t>(random.uniform(0.0, 0.999) * double(angles.size()));
      const double phi = random.uniform(-4.0, 4.0);
      s.u.segment<2>(arm.segment_dof() * i) << angles[pick] * std::cos(phi),
          angles[pick] * std::sin(phi);
    }
    expect_within(AgainstReference(arm, s), n, 7.0);
    if (HasFailure()) FAIL() << "trial " << trial;
  }
}

TEST_P(SpecialAngles, SweptDensely) {
  // A switch that this file does not know would lie between two of these and show on one side.
  RandomArm random(3);
  const ArmParameters arm = random.arm(1, GetParam());
  State s = random.state(arm, 1.0);
  constexpr int kSteps = 15000;
  for (int k = 0; k <= kSteps; ++k) {
    const double theta = 7.5 * k / kSteps;
    s.u.head<2>() << 0.6 * theta, -0.8 * theta;
    expect_within(AgainstReference(arm, s), 1, theta);
    if (HasFailure()) FAIL() << "theta " << theta;
  }
  for (double theta = 1.0; theta > 0.0; theta *= 0.4) {  // down through the denormals
    s.u.head<2>() << 0.6 * theta, -0.8 * theta;
    expect_within(AgainstReference(arm, s), 1, theta);
    if (HasFailure()) FAIL() << "theta " << theta;
  }
}

TEST_P(SpecialAngles, RandomSpeedsUpToThousandRadiansPerSecond) {
  RandomArm random(4);
  for (int trial = 0; trial < 500; ++trial) {
    const int n = 1 + trial % 5;
    const ArmParameters arm = random.arm(n, GetParam());
    expect_within(AgainstReference(arm, random.state(arm, 7.0, 1e3)), n, 7.0);
    if (HasFailure()) FAIL() << "trial " << trial;
  }
}

INSTANTIATE_TEST_SUITE_P(ArmKinds, SpecialAngles, ::testing::ValuesIn(testing_support::kArmKinds),
                         [](const auto& kind) { return name(kind.param); });

TEST(EntireFunctions, AgreeWithLongDoubleEverywhere) {
  const auto expect_close = [](double s) {
    const auto got = entire_functions(s);
    const auto want = reference::entire_functions(s);
    long double inverse_factorial = 1;
    for (std::size_t k = 0; k < got.size(); ++k) {
      if (k > 0) inverse_factorial /= static_cast<long double>(k);
      const long double scale = std::max(std::abs(want[k]), inverse_factorial);
      ASSERT_LE(std::abs(got[k] - want[k]), 16 * 1.11e-16L * scale) << "c_" << k << ", s " << s;
    }
  };
  for (int k = 0; k <= 60000; ++k) expect_close(100.0 * k / 60000);
  for (double s = 1.0; s > 0.0; s *= 0.5) expect_close(s);
  for (const double limit : {1.0, 4.0, 12.0, 33.0, 49.0, 64.0}) {
    double s = limit;
    for (int k = 0; k < 50; ++k) s = std::nextafter(s, 0.0);
    for (int k = 0; k < 100; ++k, s = std::nextafter(s, 100.0)) expect_close(s);
  }
}

}  // namespace
}  // namespace softarm
