// Pairs of thresholds of which one hides the other, so that it would never come into force.
#include <vector>

#include "config_files.hpp"
#include "softarm/config/load.hpp"

namespace softarm {
namespace {

struct Hidden {
  const char* daemon;    ///< keys of the section daemon
  const char* other;     ///< further sections
  const char* key;       ///< that is blamed
  const char* evidence;  ///< part of the message
};

void PrintTo(const Hidden& hidden, std::ostream* out) { *out << hidden.daemon << hidden.other; }

std::string experiment_text(const char* daemon, const char* other) {
  return std::string(R"(name: thresholds
arm: {segments: 2, length_m: 0.25, mass_kg: 0.25, stiffness_nm_per_rad: 2, damping_nms_per_rad: 0.5}
actuation: {chambers: {angle_rad: [0, 2, 4], gain_nm_per_bar: 1}, max_pressure_bar: 1}
control: {kp_nm_per_rad: 1, max_speed_radps: 20}
reference: [{kind: set_point, theta_rad: 0.2}]
daemon: {)") +
         daemon + "}\n" + other;
}

const Hidden kHidden[] = {
    // HOLD comes before VENT, whether their thresholds are given or derived.
    {"safety: {hold_after_s: 0.5}", "", "daemon.safety.hold_after_s", "vent_after_s"},
    {"safety: {hold_after_s: 0.1}", "", "daemon.safety.hold_after_s", "(0.1 s)"},
    {"safety: {hold_after_s: 0.5, vent_after_s: 0.4}", "", "daemon.safety.vent_after_s", "(0.5 s)"},
    {"safety: {hold_after_s: 0.5, vent_after_s: 0.5}", "", "daemon.safety.vent_after_s", "HOLD"},
    {"safety: {vent_after_s: 0.01}", "", "daemon.safety.vent_after_s", "hold_after_s"},
    {"safety: {frame_latency_s: 0.2, max_latency_s: 0.3}", "", "daemon.safety.vent_after_s",
     "(0.215 s)"},
    {"rate_hz: 20", "", "daemon.safety.vent_after_s", "(0.15 s)"},
    // A frame is as old as a period and the latency before the next one comes.
    {"safety: {hold_after_s: 0.005}", "", "daemon.safety.hold_after_s", "frame_period_s"},
    {"safety: {hold_after_s: 0.02, frame_latency_s: 0.015}", "", "daemon.safety.hold_after_s",
     "frame_latency_s (0.02 s)"},
    {"safety: {hold_overruns: 10, vent_overruns: 10}", "", "daemon.safety.vent_overruns",
     "more than hold_overruns (10): otherwise they never cause HOLD, got 10"},
    {"", "estimation: {max_speed_radps: 20}\n", "estimation.max_speed_radps",
     "control.max_speed_radps"},
    {"safety: {valve_readback: true, pressure_tolerance_bar: 1}", "",
     "daemon.safety.pressure_tolerance_bar", "actuation.max_pressure_bar"},
    {"", "valves: {stuck_bar: 1}\n", "valves.stuck_bar", "actuation.max_pressure_bar"},
};

class HiddenThreshold : public testing::TestWithParam<Hidden> {};

TEST_P(HiddenThreshold, IsRefusedAtItsKey) {
  const Hidden& hidden = GetParam();
  const TestFolder folder;
  try {
    load_experiment(folder.write("e.yaml", experiment_text(hidden.daemon, hidden.other)));
    FAIL() << "accepted";
  } catch (const ConfigError& error) {
    EXPECT_EQ(error.key, hidden.key) << error.what();
    EXPECT_NE(std::string(error.what()).find(hidden.evidence), std::string::npos) << error.what();
  }
}
INSTANTIATE_TEST_SUITE_P(Pairs, HiddenThreshold, testing::ValuesIn(kHidden));

TEST(Thresholds, ThatComeIntoForceAreAccepted) {
  const TestFolder folder;
  for (const auto& [daemon, other] : std::vector<std::pair<const char*, const char*>>{
           {"", ""},
           {"safety: {hold_after_s: 0.5, vent_after_s: 1}", ""},
           {"safety: {hold_after_s: 0.09}", ""},
           {"safety: {vent_after_s: 0.02}", ""},
           {"rate_hz: 20, safety: {vent_after_s: 0.3}", ""},
           {"safety: {frame_period_s: 0.04, frame_latency_s: 0.01}", ""},
           {"safety: {pressure_tolerance_bar: 5}", ""},  // nothing is read back
           {"safety: {valve_readback: true, pressure_tolerance_bar: 0}", ""},
           {"safety: {valve_readback: true}", "valves: {stuck_bar: 0.9}\n"}})
    EXPECT_NO_THROW(load_experiment(folder.write("e.yaml", experiment_text(daemon, other))))
        << daemon << other;
}

/// The first is the daemon's, the second the valve driver's: both may be meant.
TEST(Thresholds, ToleratedFailuresThatTheDaemonDoesNotBearAreWarnedOf) {
  const TestFolder folder;
  const auto warnings = [&](const char* valves) {
    return experiment_warnings(load_experiment(
        folder.write("e.yaml", experiment_text("safety: {valve_readback: true}", valves))));
  };
  EXPECT_TRUE(warnings("valves: {tolerated_failures: 18, failsafe_timeout_s: 1}\n").empty());
  const auto some = warnings("valves: {tolerated_failures: 19, failsafe_timeout_s: 1}\n");
  ASSERT_EQ(some.size(), 1u);
  EXPECT_NE(some[0].find("valves.tolerated_failures"), std::string::npos) << some[0];
}

}  // namespace
}  // namespace softarm
