// Keys of the simulated arm and of actuation by torque: read, refused, printed and read again.
#include <gtest/gtest.h>

#include "softarm/config/config_error.hpp"
#include "softarm/config/load.hpp"
#include "softarm/control/control_laws.hpp"
#include "unit/config/config_files.hpp"

namespace softarm {
namespace {

constexpr const char* kArmOfLinks = R"(name: links
arm: {segments: 2, length_m: 0.25, mass_kg: 0.25, stiffness_nm_per_rad: 2, damping_nms_per_rad: 0.5}
actuation: {kind: torque, max_torque_nm: 20}
control: {kp_nm_per_rad: 1}
reference:
  - {kind: set_point, theta_rad: 0.2}
)";

constexpr const char* kPlant = R"(plant:
  kind: links
  links: {links_per_segment: 6, joint_stiffness_nm_per_rad: 12, joint_damping_nms_per_rad: 3}
  valves: {dead_time_s: 0.01, slew_bar_per_s: 500, resolution_bar: 0.01}
  loads:
    - {segment: 1, force_n: [1, 0, 0], start_s: 2, duration_s: 0.5}
    - {moment_nm: [0, 0.1, 0], shape: half_sine, start_s: 1, duration_s: 0.01}
  payload_kg: [0, 0.1]
  base_motion: {amplitude_m: [0.01, 0, 0], frequency_hz: 2}
)";

TEST(PlantKeys, AreReadAndWhatIsPrintedReadsTheSame) {
  const TestFolder folder;
  const Experiment first =
      load_experiment(folder.write("a.yaml", std::string(kArmOfLinks) + kPlant));
  const PlantSettings& plant = first.plant;
  EXPECT_EQ(first.actuation.kind, ActuationKind::torque);
  EXPECT_EQ(plant.actuation.kind, ActuationKind::torque);
  EXPECT_EQ(plant.actuation.segments.size(), 2u);
  EXPECT_EQ(plant.valves.supply_pressure_bar, 20.0);
  EXPECT_EQ(plant.actuation.min_pressure_bar, -20.0);
  const auto* links = plant.kind.get_if<LinkSettings>();
  ASSERT_NE(links, nullptr);
  EXPECT_EQ(links->joint_stiffness_nm_per_rad, 12.0);
  EXPECT_EQ(plant.method, IntegratorMethod::sdirk2);
  EXPECT_EQ(plant.valves.dead_time_s, 0.01);
  ASSERT_EQ(plant.loads.size(), 2u);
  EXPECT_EQ(plant.loads[1].shape, LoadShape::half_sine);
  EXPECT_EQ(plant.payload_kg, (std::vector<double>{0.0, 0.1}));
  EXPECT_EQ(plant.base_motion.frequency_hz, 2.0);
  const Experiment again = load_experiment(folder.write("b.yaml", resolved_text(first)));
  EXPECT_EQ(resolved_text(again), resolved_text(first));
  EXPECT_EQ(again.hash, first.hash);
}

TEST(PlantKeys, TorqueIsForSimulatedArmsAlone) {
  const TestFolder folder;
  const auto refuses = [&](const std::string& more, const std::string& key) {
    try {
      load_experiment(folder.write("bad.yaml", kArmOfLinks + more));
      ADD_FAILURE() << more << " was accepted";
    } catch (const ConfigError& error) {
      EXPECT_NE(std::string(error.what()).find(key), std::string::npos) << error.what();
    }
  };
  refuses("daemon: {safety: {valve_readback: true}}\n", "valve_readback");
  refuses(
      "plant: {actuation: {kind: chambers, chambers: {angle_rad: [0, 2, 4], gain_nm_per_bar: "
      "1}}}\n",
      "plant.actuation");
  refuses("plant: {kind: linsk}\n", "plant.kind");
  refuses("plant: {loads: [{segment: 3}]}\n", "plant.loads[0].segment");
  refuses("plant: {integrator: ida}\n", "one of sdirk2, cash4, sdirk4, erk, cvode_bdf");
  refuses("plant: {links: {joints: polar}}\n", "one of crossed");
  refuses("plant: {refined: {pieces: 2, mass_weights: [1, 2, 3]}}\n", "plant.refined.mass_weights");
}

constexpr const char* kChambers = R"(name: stretches
arm: {segments: 3, length_m: 0.11, mass_kg: 0.15, stiffness_nm_per_rad: 0.6, damping_nms_per_rad: 0.03}
actuation: {chambers: {angle_rad: [0, 2, 4], gain_nm_per_bar: 0.8}}
control: {kp_nm_per_rad: 1, kd_nms_per_rad: 0}
reference:
  - {kind: set_point, theta_rad: 0.2}
)";

