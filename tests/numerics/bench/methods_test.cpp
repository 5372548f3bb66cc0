// What `softarm-dev bench model` measures, and how it counts.
#include "dev/bench/methods.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "dev/bench/accuracy.hpp"
#include "dev/bench/interleaved.hpp"

namespace softarm {
namespace {

/// Every route must be exact, or its time is no achievement. The augmented robot's small-theta rows
/// and KDL's long levers lose a digit or two; none more.
TEST(BenchMethods, EveryRouteIsExact) {
  constexpr double kRouteTolerance = 1e-13;
  const std::string golden = std::string(SOFTARM_SOURCE_DIR) + "/tests/golden/golden.json";
  for (const MassModel mass : {MassModel::point, MassModel::distributed}) {
    const auto known = golden_states(golden, mass);
    const auto sweep_u = sweep_states(false, mass), sweep_polar = sweep_states(true, mass);
    for (const Method& method : bench_methods(3)) {
      if (method.mass != mass || method.route == Route::kdl_maps) continue;
      const std::string label =
          std::string(name(method.route)) + ", " + coordinates(method) + ", " + name(mass);
      const LargestError at_golden = largest_error(method, known),
                         at_sweep = largest_error(method, method.polar ? sweep_polar : sweep_u);
      EXPECT_LE(at_golden.relative, kRouteTolerance) << label;
      EXPECT_LE(at_sweep.relative, kRouteTolerance) << label;
      EXPECT_GT(at_sweep.states, 20) << label;
      // The file has no distributed mass in polar coordinates.
      EXPECT_EQ(at_golden.states > 0, !(method.polar && mass == MassModel::distributed)) << label;
    }
  }
}

TEST(BenchMethods, WrongTermsShow) {
  auto known = golden_states(std::string(SOFTARM_SOURCE_DIR) + "/tests/golden/golden.json",
                             MassModel::point);
  const Method method{Route::recursion, false, MassModel::point};
  for (KnownState& state : known) state.terms.G *= 1.0L + 1e-9L;
  EXPECT_GT(largest_error(method, known).relative, 1e-11);
}

TEST(BenchMethods, EveryMethodOfEverySizeRuns) {
  for (const int segments : {1, 3, 100}) {
    const BenchInputs inputs = bench_inputs(segments);
    for (const Method& method : bench_methods(segments)) {
      const auto evaluator = make_evaluator(method, inputs.arm, bench_controller(method, segments));
      evaluator->evaluate(inputs.states.back());
      EXPECT_TRUE(evaluator->result().G.allFinite()) << name(method.route);
    }
  }
}

}  // namespace
}  // namespace softarm
