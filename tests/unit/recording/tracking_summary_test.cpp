// The few numbers of a run against errors that were put into its rows.
#include "softarm/recording/tracking_summary.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace softarm {
namespace {

constexpr double kPeriod_s = 0.01;

/// Of an arm of two segments that follows its reference exactly.
LogRow row_at(double t_s, Mode mode) {
  LogRow row;
  row.t_s = t_s;
  row.mode = mode;
  row.reference.resize(4);
  row.reference << 0.3, 0.1, -0.2, 0.4;
  row.truth = row.reference;
  row.commanded.resize(3);
  row.commanded << 0.1, 0.5, 0.2;
  return row;
}

nlohmann::json json_of(const TrackingSummary& summary) {
  return nlohmann::json::parse(summary.json());
}

TEST(TrackingSummary, ErrorsCountFromSomeTimeAfterActiveOn) {
  TrackingSummary summary(2, 0.5);
  for (int k = 0; k < 200; ++k) {
    LogRow row = row_at(kPeriod_s * k, k < 50 ? Mode::wait_frames : Mode::active);
    row.truth[0] -= k < 100 ? 1.0 : 0.02;  // the first second counts for nothing
    row.saturated = k % 3 == 0;
    summary.add(row, kPeriod_s);
  }
  const nlohmann::json json = json_of(summary);
  EXPECT_NEAR(json["duration_s"], 2.0, 1e-12);
  EXPECT_EQ(json["ticks"], 200);
  EXPECT_NEAR(json["tracking"]["u_rms_rad"], 0.02 / 2.0, 1e-15);  // of four components one is off
  EXPECT_NEAR(json["tracking"]["u_max_rad"], 0.02, 1e-15);
  EXPECT_NEAR(json["tracking"]["u_rms_segment_rad"][0], 0.02 / std::sqrt(2.0), 1e-15);
  EXPECT_EQ(json["tracking"]["u_rms_segment_rad"][1], 0.0);
  EXPECT_NEAR(json["tracking"]["theta_rms_rad"][0], std::hypot(0.3, 0.1) - std::hypot(0.28, 0.1),
              1e-12);
  EXPECT_NEAR(json["tracking"]["phi_rms_rad"][0], std::atan2(0.1, 0.28) - std::atan2(0.1, 0.3),
              1e-12);
  EXPECT_NEAR(json["saturated_fraction"], 50.0 / 150.0, 1e-12);
  EXPECT_EQ(json["pressure_bar"]["max"], 0.5);
  EXPECT_NEAR(json["modes"]["WAIT_FRAMES"], 0.5, 1e-12);
  EXPECT_NEAR(json["modes"]["ACTIVE"], 1.5, 1e-12);
  EXPECT_FALSE(json["modes"].contains("HOLD"));
  EXPECT_FALSE(json.contains("frames"));
}

/// phi is an angle: on both sides of pi it differs by little; and it means nothing near straight.
TEST(TrackingSummary, PhiIsComparedAcrossPiAndNotNearStraight) {
  TrackingSummary summary(2, 0.0);
  LogRow row = row_at(0.0, Mode::active);
  row.reference << 0.5 * std::cos(M_PI - 0.01), 0.5 * std::sin(M_PI - 0.01), 0.01, 0.0;
  row.truth << 0.5 * std::cos(M_PI + 0.02), 0.5 * std::sin(M_PI + 0.02), -0.01, 0.0;
  summary.add(row, kPeriod_s);
  const nlohmann::json json = json_of(summary);
  EXPECT_NEAR(json["tracking"]["phi_rms_rad"][0], 0.03, 1e-12);
  EXPECT_TRUE(json["tracking"]["phi_rms_rad"][1].is_null());
  EXPECT_NEAR(json["tracking"]["theta_rms_rad"][0], 0.0, 1e-12);
}

TEST(TrackingSummary, TransitionsAreTheChangesOfModeWithTheirReasons) {
  TrackingSummary summary(2, 0.0);
  const Mode modes[] = {Mode::init, Mode::active, Mode::active, Mode::hold, Mode::active};
  for (int k = 0; k < 5; ++k) {
    LogRow row = row_at(kPeriod_s * k, modes[k]);
    if (modes[k] == Mode::hold) row.reason = Reason::frames_late;
    summary.add(row, kPeriod_s);
  }
  ASSERT_EQ(summary.transitions().size(), 4U);
  EXPECT_EQ(summary.transitions()[2].mode, Mode::hold);
  EXPECT_EQ(summary.transitions()[2].reason, Reason::frames_late);
  EXPECT_DOUBLE_EQ(summary.transitions()[3].t_s, 0.04);
  const nlohmann::json json = json_of(summary);
  EXPECT_EQ(json["transitions"][2]["mode"], "HOLD");
  EXPECT_EQ(json["transitions"][2]["reason"], "frames_late");
}

TEST(TrackingSummary, ATipHasArrivedOnceItStaysNear) {
  TrackingSummary summary(2, 0.0);
  for (int k = 0; k < 100; ++k) {
    LogRow row = row_at(kPeriod_s * k, Mode::active);
    row.tip_is_asked = true;
    row.tip = Eigen::Vector3d(0.1, 0.0, -0.3);
    row.tip_reference = *row.tip;
    row.tip_reference->x() += k < 40 ? 0.05 : 0.004;
    summary.add(row, kPeriod_s);
  }
  const nlohmann::json tracking = json_of(summary)["tracking"];
  EXPECT_NEAR(tracking["tip_max_m"], 0.05, 1e-12);
  EXPECT_NEAR(tracking["tip_rms_second_half_m"], 0.004, 1e-12);
  EXPECT_NEAR(tracking["tip_near_after_s"], 0.39, 1e-9);
  EXPECT_NE(summary.table().find("within 10 mm for good 0.39 s after ACTIVE"), std::string::npos)
      << summary.table();
}

TEST(TrackingSummary, WhatIsNotKnownIsNullAndSaidSo) {
  TrackingSummary summary(1, 0.0);
  LogRow row;
  row.mode = Mode::active;
  summary.add(row, kPeriod_s);
  EXPECT_TRUE(json_of(summary)["tracking"]["u_rms_rad"].is_null());
  EXPECT_TRUE(json_of(summary)["tracking"]["tip_rms_m"].is_null());
  EXPECT_NE(summary.table().find("the true state is not known"), std::string::npos);
}

TEST(TrackingSummary, WhatTheObserverLearntAlongSegmentsIsShownWithUnitsWhereTheyStretch) {
  LogRow row = row_at(0.0, Mode::active);
  row.observer.emplace();
  row.observer->segments = 2;
  row.observer->running = true;
  row.observer->correction.disturbance_nm.setZero(4);
  for (const bool stretches : {false, true}) {
    if (stretches) {
      row.observer->elongation_m = SegmentScalars::Constant(2, 0.0125);
      row.observer->elongation_deviation_m = SegmentScalars::Constant(2, 0.0001);
      row.observer->correction.segment[1].axial_stiffness = 0.2;
      row.observer->correction.segment[1].axial_force_n = -1.5;
      row.observer->deviation.segment[1].axial_gain = 0.03;
    }
    TrackingSummary summary(2, 0.0);
    summary.add(row, kPeriod_s);
    const nlohmann::json json = json_of(summary)["observer"];
    EXPECT_EQ(json["correction"].contains("elongation_m"), stretches);
    EXPECT_EQ(summary.table().find("elongation [mm]") != std::string::npos, stretches);
    if (!stretches) continue;
    EXPECT_EQ(json["correction"]["elongation_m"], (std::vector<double>{0.0125, 0.0125}));
    EXPECT_EQ(json["correction"]["axial_stiffness"][1], 0.2);
    EXPECT_EQ(json["correction"]["axial_force_n"][1], -1.5);
    EXPECT_EQ(json["deviation"]["axial_gain"], (std::vector<double>{0.0, 0.03}));
    EXPECT_NE(summary.table().find("+12.50 +- 0.10"), std::string::npos);
    EXPECT_NE(summary.table().find("+20.0 +- 0.0"), std::string::npos);
    EXPECT_NE(summary.table().find("-1.50 +- 0.00"), std::string::npos);
  }
}

TEST(TrackingSummary, FramesAndMomentsAreReportedWhereThereAreAny) {
  TrackingSummary summary(2, 0.0);
  summary.commands_are_torques();
  LogRow row = row_at(0.0, Mode::active);
  row.commanded << -1.5, 0.5, 0.2;
  summary.add(row, kPeriod_s);
  FrameCounters frames;
  frames.accepted = 30;
  frames.missing = 2;
  summary.set_frames(frames, 5);
  const nlohmann::json json = json_of(summary);
  EXPECT_EQ(json["torque_nm"]["max"], 1.5);
  EXPECT_EQ(json["frames"]["accepted"], 30);
  EXPECT_EQ(json["frames"]["missing"], 2);
  EXPECT_EQ(json["frames"]["late"], 5);
  EXPECT_EQ(summary.json(), summary.json());
}

}  // namespace
}  // namespace softarm
