// Another project's program: the model of an arm and the control module, through the installed
// headers and libraries only.
#include <cmath>
#include <cstdio>
#include <softarm/control/curvature_controller.hpp>
#include <softarm/model/kinematics.hpp>

int main() {
  softarm::ArmParameters arm;
  arm.segments.resize(3);
  const softarm::SegmentVector straight = softarm::SegmentVector::Zero(arm.dof());
  const Eigen::Vector3d tip = softarm::tip_position(arm, straight);
  std::printf("the straight arm ends at (%g, %g, %g) m\n", tip.x(), tip.y(), tip.z());
  const double hanging_m = -3 * arm.segments[0].length_m;
  return std::abs(tip.z() - hanging_m) < 1e-12 && tip.head<2>().norm() < 1e-12 ? 0 : 1;
}