TEST(PlantKeys, SegmentsThatStretch) {
  const TestFolder folder;
  const auto load = [&](const std::string& more) {
    return load_experiment(folder.write("a.yaml", kChambers + more));
  };
  const Experiment plain = load("");
  EXPECT_FALSE(plain.arm.extensible || plain.plant.arm.extensible);

  const Experiment all = load(R"(plant:
  arm: {extensible: true, axial_stiffness_n_per_m: [3000, 4000, 5000], axial_damping_ns_per_m: 150}
  actuation: {chambers: {angle_rad: [0, 2, 4], gain_nm_per_bar: 0.8, offset_m: [0.01, 0.01, 0.02]}}
)");
  EXPECT_FALSE(all.arm.extensible);
  EXPECT_TRUE(all.plant.arm.extensible);
  EXPECT_EQ(all.plant.arm.segments[2].axial_stiffness_n_per_m, 5000.0);
  EXPECT_EQ(all.plant.arm.segments[1].axial_damping_ns_per_m, 150.0);
  EXPECT_FALSE(all.plant.arm.segments[1].constant_length);
  EXPECT_EQ(all.plant.actuation.segments[0][2].offset_m, 0.02);

  const Experiment some = load("plant: {arm: {extensible: [1, 0, 1]}}\n");
  EXPECT_TRUE(some.plant.arm.extensible);
  EXPECT_TRUE(some.plant.arm.segments[1].constant_length);
  EXPECT_FALSE(some.plant.arm.segments[2].constant_length);
  for (const Experiment& one : {plain, all, some}) {
    const Experiment again = load_experiment(folder.write("b.yaml", resolved_text(one)));
    EXPECT_EQ(resolved_text(again), resolved_text(one));
  }

  const auto refuses = [&](const std::string& more, int line, const std::string& message) {
    try {
      load(more);
      ADD_FAILURE() << more << " was accepted";
    } catch (const ConfigError& error) {
      EXPECT_EQ(error.line, line) << error.what();
      EXPECT_NE(std::string(error.what()).find(message), std::string::npos) << error.what();
    }
  };
  refuses("plant: {arm: {extensible: maybe}}\n", 7,
          "plant.arm.extensible: expected false, true or");
  refuses("plant: {arm: {extensible: [1, 0]}}\n", 7, "plant.arm.extensible");
  refuses("plant: {arm: {extensible: [1, 0, 2]}}\n", 7, "plant.arm.extensible");
  refuses("plant: {kind: refined, refined: {pieces: 29}, arm: {extensible: true}}\n", 7,
          "1 to 85 pieces");
  EXPECT_TRUE(load("plant: {kind: links, arm: {extensible: true}}\n").plant.arm.extensible);
  for (const char* term :
       {"cubic_per_rad2", "stiffening_per_bar", "remanence", "remanence_2", "bouc_wen"})
    refuses(std::string("plant: {kind: links, material: {") + term + ": 0.1}}\n", 7,
            "plant.material: expected a kind of plant that has these terms");
  refuses("plant: {material: {axial_remanence_2: 0.1}}\n", 7,
          "plant.material.axial_remanence_2: expected 0 where plant.arm.extensible is false");
  refuses("plant: {valves: {supply_sag_s: 0.1, lag_s: 0}}\n", 7,
          "plant.valves.supply_sag_s: expected 0 s where");
  refuses("plant: {arm: {extensible: true, actuation_model: couple}}\n", 7,
          "false with actuation_model: couple");
  refuses(
      "plant: {actuation: {chambers: {angle_rad: [0, 2, 4], gain_nm_per_bar: 1, offset_m: 0}}}\n",
      7, "offset_m");
  // The controller has no third coordinate in polar coordinates; in u it has.
  std::string controlled = kChambers;
  controlled.insert(controlled.find("{segments: 3") + 1, "extensible: true, ");
  const Experiment both = load_experiment(folder.write("c.yaml", controlled));
  EXPECT_TRUE(both.arm.extensible && both.plant.arm.extensible);
  const Experiment own = load_experiment(
      folder.write("own.yaml", "include: c.yaml\nname: own\ncontrol: {law: external}\n"));
  EXPECT_TRUE(own.arm.extensible && own.control.law.get_if<ExternalLaw>() != nullptr);
  controlled.insert(controlled.find("control: {") + 10, "coordinates: polar, ");
  try {
    load_experiment(folder.write("c.yaml", controlled));
    ADD_FAILURE() << "accepted";
  } catch (const ConfigError& error) {
    EXPECT_EQ(error.line, 2);
    EXPECT_EQ(error.key, "arm.extensible");
    EXPECT_NE(error.expected.find("control.coordinates: polar"), std::string::npos);
  }
}

}  // namespace
}  // namespace softarm
