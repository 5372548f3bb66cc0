// Runs the key functions under callgrind: each over its random states once, between a reset of the
// counters and a dump that carries its name and the number of calls.
#include <fmt/format.h>
#include <valgrind/callgrind.h>

#include <cstdio>

#include "dev/bench/methods.hpp"
#include "softarm/model/derivatives.hpp"
#include "softarm/model/dynamics.hpp"
#include "softarm/model/statics.hpp"

namespace softarm {
namespace {

std::string label(const Method& method, int segments) {
  const char* route = method.route == Route::matrices    ? "matrices"
                      : method.route == Route::recursion ? "recursion"
                                                         : "controller";
  return fmt::format("{}.{}.{}.{}", route, coordinates(method), name(method.mass), segments);
}

template <class Call>
void count(const std::string& label, const BenchInputs& inputs, const Call& call) {
  call(inputs.states.front());  // binds what the linker left for the first call
  const std::string text = fmt::format("{} {}", label, inputs.states.size());
  CALLGRIND_ZERO_STATS;
  for (const BenchState& state : inputs.states) call(state);
  CALLGRIND_DUMP_STATS_AT(text.c_str());
}

void count(const Method& method, int segments) {
  const BenchInputs inputs = bench_inputs(segments, method.extensible);
  const auto evaluator =
      make_evaluator(method, inputs.arm, bench_controller(method, inputs.arm.size()));
  count(label(method, segments), inputs,
        [&](const BenchState& state) { evaluator->evaluate(state); });
}

/// Forward dynamics and statics, and both with their derivatives.
void count_derivatives(bool extensible, int segments) {
  BenchInputs inputs = bench_inputs(segments, extensible);
  ArmParameters& arm = inputs.arm;
  arm.extensible = extensible;
  arm.mass = MassModel::distributed;
  DynamicsWorkspace workspace(arm);
  ModelDerivatives derivatives(arm);
  Eigen::VectorXd out(arm.dof());
  Eigen::MatrixXd by_u(arm.dof(), arm.dof()), by_velocity(by_u), by_force(by_u);
  const auto name = [&](const char* what) {
    return fmt::format("{}.{}.distributed.{}", what, extensible ? "ue" : "u", segments);
  };
  count(name("forward"), inputs, [&](const BenchState& it) {
    forward_dynamics(arm, workspace, it.u, it.velocity, it.acceleration, out);
  });
  count(name("derivatives"), inputs, [&](const BenchState& it) {
    derivatives.forward_dynamics(it.u, it.velocity, it.acceleration, out, by_u, by_velocity,
                                 by_force);
  });
  count(name("statics"), inputs,
        [&](const BenchState& it) { static_moments(arm, workspace, it.u, out); });
  count(name("stiffness"), inputs,
        [&](const BenchState& it) { derivatives.static_stiffness(it.u, by_u); });
}

}  // namespace
}  // namespace softarm

int main() {
  using softarm::Method, softarm::Route, softarm::MassModel;
  CALLGRIND_START_INSTRUMENTATION;
  for (const MassModel mass : {MassModel::point, MassModel::distributed}) {
    for (const int segments : {3, 10}) {
      for (const bool polar : {false, true}) {
        softarm::count(Method{Route::matrices, polar, mass}, segments);
        softarm::count(Method{Route::controller, polar, mass}, segments);
      }
      softarm::count(Method{Route::recursion, false, mass}, segments);
      for (const Route route : {Route::matrices, Route::recursion}) {
        softarm::count(Method{route, false, mass, true}, segments);
      }
    }
    softarm::count(Method{Route::recursion, false, mass}, 100);
    softarm::count(Method{Route::controller, false, mass}, 100);
  }
  for (const bool extensible : {false, true}) {
    for (const int segments : {1, 3, 10}) softarm::count_derivatives(extensible, segments);
  }
  if (RUNNING_ON_VALGRIND == 0) std::puts("nothing is counted without valgrind --tool=callgrind");
}
