#include "softarm/commissioning/identification/learned_arm.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "softarm/config/load.hpp"
#include "softarm/model/dynamics.hpp"
#include "test_folder.hpp"

namespace softarm {
namespace {

/// The paper's arm in this gravity; what is not learnt yet is the weight that a sideways g amounts to.
struct PulledArm {
  PulledArm(const Eigen::Vector3d& gravity_mps2, const Eigen::Vector3d& pull_mps2)
      : experiment(load_experiment(SOFTARM_SOURCE_DIR "/config/paper_arm_observer.yaml")) {
    experiment.arm.gravity_mps2 = gravity_mps2;
    ArmParameters pulled = experiment.arm;
    pulled.gravity_mps2 = pull_mps2;
    DynamicsWorkspace workspace(pulled);
    const Eigen::VectorXd straight = Eigen::VectorXd::Zero(pulled.dof());
    Eigen::VectorXd moments_nm(pulled.dof());
    inverse_dynamics(pulled, workspace, straight, straight, straight, straight,
                     {false, false, true}, moments_nm);
    found.correction.disturbance_nm = -moments_nm;
  }

  Experiment experiment;
  ObserverReport found;
};

TEST(LearnedArm, WhatPullsAHangingArmSidewaysIsALoad) {
  const PulledArm arm({0.0, 0.0, -9.81}, {0.981, -1.962, 0.0});
  const auto load = corrected(arm.experiment, arm.found).estimation.model_observer.load;
  ASSERT_EQ(load.size(), 6u);
  for (std::size_t i = 0; i < 6; i += 2)
    EXPECT_NEAR(std::hypot(load[i], load[i + 1]), 0.1 * std::sqrt(5.0), 1e-12) << i;
}

TEST(LearnedArm, OfAnArmThatLiesNothingIsKnownAlongItself) {
  for (const double slope : {0.0, 1e-9, 0.05}) {
    const PulledArm arm({9.81 * std::cos(slope), 0.0, 9.81 * std::sin(slope)}, {0.0, 0.981, 0.0});
    const TestFolder folder;
    const auto file = folder / "learned.yaml";
    std::ofstream(file) << learned_yaml(arm.experiment, arm.found, "Learnt.",
                                        SOFTARM_SOURCE_DIR "/config/paper_arm_observer.yaml", file);
    const auto load = load_experiment(file).estimation.model_observer.load;
    ASSERT_EQ(load.size(), 6u);
    for (std::size_t i = 0; i < 6; i += 2) {
      EXPECT_NEAR(std::abs(load[i]) + std::abs(load[i + 1]), 0.1, 1e-5) << slope << " " << i;
    }
  }
}

}  // namespace
}  // namespace softarm
