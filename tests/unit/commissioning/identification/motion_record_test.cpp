// Lagged inputs against the simulated valves and against small steps.
#include "softarm/commissioning/identification/motion_record.hpp"

#include <gtest/gtest.h>

#include "softarm/simulation/valves.hpp"

namespace softarm {
namespace {

InputTrack track(bool held) {
  InputTrack out;
  out.held = held;
  out.time_s = Eigen::Vector4d(0.0, 0.1, 0.13, 0.5);
  out.value.resize(4, 2);
  out.value << 0.0, 0.3, 0.6, 0.1, 0.2, 0.2, 1.0, 0.0;
  return out;
}

TEST(LaggedInput, OfSetPointsIsWhatValvesDo) {
  const InputTrack input = track(true);
  LaggedInput lagged(input, 0.04, 0.0);
  Valves valves({.lag_s = 0.04}, 2);
  valves.reset(std::array{0.0, 0.3});
  Eigen::VectorXd got(2);
  Eigen::Index next = 0;
  double now_s = 0.0;
  for (const double t : {0.02, 0.1, 0.11, 0.13, 0.2, 0.4, 0.5, 0.9}) {
    while (now_s < t) {
      if (next < 4 && input.time_s[next] <= now_s) {
        const Eigen::VectorXd command = input.value.row(next++);
        valves.command({command.data(), 2});
      }
      const double end = next < 4 ? std::min(t, input.time_s[next]) : t;
      valves.advance(end - now_s);
      now_s = end;
    }
    lagged.at(t, got);
    EXPECT_NEAR((got - valves.pressures_bar()).norm(), 0.0, 1e-14) << t;
  }
}

TEST(LaggedInput, OfMeasurementsFollowsStraightLines) {
  const InputTrack input = track(false);
  LaggedInput lagged(input, 0.04, 0.02);
  Eigen::VectorXd got(2);
  Eigen::Vector2d state = input.value.row(0);
  const double h = 1e-5;
  for (int k = 0; k < 70000; ++k) {
    const double t = (k + 0.5) * h - 0.02;  // middle of the step, before the delay
    Eigen::Vector2d c = input.value.row(t < 0.5 ? 0 : 3);
    for (Eigen::Index i = 0; i + 1 < 4; ++i)
      if (t >= input.time_s[i] && t < input.time_s[i + 1])
        c = input.value.row(i) + (t - input.time_s[i]) / (input.time_s[i + 1] - input.time_s[i]) *
                                     (input.value.row(i + 1) - input.value.row(i));
    const Eigen::Vector2d middle = state + 0.5 * h / 0.04 * (c - state);
    state += h / 0.04 * (c - middle);
    if ((k + 1) % 5000 != 0) continue;
    lagged.at((k + 1) * h, got);
    EXPECT_NEAR((got - state).norm(), 0.0, 1e-7) << k;
  }
}

TEST(LaggedInput, JumpsWithoutALagWhereTheSetPointDoes) {
  const InputTrack input = track(true);
  LaggedInput lagged(input, 0.0, 0.25);
  Eigen::VectorXd got(2);
  lagged.at(0.3, got);
  EXPECT_EQ(got[0], 0.0);
  lagged.at(0.375, got, true);
  EXPECT_EQ(got[0], 0.6);
  lagged.at(0.75, got, true);
  EXPECT_EQ(got[0], 0.2);
  lagged.at(0.75, got);
  EXPECT_EQ(got[0], 1.0);
}

TEST(MotionRecord, PartKeepsItsLead) {
  MotionRecord record;
  record.time_s = Eigen::VectorXd::LinSpaced(101, 0.0, 10.0);
  record.u_rad = record.time_s;
  record.input = track(true);
  const MotionRecord part = record.part(4.0, 6.0, 1.0);
  EXPECT_NEAR(part.time_s[0], 3.0, 1e-9);
  EXPECT_LT(part.time_s[part.time_s.size() - 1], 6.0);
  EXPECT_EQ(part.scored_from_s, 4.0);
  EXPECT_NEAR(part.u_rad(0, 0), 3.0, 1e-9);
}

TEST(MotionRecord, ThinnedKeepsFramesApart) {
  MotionRecord record;
  record.time_s.resize(7);
  record.time_s << 0.0, 0.01, 0.02, 0.05, 0.3, 0.34, 0.36;  // a burst, a gap, a burst
  record.u_rad = 2.0 * record.time_s;
  record.input = track(true);
  record.scored_from_s = 0.1;
  const MotionRecord thin = record.thinned(0.05);
  ASSERT_EQ(thin.time_s.size(), 4);
  EXPECT_EQ(thin.time_s, Eigen::Vector4d(0.0, 0.05, 0.3, 0.36));
  EXPECT_EQ(thin.u_rad.col(0), 2.0 * thin.time_s);
  EXPECT_EQ(thin.scored_from_s, 0.1);
  EXPECT_EQ(thin.input.time_s, record.input.time_s);
}

}  // namespace
}  // namespace softarm
