#include "softarm/actuation/input_map.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "softarm/actuation/pressure_allocator.hpp"
#include "softarm/model/actuation_matrix.hpp"

namespace softarm {
namespace {

/// A chamber on the x axis (angle 0) bends its segment away from it: towards -x, which is u = (-, 0).
TEST(InputMap, AChamberPushesAwayFromItself) {
  const std::vector<Chamber> segment = {{0.0, 0.5}, {std::numbers::pi / 2, 2.0}};
  const Eigen::Matrix2Xd map = input_map(ActuationKind::chambers, segment);
  EXPECT_LT((map.col(0) - Eigen::Vector2d(-0.5, 0.0)).norm(), 1e-15);
  EXPECT_LT((map.col(1) - Eigen::Vector2d(0.0, -2.0)).norm(), 1e-15);
}

TEST(InputMap, IsWhatTheAllocatorGivesBack) {
  ActuationSettings settings;
  settings.segments = {{{0.2, 0.5}, {2.3, 0.7}, {4.4, 0.6}},
                       {{0.0, 0.8}, {1.6, 0.8}, {3.1, 0.9}, {4.7, 0.8}}};
  const PressureAllocator allocator(settings);
  const Eigen::VectorXd pressures_bar = Eigen::VectorXd::LinSpaced(7, 0.1, 1.3);
  Eigen::VectorXd force_nm(4);
  allocator.generalized_force(pressures_bar, force_nm);
  EXPECT_LT((input_map(settings) * pressures_bar - force_nm).norm(), 1e-15);
}

TEST(InputMap, OfTorqueIsTheActuationMatrix) {
  ActuationSettings settings;
  set_torque_actuation(settings, 2, 3.0);
  const Eigen::MatrixXd map = input_map(settings);
  const Eigen::Matrix2d A = actuation_matrix(ActuationModel::chamber, Eigen::Vector2d(0.3, 0.1));
  EXPECT_EQ(Eigen::Matrix2d(map.topLeftCorner(2, 2)), A);
  EXPECT_EQ(Eigen::Matrix2d(map.bottomRightCorner(2, 2)), A);
  EXPECT_TRUE(map.topRightCorner(2, 2).isZero(0.0));
}

}  // namespace
}  // namespace softarm
