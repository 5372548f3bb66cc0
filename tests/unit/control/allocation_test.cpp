// References and controller at work without a single allocation.
#include <gtest/gtest.h>

#include <cmath>

#include "counted_malloc.hpp"
#include "unit/control/arms.hpp"

namespace softarm {
namespace {

TEST(Control, AllocatesNothingAfterConstruction) {
  const int n = 10, dof = 2 * n;
  ControllerSettings settings = test::gains(n, 1.0, 0.002);
  settings.valve_lag_s = 0.02;
  ReferenceSettings phases;
  WayPointReference way;
  for (int i = 0; i < 5; ++i) {
    way.points.push_back({0.5 * i, std::vector<double>(static_cast<std::size_t>(dof), 0.1 * i)});
  }
  phases.phases = {{PaperReference{}, 2.0}, {way, 2.0}, {LiveReference{}, 4.0}, {way, 0.0}};
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(dof);
  for (ControlCoordinates coordinates : {ControlCoordinates::u, ControlCoordinates::polar}) {
    settings.coordinates = coordinates;
    CurvatureController controller(test::paper_arm(n), settings);
    Reference reference(phases, settings, n);
    ReferenceWindow window;
    ControlOutput out;
    Eigen::VectorXd u = Eigen::VectorXd::Constant(dof, 0.05), velocity = zero;
    double sum = 0.0;
    int accepted = 0;

    const long before = test::allocations;
    reference.start(0.0, u, velocity);
    for (int k = 0; k < 10000; ++k) {
      const double t = 1e-3 * k;
      if (reference.receive(t, u, velocity, zero) == LiveVerdict::accepted) ++accepted;
      reference.window(t, controller.lookahead_s(), window);
      controller.compute(u, velocity, window, out);
      u = 0.9 * u + 0.1 * window.now.u;
      sum += out.tau_actuation_nm[0];
    }
    EXPECT_EQ(test::allocations - before, 0);
    EXPECT_GT(accepted, 1000);
    EXPECT_TRUE(std::isfinite(sum));
  }
}

TEST(Control, TheCountSeesAnAllocation) {
  if (SOFTARM_COUNTS_MALLOC == 0) GTEST_SKIP() << "a sanitizer owns malloc";
  const long before = test::allocations;
  // Called by name: a new-expression could be optimised away.
  ::operator delete(::operator new(1000));
  EXPECT_EQ(test::allocations - before, 1);
  const Eigen::MatrixXd matrix = Eigen::MatrixXd::Random(40, 40);
  EXPECT_EQ(test::allocations - before, 2) << matrix(0, 0);
}

}  // namespace
}  // namespace softarm
