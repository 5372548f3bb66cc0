// Runs the key functions under callgrind: each over its random states once, between a reset of the
// counters and a dump that carries its name and the number of calls.
#include <fmt/format.h>
#include <valgrind/callgrind.h>

#include <cstdio>

#include "dev/bench/methods.hpp"

namespace softarm {
namespace {

std::string label(const Method& method, int segments) {
  const char* route = method.route == Route::matrices    ? "matrices"
                      : method.route == Route::recursion ? "recursion"
                                                         : "controller";
  return fmt::format("{}.{}.{}.{}", route, coordinates(method), name(method.mass), segments);
}

void count(const Method& method, int segments) {
  const BenchInputs inputs = bench_inputs(segments, method.extensible);
  const auto evaluator =
      make_evaluator(method, inputs.arm, bench_controller(method, inputs.arm.size()));
  evaluator->evaluate(inputs.states.front());  // binds what the linker left for the first call
  const std::string text = fmt::format("{} {}", label(method, segments), inputs.states.size());
  CALLGRIND_ZERO_STATS;
  for (const BenchState& state : inputs.states) evaluator->evaluate(state);
  CALLGRIND_DUMP_STATS_AT(text.c_str());
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
  if (RUNNING_ON_VALGRIND == 0) std::puts("nothing is counted without valgrind --tool=callgrind");
}
