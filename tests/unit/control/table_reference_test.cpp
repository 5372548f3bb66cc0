// Trajectories from tables: through their points, smooth, within limits, refused with a reason.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <iomanip>

#include "softarm/control/reference.hpp"
#include "softarm/control/reference_kinds.hpp"
#include "test_folder.hpp"
#include "unit/control/arms.hpp"

namespace softarm {
namespace {

TableReference table(const std::string& text, int segments = 1, bool repeat = false) {
  const TestFolder folder;
  TableReference reference;
  reference.file = "table.csv";
  reference.repeat = repeat;
  reference.load(folder.write("table.csv", text), segments);
  return reference;
}

ReferenceSample at(const TableReference& reference, double time_s, int segments = 1) {
  ReferenceSample sample;
  for (auto* v : {&sample.u, &sample.velocity, &sample.acceleration}) v->setZero(2 * segments);
  reference.evaluate(time_s, sample);
  return sample;
}

std::string refusal(const TableReference& reference, int segments = 1) {
  try {
    reference.check({0}, test::gains(segments, 1.0, 0.0), segments);
  } catch (const ReferenceError& error) {
    return error.what();
  }
  return "";
}

/// A table of functions of time.
std::string sampled(const std::string& header, double period_s, int points,
                    const std::function<std::string(double)>& row) {
  std::ostringstream text;
  text << header << '\n' << std::setprecision(17);
  for (int k = 0; k < points; ++k) text << k * period_s << ',' << row(k * period_s) << '\n';
  return text.str();
}

TEST(TableReference, GoesThroughItsPointsAndRestsAtBothEnds) {
  const TableReference it =
      table("time_s,u1_x_rad,u1_y_rad\n10,0,0.1\n10.5,0.2,0\n12,-0.1,0.3\n12.25,0,0\n");
  ASSERT_EQ(refusal(it), "");
  EXPECT_EQ(it.duration_s(), 2.25);
  const double times[] = {0.0, 0.5, 2.0, 2.25}, x[] = {0, 0.2, -0.1, 0}, y[] = {0.1, 0, 0.3, 0};
  for (int k = 0; k < 4; ++k)
    EXPECT_LT((at(it, times[k]).u - Eigen::Vector2d(x[k], y[k])).norm(), 1e-15) << k;
  for (const double t : {-1.0, 0.0, 2.25, 99.0}) {
    EXPECT_TRUE(at(it, t).velocity.isZero(0.0)) << t;
    EXPECT_TRUE(at(it, t).acceleration.isZero(0.0)) << t;
  }
  // The derivatives, against differences; u' is continuous at the points.
  for (double t = 0.01; t < 2.24; t += 0.03) {
    constexpr double h = 1e-5;
    const ReferenceSample now = at(it, t), before = at(it, t - h), after = at(it, t + h);
    EXPECT_LT(((after.u - before.u) / (2 * h) - now.velocity).norm(), 1e-7) << t;
    EXPECT_LT(((after.velocity - before.velocity) / (2 * h) - now.acceleration).norm(), 2e-4) << t;
  }
  for (const double t : {0.5, 2.0}) {
    const ReferenceSample before = at(it, t - 1e-9), after = at(it, t + 1e-9);
    EXPECT_LT((before.velocity - after.velocity).norm(), 1e-7);
    EXPECT_LT((before.acceleration - after.acceleration).norm(), 1e-5);
  }
}

TEST(TableReference, ASineThatRepeatsIsFollowedToTheFourthOrder) {
  double error_before = 0.0;
  for (const int points : {21, 41, 81}) {
    const double period = 2.0 * M_PI / (points - 1);
    const TableReference it = table(sampled("t_s,u1_x_rad,u1_y_rad", period, points,
                                            [](double t) {
                                              std::ostringstream row;
                                              row << std::setprecision(17) << 0.3 * std::sin(t)
                                                  << ',' << 0.2 * std::cos(t);
                                              return row.str();
                                            }),
                                    1, true);
    ASSERT_EQ(refusal(it), "");
    double error = 0.0, rate_error = 0.0;
    for (double t = 0.0; t < 20.0; t += 0.0137) {
      const ReferenceSample now = at(it, t);
      error =
          std::max(error, (now.u - Eigen::Vector2d(0.3 * std::sin(t), 0.2 * std::cos(t))).norm());
      rate_error =
          std::max(rate_error,
                   (now.velocity - Eigen::Vector2d(0.3 * std::cos(t), -0.2 * std::sin(t))).norm());
    }
    EXPECT_LT(error, 0.3 * std::pow(period, 4) / 100.0) << points;
    EXPECT_LT(rate_error, 0.3 * std::pow(period, 3) / 10.0) << points;
    if (error_before > 0.0) {
      EXPECT_NEAR(error_before / error, 16.0, 2.0);
    }
    error_before = error;
    EXPECT_NEAR(it.largest_theta_rad(), 0.3, 1e-3);
    EXPECT_GE(it.largest_speed_radps(), 0.3 - 1e-4);
    EXPECT_LT(it.largest_speed_radps(), 0.31);
  }
}

TEST(TableReference, TwoPointsAndTwoPointsThatRepeat) {
  const TableReference once = table("t_s,u1_x_rad,u1_y_rad\n0,0,0\n1,0.2,0\n");
  ASSERT_EQ(refusal(once), "");
  EXPECT_NEAR(at(once, 0.5).u[0], 0.1, 1e-15);  // a cubic at rest at both ends
  EXPECT_NEAR(at(once, 0.5).velocity[0], 0.3, 1e-15);
  const TableReference again = table("t_s,u1_x_rad,u1_y_rad\n0,0,0\n1,0.2,0\n2,0,0\n", 1, true);
  ASSERT_EQ(refusal(again), "");
  EXPECT_NEAR(at(again, 1.5).u[0], 0.1, 1e-15);
  EXPECT_NEAR(at(again, 7.0).u[0], 0.2, 1e-15);
  EXPECT_NEAR(at(again, 7.0).velocity[0], 0.0, 1e-12);
}

TEST(TableReference, PolarColumnsAreTheSamePoints) {
  const TableReference polar = table(
      "t_s;phi1_rad;theta1_rad;phi2_rad;theta2_rad\n0;0;0;1;0,5\n1;1,5;0,3;-2;0,25\n2;0;0;0;0\n",
      2);
  ASSERT_EQ(refusal(polar, 2), "");
  const ReferenceSample middle = at(polar, 1.0, 2);
  EXPECT_NEAR(middle.u[0], 0.3 * std::cos(1.5), 1e-15);
  EXPECT_NEAR(middle.u[1], 0.3 * std::sin(1.5), 1e-15);
  EXPECT_NEAR(middle.u[3], 0.25 * std::sin(-2.0), 1e-15);
}

TEST(TableReference, APathOfTheTipIsOne) {
  const TableReference it = table("t_s,tip_x_m,tip_y_m,tip_z_m\n0,0,0,-0.3\n2,0.02,0,-0.3\n", 3);
  ASSERT_EQ(refusal(it, 3), "");
  ASSERT_TRUE(it.is_tip_path());
  EXPECT_TRUE(ReferenceKind(it).is_tip_path());
  EXPECT_LT((it.tip(1.0).position_m - Eigen::Vector3d(0.01, 0.0, -0.3)).norm(), 1e-15);
  EXPECT_NEAR(it.tip(1.0).velocity_mps.x(), 0.015, 1e-15);
  EXPECT_EQ(it.tip(5.0).velocity_mps.norm(), 0.0);
  EXPECT_FALSE(ReferenceKind(table("t_s,u1_x_rad,u1_y_rad\n0,0,0\n1,0,0\n")).is_tip_path());
}

TEST(TableReference, EveryFaultHasItsReason) {
  const auto refuses = [](const std::string& text, const std::string& reason, int segments = 1,
                          bool repeat = false) {
    const std::string why = refusal(table(text, segments, repeat), segments);
    EXPECT_NE(why.find(reason), std::string::npos) << text << "gave: " << why;
    EXPECT_NE(why.find("reference[0].file"), std::string::npos) << why;
  };
  const std::string names = "t_s,u1_x_rad,u1_y_rad\n";
  refuses(names + "0,0,0\n", "two points");
  refuses("time,u1_x_rad,u1_y_rad\n0,0,0\n1,0,0\n", "expected a column t_s");
  refuses("t_s,a,b\n0,0,0\n1,0,0\n", "none of them");
  refuses("t_s,u1_x_rad,u1_y_rad,tip_x_m,tip_y_m,tip_z_m\n0,0,0,0,0,0\n1,0,0,0,0,0\n",
          "several of them");
  refuses(names + "0,0,0\n1,0,0\n", "expected a column u2_x_rad", 2);
  refuses("t_s,u1_x_rad,u1_y_rad,u2_x_rad,u2_y_rad\n0,0,0,0,0\n1,0,0,0,0\n", "got more");
  refuses(names + "0,0,0\n0,0.1,0\n", "table.csv:3: expected a time later");
  refuses(names + "0,0,0\n1,abc,0\n", "u1_x_rad: expected a number, got \"abc\"");
  refuses(names + "0,0,0\n1,nan,0\n", "expected a number");
  refuses(names + "0,0,0\n1,0.1,0\n", "equal the first", 1, true);
  refuses(names + "0,0,0\n0.001,0.1,0\n", "max_acceleration_radps2");
  refuses("t_s,tip_x_m,tip_y_m,tip_z_m\n0,0,0,0\n0.1,1,0,0\n", "max_tip_speed_mps");
  TableReference missing;
  missing.load("/nowhere/at/all.csv", 1);
  EXPECT_NE(refusal(missing).find("can be read"), std::string::npos) << refusal(missing);
}

TEST(TableReference, LimitsOfTheControllerApply) {
  const auto constructed = [](const std::string& rows) -> std::string {
    try {
      TableReference fast = table("t_s,u1_x_rad,u1_y_rad\n" + rows);
      fast.max_acceleration_radps2 = 1e5;
      Reference({{{fast, 0.0}}}, test::gains(1, 1.0, 0.0), 1);
    } catch (const ReferenceError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(constructed("0,0,0\n1,1,0\n2,0,0\n"), "");
  EXPECT_NE(constructed("0,0,0\n2,2.6,0\n4,0,0\n").find("max_theta_rad"), std::string::npos);
  EXPECT_NE(constructed("0,0,0\n0.1,2,0\n0.2,0,0\n").find("max_speed_radps"), std::string::npos);
}

}  // namespace
}  // namespace softarm
