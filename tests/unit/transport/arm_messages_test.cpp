// What is on the wire as plain values: each in its place, and nothing taken that is not one
// message.
#include "softarm/transport/arm_messages.hpp"

#include <gtest/gtest.h>

#include "unit/transport/messages.hpp"

namespace softarm {
namespace {

using namespace softarm_messages;
using test::encoded;
using test::example;

TEST(ArmMessages, AStatusComesAsWhatItMeans) {
  auto message = example<controller_status_t>(3, 4);
  message.time_us = 11;
  message.frame_number = 12;
  message.configuration_hash = -1;
  message.mode = 4;
  message.reason = static_cast<std::int8_t>(Reason::frames_stale);
  message.flags = controller_status_t::SHADOW | controller_status_t::BOUNDED;
  message.frames_rejected = 13;
  message.overruns = 14;
  ArmStatus status;
  status.u_rad = SegmentVector::Constant(20, 9.0);  // of another arm, before
  ASSERT_TRUE(decode(encoded(message), status));
  EXPECT_EQ(status.time_us, 11);
  EXPECT_EQ(status.tick, 17);
  EXPECT_EQ(status.frame_number, 12);
  EXPECT_EQ(status.configuration_hash, ~std::uint64_t{0});
  EXPECT_EQ(status.version, message.version);
  EXPECT_EQ(status.text(), "VENT (frames_stale)");
  EXPECT_TRUE(status.shadow && status.bounded);
  EXPECT_FALSE(status.armed || status.saturated || status.slew_limited ||
               status.reference_limited || status.soft_limit);
  EXPECT_FLOAT_EQ(static_cast<float>(status.frame_age_s), 0.005F);
  EXPECT_EQ(status.frames_rejected, 13);
  EXPECT_EQ(status.overruns, 14);
  EXPECT_EQ(status.messages_malformed, 3);
  EXPECT_EQ(status.references_refused[5], 15);
  EXPECT_EQ(status.law_answers[6], 26);
  EXPECT_FLOAT_EQ(static_cast<float>(status.law_round_trip_s), 0.0015F);
  EXPECT_EQ(status.segments(), 3);
  // pairs(3, first): first, first + 0.25; first + 1, ...
  EXPECT_EQ(status.u_rad, (SegmentVector(6) << 1.0, 1.25, 2.0, 2.25, 3.0, 3.25).finished());
  EXPECT_EQ(status.velocity_radps[5], 102.25);
  EXPECT_EQ(status.reference_u_rad[0], 200.0);
  EXPECT_EQ(status.phi_rad, (SegmentVector(3) << 300.0, 300.25, 300.5).finished());
  EXPECT_EQ(status.theta_rad[2], 400.5);
  EXPECT_EQ(status.tau_actuation_nm[1], 500.25);
  EXPECT_EQ(status.torsion_rad[0], 600.0);
  EXPECT_EQ(status.length_error_m[1], 700.25);
  ASSERT_EQ(status.pressure_bar.size(), 12);
  EXPECT_EQ(status.pressure_bar[11], 802.75);
}

TEST(ArmMessages, ElongationsComeWhereSegmentsStretchAndOnlyOfAllSegments) {
  auto message = example<controller_status_t>(3, 4);
  ArmStatus status;
  status.elongation_m = SegmentScalars::Constant(7, 9.0);  // of another arm, before
  ASSERT_TRUE(decode(encoded(message), status));
  EXPECT_EQ(status.elongation_m.size(), 0);
  const auto stretching = [&](std::int16_t count) {
    message.num_stretching = count;
    const auto n = static_cast<std::size_t>(count);
    message.elongation_m.assign(n, 0.25F);
    message.elongation_rate_mps.assign(n, 0.5F);
    message.reference_elongation_m.assign(n, 0.75F);
    message.axial_force_n.assign(n, 32.0F);
    return encoded(message);
  };
  ASSERT_TRUE(decode(stretching(3), status));
  EXPECT_EQ(status.elongation_m, SegmentScalars::Constant(3, 0.25));
  EXPECT_EQ(status.elongation_rate_mps[2], 0.5);
  EXPECT_EQ(status.reference_elongation_m[0], 0.75);
  EXPECT_EQ(status.axial_force_n[1], 32.0);
  EXPECT_EQ(status.pressure_bar[11], 802.75);
  for (const int wrong : {1, 2, 4}) {
    EXPECT_FALSE(decode(stretching(static_cast<std::int16_t>(wrong)), status));
  }

  auto truth = example<plant_state_t>(2, 4);
  PlantState state;
  ASSERT_TRUE(decode(encoded(truth), state));
  EXPECT_EQ(state.elongation_m.size(), 0);
  truth.num_stretching = 2;
  truth.elongation_m = {0.01, 0.02};
  truth.elongation_rate_mps = {0.1, 0.2};
  ASSERT_TRUE(decode(encoded(truth), state));
  EXPECT_EQ(state.elongation_m[1], 0.02);
  EXPECT_EQ(state.elongation_rate_mps[0], 0.1);
  truth.num_stretching = 1;
  truth.elongation_m = truth.elongation_rate_mps = {0.0};
  EXPECT_FALSE(decode(encoded(truth), state));
}

TEST(ArmMessages, EveryFlagIsItsOwn) {
  const std::pair<std::int16_t, bool ArmStatus::*> flags[] = {
      {controller_status_t::SATURATED, &ArmStatus::saturated},
      {controller_status_t::SLEW_LIMITED, &ArmStatus::slew_limited},
      {controller_status_t::REFERENCE_LIMITED, &ArmStatus::reference_limited},
      {controller_status_t::SOFT_LIMIT, &ArmStatus::soft_limit},
      {controller_status_t::SHADOW, &ArmStatus::shadow},
      {controller_status_t::ARMED, &ArmStatus::armed},
      {controller_status_t::BOUNDED, &ArmStatus::bounded},
      {controller_status_t::LENGTH, &ArmStatus::length_warning}};
  for (const auto& [flag, set] : flags) {
    auto message = example<controller_status_t>(1, 3);
    message.flags = flag;
    ArmStatus status;
    ASSERT_TRUE(decode(encoded(message), status));
    for (const auto& each : flags) EXPECT_EQ(status.*each.second, each.first == flag) << flag;
  }
}

TEST(ArmMessages, AnObserverKeepsItsUnits) {
  ObserverStatus observer;
  auto message = example<observer_status_t>(3, 4);
  message.flags |= observer_status_t::CONTACT;
  ASSERT_TRUE(decode(encoded(message), observer));
  const ObserverReport& report = observer.report;
  EXPECT_EQ(observer.time_us, 47);
  EXPECT_EQ(observer.tick, 48);
  EXPECT_EQ(report.segments, 3);
  EXPECT_TRUE(report.running && report.contact);
  EXPECT_FALSE(report.surprised || report.wrong_model || report.pressure_loss);
  EXPECT_EQ(report.failures, 2);
  EXPECT_EQ(report.nis, 0.75);
  EXPECT_EQ(report.force_n, Eigen::Vector3d(0.0, 0.0, -3.0));
  EXPECT_EQ(report.force_covariance_n2(1, 1), 4.0);
  // numbers(3, first): first, first + 0.25, ...; pairs likewise, each with its first one larger by 1.
  EXPECT_EQ(report.correction.segment[2].stiffness, 1.5);
  EXPECT_EQ(report.correction.segment[1].damping, 100.25);
  EXPECT_EQ(report.correction.segment[0].gain, 200.0);
  EXPECT_EQ(report.correction.segment[2].load, Eigen::Vector2d(302.0, 302.25));
  EXPECT_EQ(report.correction.disturbance_nm[5], 402.25);
  EXPECT_EQ(report.deviation.segment[1].stiffness, 500.25);
  EXPECT_EQ(report.deviation.segment[2].damping, 600.5);
  EXPECT_EQ(report.deviation.segment[0].gain, 700.0);
  EXPECT_EQ(report.deviation.segment[1].load, Eigen::Vector2d(801.0, 801.25));
  EXPECT_EQ(report.deviation.disturbance_nm[0], 900.0);
}

TEST(ArmMessages, WhatAnObserverKnowsOfElongationsComesWhereSegmentsStretch) {
  auto message = example<observer_status_t>(2, 4);
  ObserverStatus observer;
  observer.report.elongation_m = SegmentScalars::Constant(7, 9.0);  // of another arm, before
  ASSERT_TRUE(decode(encoded(message), observer));
  EXPECT_EQ(observer.report.elongation_m.size(), 0);
  EXPECT_EQ(observer.report.correction.segment[1].axial_gain, 0.0);
  const std::size_t without = encoded(message).size();
  const auto stretching = [&](int count) {
    message.num_stretching = static_cast<std::int16_t>(count);
    double first = 1.0;
    for (auto* list : {&message.elongation_m, &message.axial_force_n, &message.axial_stiffness,
                       &message.axial_damping, &message.axial_gain, &message.elongation_deviation_m,
                       &message.axial_force_deviation_n, &message.axial_stiffness_deviation,
                       &message.axial_damping_deviation, &message.axial_gain_deviation})
      *list = test::numbers<float>(count, first++);
    return encoded(message);
  };
  ASSERT_TRUE(decode(stretching(2), observer));
  EXPECT_EQ(encoded(message).size(), without + 80);
  const ObserverReport& report = observer.report;
  EXPECT_EQ(report.elongation_m, (SegmentScalars(2) << 1.0, 1.25).finished());
  EXPECT_EQ(report.elongation_deviation_m, (SegmentScalars(2) << 6.0, 6.25).finished());
  const SegmentCorrection& is = report.correction.segment[1];
  const SegmentCorrection& sigma = report.deviation.segment[1];
  EXPECT_EQ(is.axial_force_n, 2.25);
  EXPECT_EQ(is.axial_stiffness, 3.25);
  EXPECT_EQ(is.axial_damping, 4.25);
  EXPECT_EQ(is.axial_gain, 5.25);
  EXPECT_EQ(is.stiffness, 1.25);
  EXPECT_EQ(sigma.axial_force_n, 7.25);
  EXPECT_EQ(sigma.axial_stiffness, 8.25);
  EXPECT_EQ(sigma.axial_damping, 9.25);
  EXPECT_EQ(sigma.axial_gain, 10.25);
  for (const int wrong : {1, 3}) EXPECT_FALSE(decode(stretching(wrong), observer)) << wrong;
}

TEST(ArmMessages, MayPressuriseWhereItIsArmedOrHolds) {
  for (const Mode mode :
       {Mode::init, Mode::wait_frames, Mode::active, Mode::hold, Mode::vent, Mode::fault})
    for (const bool armed : {false, true}) {
      ArmStatus status;
      status.mode = mode;
      status.armed = armed;
      EXPECT_EQ(status.may_pressurise(), armed || mode == Mode::active || mode == Mode::hold);
    }
}

TEST(ArmMessages, APlantAndCommandsOfBothKinds) {
  PlantState plant;
  ASSERT_TRUE(decode(encoded(example<plant_state_t>(2, 3)), plant));
  EXPECT_EQ(plant.segments(), 2);
  EXPECT_TRUE(plant.vented);
  EXPECT_EQ(plant.u_rad, (SegmentVector(4) << 1.0, 1.25, 2.0, 2.25).finished());
  EXPECT_EQ(plant.velocity_radps[3], 51.25);
  EXPECT_EQ(plant.pressure_bar[5], 1.25);
  EXPECT_EQ(plant.tip_m, Eigen::Vector3d(0.0, 1.0, 2.0));

  ChamberCommand command;
  ASSERT_TRUE(decode(encoded(example<pressure_command_t>(1, 3)), false, command));
  EXPECT_EQ(command.sequence, 42);
  EXPECT_EQ(command.time_us, 43);
  EXPECT_EQ(command.validity_us, 100'000);
  EXPECT_TRUE(command.shadow);
  EXPECT_EQ(command.pressure_bar, (PressureVector(3) << 0.5, 0.75, 1.0).finished());
  ASSERT_TRUE(decode(encoded(example<torque_command_t>(1, 3)), true, command));
  EXPECT_FALSE(command.shadow);
  EXPECT_EQ(command.pressure_bar, (PressureVector(2) << -0.5, -0.25).finished());
}

TEST(ArmMessages, WhatIsNotExactlyOneMessageIsRefused) {
  ArmStatus status;
  PlantState plant;
  ChamberCommand command;
  auto bytes = encoded(example<controller_status_t>(3, 4));
  EXPECT_FALSE(decode(bytes, plant));
  EXPECT_FALSE(decode(bytes, false, command));
  EXPECT_FALSE(decode(encoded(example<torque_command_t>(1, 3)), false, command));
  EXPECT_FALSE(decode(encoded(example<pressure_command_t>(1, 3)), true, command));
  bytes.push_back({});
  EXPECT_FALSE(decode(bytes, status));
  bytes.resize(bytes.size() - 2);
  EXPECT_FALSE(decode(bytes, status));
  EXPECT_FALSE(decode({}, status));
}

}  // namespace
}  // namespace softarm
