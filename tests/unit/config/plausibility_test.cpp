// Slips of units and settings that would disable what protects: refused where harm would follow,
// warned of else. And what the thresholds come to, in words.
#include <algorithm>
#include <vector>

#include "config_files.hpp"
#include "softarm/config/load.hpp"

namespace softarm {
namespace {

std::string experiment_text(const std::string& sections, const std::string& daemon = "",
                            const std::string& reference = "{kind: set_point, theta_rad: 0.2}") {
  return "include: " + (kConfigFolder / "paper_arm.yaml").string() + "\nname: slip\nreference: [" +
         reference + "]\n" + sections + (daemon.empty() ? "" : "daemon: {" + daemon + "}\n");
}

struct Slip {
  const char* sections;
  const char* daemon;
  const char* key;       ///< that is blamed
  const char* evidence;  ///< part of the message
};
void PrintTo(const Slip& slip, std::ostream* out) { *out << slip.sections << slip.daemon; }

const Slip kRefused[] = {
    // Milliseconds for seconds: the watchdog of the frames.
    {"", "safety: {frame_period_s: 8.333}", "daemon.safety.frame_period_s", "(0, 0.2] s"},
    {"", "safety: {frame_latency_s: 5}", "daemon.safety.frame_latency_s", "[0, 0.5] s"},
    {"", "safety: {hold_after_s: 20, vent_after_s: 100}", "daemon.safety.hold_after_s", "[0, 1] s"},
    {"", "safety: {vent_after_s: 100}", "daemon.safety.vent_after_s", "[0, 2] s"},
    {"", "safety: {max_latency_s: 10}", "daemon.safety.max_latency_s", "(0, 0.5] s"},
    {"", "safety: {valve_silence_s: 10}", "daemon.safety.valve_silence_s", "(0, 2] s"},
    {"", "safety: {deadman_timeout_s: 10}", "daemon.safety.deadman_timeout_s", "(0, 2] s"},
    {"", "safety: {pressure_settling_s: 10}", "daemon.safety.pressure_settling_s", "(0, 2] s"},
    {"", "safety: {frozen_frames: 100000}", "daemon.safety.frozen_frames", "[0, 1000]"},
    {"", "safety: {hold_overruns: 3, vent_overruns: 1000}", "daemon.safety.vent_overruns",
     "at most 1 s of ticks"},
    {"", "lcm: {command_validity_s: 1}", "daemon.lcm.command_validity_s", "(0, 0.5] s"},
    {"valves: {failsafe_timeout_s: 5}\n", "", "valves.failsafe_timeout_s", "(0, 1] s"},
    // Tolerances that accept everything.
    {"estimation: {quaternion_tolerance: 1}\n", "", "estimation.quaternion_tolerance", "0.1]"},
    {"estimation: {length_tolerance: 30}\n", "", "estimation.length_tolerance", "(0, 1]"},
    {"estimation: {torsion_tolerance_rad: 3}\n", "", "estimation.torsion_tolerance_rad",
     "1.2] rad"},
    {"estimation: {max_speed_radps: 5000}\n", "", "estimation.max_speed_radps", "200] rad/s"},
    {"estimation: {position_noise_m: 0.2}\n", "", "estimation.position_noise_m", "0.02] m"},
    {"control: {max_speed_radps: 1000}\n", "", "control.max_speed_radps", "100] rad/s"},
    // What repeats is learnt from what the observer finds, and where the reference repeats.
    {"control: {repetition: {lead_s: 0.1, period_s: 3}}\n", "", "control.repetition.lead_s",
     "0 s without estimation.observer: model"},
    {"estimation: {observer: model}\ncontrol: {disturbance: none, repetition: {lead_s: 0.1, "
     "period_s: 3}}\n",
     "", "control.repetition.lead_s", "0 s without control.disturbance: cancel"},
    {"estimation: {observer: model}\ncontrol: {repetition: {lead_s: 0.1}}\n", "",
     "control.repetition.lead_s", "0 s where no phase of the reference repeats"},
    {"estimation: {observer: model}\ncontrol: {repetition: {lead_s: 0.6, period_s: 1}}\n", "",
     "control.repetition.lead_s", "less than half of the period (0.5 s)"},
    {"estimation: {observer: model}\ncontrol: {repetition: {lead_s: 0.01, period_s: 0.1}}\n", "",
     "control.repetition.period_s", "(0.128 s)"},
    {"control: {valve_lag_s: 5}\n", "", "control.valve_lag_s", "[0, 2] s"},
    {"control: {delay_s: 5}\n", "", "control.delay_s", "[0, 0.5] s"},
    // An unstable loop swings at one to two Hz, whatever its reference does.
    {"", "safety: {oscillation_lowest_hz: 1000}", "daemon.safety.oscillation_lowest_hz",
     "(0, 1] Hz"},
    {"", "safety: {oscillation_part: 50}", "daemon.safety.oscillation_part", "[0, 1]"},
    {"valves: {vented_bar: 0.9}\n", "", "valves.vented_bar", "(0, 0.3] bar"},
    // Ticks at which frames, or the ramp, cannot do their work.
    {"",
     "rate_hz: 5, safety: {valve_silence_s: 1, deadman_timeout_s: 1, vent_after_s: 2}, lcm: "
     "{command_validity_s: 0.5}",
     "daemon.rate_hz", "good_frames in a row never come"},
    {"",
     "rate_hz: 4, safety: {valve_silence_s: 1, deadman_timeout_s: 1, vent_after_s: 2, "
     "max_latency_s: 0.5, frame_period_s: 0.02}, "
     "lcm: {command_validity_s: 0.5}",
     "daemon.rate_hz", "a stop takes less than 1 s"},
    {"",
     "rate_hz: 10, safety: {valve_silence_s: 1, deadman_timeout_s: 1, vent_after_s: 2, "
     "max_latency_s: 0.2, frame_period_s: 0.001}, "
     "lcm: {command_validity_s: 0.5}",
     "daemon.rate_hz", "64 frames"},
    // An arm that is not.
    {"arm: {gravity_mps2: [0, 0, 9.81]}\n", "", "arm.gravity_mps2", "not point up"},
    {"arm: {gravity_mps2: [0, 0, -98.1]}\n", "", "arm.gravity_mps2", "at most 20 m/s^2"},
    {"arm: {stiffness_nm_per_rad: 0}\n", "", "arm.stiffness_nm_per_rad", "(0, 10000]"},
    {"actuation: {chambers: {angle_rad: [0, 2, 4], gain_nm_per_bar: 839}}\n", "",
     "actuation.chambers", "2681 rad in segment 1"},
    {"", "bodies: {base_plate: {position_m: [8, 0, 0]}}", "daemon.bodies.base_plate.position_m",
     "8 m"},
    {"", "bodies: {segment_plates: {position_m: [0, 8, 0]}}",
     "daemon.bodies.segment_plates.position_m", "8 m"},
    // Times that are long with valves that may be real.
    {"valves: {host: 10.0.0.7}\n", "safety: {hold_after_s: 0.3, vent_after_s: 0.4}",
     "daemon.safety.hold_after_s", "0.25 s where real valves are driven"},
    {"valves: {host: 10.0.0.7}\n", "safety: {vent_after_s: 1}", "daemon.safety.vent_after_s",
     "0.5 s where real valves are driven"},
    {"valves: {host: 10.0.0.7}\n", "safety: {frame_period_s: 0.06}", "daemon.safety.vent_after_s",
     "got 0.6 s"},
};

class Refused : public testing::TestWithParam<Slip> {};

TEST_P(Refused, AtItsKey) {
  const Slip& slip = GetParam();
  const TestFolder folder;
  try {
    load_experiment(folder.write("e.yaml", experiment_text(slip.sections, slip.daemon)));
    FAIL() << "accepted";
  } catch (const ConfigError& error) {
    EXPECT_EQ(error.key.substr(0, error.key.find('[')), slip.key) << error.what();
    EXPECT_NE(std::string(error.what()).find(slip.evidence), std::string::npos) << error.what();
  }
}
INSTANTIATE_TEST_SUITE_P(Slips, Refused, testing::ValuesIn(kRefused));

TEST(Refused, DegreesForADirection) {
  const TestFolder folder;
  EXPECT_THROW(
      load_experiment(folder.write(
          "e.yaml", experiment_text("", "", "{kind: set_point, theta_rad: 0.2, phi_rad: 90}"))),
      ConfigError);
  EXPECT_THROW(load_experiment(folder.write(
                   "e.yaml", experiment_text("", "", "{kind: paper, phi_amplitude_rad: 60}"))),
               ConfigError);
}

std::vector<std::string> warnings(const std::string& text) {
  const TestFolder folder;
  return experiment_warnings(load_experiment(folder.write("e.yaml", text)));
}

TEST(Warned, OfWhatIsStrangeButHarmsNobody) {
  const auto warned = [](const std::string& text, const char* evidence) {
    const auto all = warnings(text);
    return std::any_of(all.begin(), all.end(), [&](const std::string& each) {
      return each.find(evidence) != std::string::npos;
    });
  };
  EXPECT_TRUE(warnings(experiment_text("")).empty());
  EXPECT_TRUE(warned(experiment_text("plant: {mocap: {rate_hz: 1000}}\n"), "declares 200 Hz"));
  EXPECT_TRUE(warned(experiment_text("plant: {mocap: {rate_hz: 1000}}\n"), "will stay vented"));
  EXPECT_TRUE(warned(experiment_text("plant: {valves: {lag_s: 5}}\n"), "plant.valves.lag_s"));
  EXPECT_TRUE(warned(experiment_text("arm: {gravity_mps2: [0, 0, -0.981]}\n"), "arm.gravity_mps2"));
  EXPECT_TRUE(
      warned(experiment_text("actuation: {max_pressure_bar: 20, vent_bar_per_s: 80, chambers: "
                             "{angle_rad: [0, 2, 4], gain_nm_per_bar: 0.1}}\n"),
             "max_pressure_bar: 20"));
  EXPECT_TRUE(warned(experiment_text("actuation: {chambers: {angle_rad: [0, 2, 4], "
                                     "gain_nm_per_bar: 0.839e-3}}\n"),
                     "bends segment 1 by 0.00268 rad"));
}

/// Inverse kinematics decide: points nearer than the arm is long may be out of reach all the same.
TEST(Warned, OfTipPathsOutOfReach) {
  const auto path = [](const char* keys) {
    return warnings(experiment_text("", "", std::string("{kind: ") + keys + "}"));
  };
  EXPECT_TRUE(path("tip_circle, centre_m: [0, 0, -0.3], first_axis_m: [0.05, 0, 0], second_axis_m: "
                   "[0, 0.05, 0], rate_radps: 1")
                  .empty());
  const auto beyond = path("tip_point, centre_m: [0, 0, -0.4]");
  ASSERT_EQ(beyond.size(), 1u);
  EXPECT_NE(beyond[0].find("the arm is 0.33 m long"), std::string::npos) << beyond[0];
  // Behind the base, within the arm's length.
  const auto behind = path("tip_point, centre_m: [0, 0, 0.28]");
  ASSERT_EQ(behind.size(), 1u);
  EXPECT_NE(behind[0].find("out of reach"), std::string::npos) << behind[0];
  const auto partly = path(
      "tip_circle, centre_m: [0, 0, 0], first_axis_m: [0.31, 0, 0], second_axis_m: "
      "[0, 0.02, 0], rate_radps: 1");
  ASSERT_EQ(partly.size(), 2u);
  EXPECT_NE(partly[0].find("% of the path are out of reach"), std::string::npos) << partly[0];
  EXPECT_NE(partly[1].find("chambers cannot hold"), std::string::npos) << partly[1];
}

TEST(Arming, IsExplicitByDefaultWhereValvesMayBeReal) {
  const TestFolder folder;
  const auto arming = [&](const std::string& valves, const std::string& safety = "") {
    return load_experiment(folder.write("e.yaml", experiment_text(valves, safety))).safety.arming;
  };
  EXPECT_EQ(arming(""), Arming::automatic);
  EXPECT_EQ(arming("valves: {host: 127.0.0.1, port: 1502}\n"), Arming::automatic);
  EXPECT_EQ(arming("valves: {host: 192.168.0.10}\n"), Arming::explicit_);
  EXPECT_EQ(arming("valves: {backend: serial_board, device: /dev/ttyACM0}\n"), Arming::explicit_);
  EXPECT_EQ(arming("valves: {host: 192.168.0.10}\n", "safety: {arming: automatic}"),
            Arming::automatic);
  const auto warned =
      warnings(experiment_text("valves: {host: 192.168.0.10}\n", "safety: {arming: automatic}"));
  ASSERT_EQ(warned.size(), 1u);
  EXPECT_NE(warned[0].find("daemon.safety.arming"), std::string::npos) << warned[0];
  EXPECT_TRUE(warnings(experiment_text("valves: {host: 192.168.0.10}\n")).empty());
}

TEST(ReactionTimes, SayWhatTheThresholdsComeTo) {
  const TestFolder folder;
  std::string text;
  for (const std::string& line : reaction_times(load_experiment(folder.write(
           "e.yaml",
           experiment_text("valves: {host: 10.0.0.7}\n",
                           "safety: {valve_readback: true}, lcm: {deadman_channel: GO}")))))
    text += line + "\n";
  for (const char* part :
       {"HOLD after 0.02 s, VENT after 0.1 s (4 and 20 declared frame periods)",
        "a vent takes at most 0.25 s from full pressure",
        "good frames before ACTIVE: 50, that is 0.25 s",
        "the valve side vents after 0.1 s (50 ticks)",
        "without a measured pressure: FAULT after 0.1 s", "dead-man input: VENT after 0.2 s",
        "HOLD after 0.006 s, VENT after 0.02 s",
        "the terminal vents by itself after 0.2 s; arming is explicit"})
    EXPECT_NE(text.find(part), std::string::npos) << part << "\nin\n" << text;
}

}  // namespace
}  // namespace softarm
