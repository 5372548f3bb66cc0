// Elements that remember, against closed forms: loops of a known area, decay of a known rate.
#include "softarm/model/memory.hpp"

#include <gtest/gtest.h>

namespace softarm {
namespace {

TEST(Play, DragsItsCentreAtTheRadiusAndNoFarther) {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  for (int k = 0; k <= 200; ++k) {
    const double t = 0.1 * k;
    const Eigen::Vector2d u(std::sin(t), 0.5 * std::cos(1.7 * t));
    const Eigen::Vector2d before = centre;
    centre = play(centre, u, 0.2);
    EXPECT_LE((u - centre).norm(), 0.2 + 1e-15);
    if ((u - before).norm() <= 0.2) {
      EXPECT_EQ(centre, before);
    }
  }
}

TEST(Play, OfOneDirectionDoesNotDependOnTheRate) {
  const Eigen::Vector2d axis(0.6, -0.8);
  Eigen::Vector2d at_once = Eigen::Vector2d::Zero(), slowly = at_once;
  for (const double end : {1.0, -0.3, 0.5}) {
    at_once = play(at_once, end * axis, 0.1);
    const double begin = end == 1.0 ? 0.0 : end == -0.3 ? 1.0 : -0.3;
    for (int k = 1; k <= 1000; ++k)
      slowly = play(slowly, (begin + (end - begin) * k / 1000.0) * axis, 0.1);
    EXPECT_LT((slowly - at_once).norm(), 1e-12);
  }
}

TEST(SlipSpring, DissipatesTheAreaOfItsLoop) {
  // Between -A and A a spring k that slips at r loses 4 k r (A - r) a cycle.
  const SlipSpring spring{0.05, 3.0};
  const double amplitude = 0.3;
  const Eigen::Vector2d axis(std::cos(0.4), std::sin(0.4));
  Eigen::Vector2d centre = Eigen::Vector2d::Zero(), u = Eigen::Vector2d::Zero();
  double work = 0.0;
  constexpr int kSteps = 20000;
  for (int k = 1; k <= 2 * kSteps; ++k) {
    const Eigen::Vector2d next = amplitude * std::sin(2.0 * M_PI * k / kSteps) * axis;
    const Eigen::Vector2d moment = spring.moment(centre, 0.5 * (u + next));
    if (k > kSteps) work += moment.dot(next - u);
    centre = play(centre, next, spring.radius_rad);
    u = next;
  }
  const double expected =
      4.0 * spring.stiffness_nm_per_rad * spring.radius_rad * (amplitude - spring.radius_rad);
  EXPECT_NEAR(work, expected, 1e-3 * expected);
}

TEST(SlipSpring, SlopeIsThatOfTheMoment) {
  const SlipSpring spring{0.1, 2.0};
  const Eigen::Vector2d centre(0.02, -0.01);
  for (const Eigen::Vector2d& u : {Eigen::Vector2d(0.05, 0.03), Eigen::Vector2d(0.3, -0.2)}) {
    const Eigen::Matrix2d slope = spring.slope(centre, u);
    for (int j = 0; j < 2; ++j) {
      const Eigen::Vector2d step = 1e-6 * Eigen::Vector2d::Unit(j);
      const Eigen::Vector2d difference =
          (spring.moment(centre, u + step) - spring.moment(centre, u - step)) / 2e-6;
      EXPECT_LT((slope.col(j) - difference).norm(), 1e-8);
    }
  }
}

TEST(Remanence, TwoHalfStepsAreOne) {
  const Remanence element{0.3, 7.0};
  const double once = element.step(0.02, 0.5, 4.0);
  EXPECT_NEAR(element.step(element.step(0.02, 0.5, 2.0), 0.5, 2.0), once, 1e-15);
  EXPECT_NEAR(element.step(0.0, 1.0, 7.0), 0.3 * (1.0 - std::exp(-1.0)), 1e-15);
}

/// The moment of two elements over a cycle of A sin w t: pi A^2 sum m_i w T_i / (1 + (w T_i)^2).
TEST(Remanence, TwoElementsDissipateTheirCycles) {
  const double parts[] = {0.3, 0.2}, amplitude = 0.4, w = 2.0 * M_PI / 10.0;
  const Remanence elements[] = {{1.0, 20.0}, {1.0, 1.5}};
  double z[] = {0.0, 0.0}, u = 0.0, work = 0.0, expected = 0.0;
  constexpr int kSteps = 4000, kCycles = 20;  // a cycle; what was before the last has gone
  for (int k = 1; k <= kCycles * kSteps; ++k) {
    const double next = amplitude * std::sin(2.0 * M_PI * k / kSteps), middle = 0.5 * (u + next);
    for (int i = 0; i < 2; ++i) {
      const double after = elements[i].step(z[i], middle, 10.0 / kSteps);
      if (k > (kCycles - 1) * kSteps)
        work += parts[i] * (middle - 0.5 * (z[i] + after)) * (next - u);
      z[i] = after;
    }
    u = next;
  }
  for (int i = 0; i < 2; ++i) {
    const double x = w * elements[i].time_s;
    expected += M_PI * amplitude * amplitude * parts[i] * x / (1.0 + x * x);
  }
  EXPECT_NEAR(work, expected, 1e-3 * expected);
}

}  // namespace
}  // namespace softarm
