#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <memory>

#include "dev/bench/kdl_chain.hpp"
#include "dev/bench/model_report.hpp"

namespace softarm {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr int kSegments[] = {1, 3, 6, 10, 20, 50, 100};
constexpr int kExponentFrom = 6;

std::string processor() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  }
  return "unknown";
}

std::string load() {
  std::ifstream file("/proc/loadavg");
  std::string minute;
  file >> minute;
  return minute;
}

std::string instruction_set() {
  std::string extensions;
#ifdef __AVX512F__
  extensions += " avx512f";
#endif
#ifdef __AVX2__
  extensions += " avx2";
#endif
#ifdef __FMA__
  extensions += " fma";
#endif
  return extensions.empty() ? "portable x86-64 (sse2)" : "native:" + extensions;
}

/// Runs one method over all states in turn; where it stopped, the next slot goes on.
class Loop {
 public:
  Loop(const Method& method, std::shared_ptr<const BenchInputs> inputs)
      : inputs_(std::move(inputs)),
        evaluator_(
            make_evaluator(method, inputs_->arm, bench_controller(method, inputs_->arm.size()))) {}

  void operator()(int calls) {
    const std::vector<BenchState>& states = inputs_->states;
    for (int k = 0; k < calls; ++k) {
      evaluator_->evaluate(states[next_]);
      next_ = next_ + 1 == states.size() ? 0 : next_ + 1;
    }
  }

 private:
  std::shared_ptr<const BenchInputs> inputs_;
  std::shared_ptr<Evaluator> evaluator_;
  std::size_t next_ = 0;
};

/// Which measured entry belongs to a method at the k-th n; -1: none.
using Places = std::vector<std::pair<Method, std::vector<int>>>;

int place_of(const Places& places, const Method& method, std::size_t k) {
  for (const auto& [known, at] : places) {
    if (known == method) return at[k];
  }
  return -1;
}

double ratio_at(const InterleavedTiming& timing, const Places& places, const Method& slow,
                const Method& fast, std::size_t k) {
  const int a = place_of(places, slow, k), b = place_of(places, fast, k);
  if (a < 0 || b < 0) return kNan;
  return timing.ratio(static_cast<std::size_t>(a), static_cast<std::size_t>(b));
}

/// Slope of log time over log n by least squares.
double exponent(const std::vector<CallTime>& times) {
  double count = 0, x = 0, y = 0, xx = 0, xy = 0;
  for (std::size_t k = 0; k < times.size(); ++k) {
    if (kSegments[k] < kExponentFrom) continue;
    if (times[k].rounds == 0) return kNan;
    const double a = std::log(kSegments[k]), b = std::log(times[k].median_ns);
    count += 1;
    x += a;
    y += b;
    xx += a * a;
    xy += a * b;
  }
  return (count * xy - x * y) / (count * xx - x * x);
}

std::vector<std::pair<Method, Method>> compared() {
  constexpr MassModel kPoint = MassModel::point, kArc = MassModel::distributed;
  std::vector<std::pair<Method, Method>> pairs;
  for (const bool polar : {true, false}) {
    pairs.push_back({{Route::kdl_matrices, true}, {Route::matrices, polar, kPoint}});
  }
  pairs.push_back({{Route::kdl_inverse_dynamics, true}, {Route::recursion, false, kPoint}});
  pairs.push_back({{Route::kdl_inverse_dynamics, true}, {Route::controller, false, kPoint}});
  pairs.push_back({{Route::augmented, true}, {Route::matrices, true, kPoint}});
  for (const auto& [route, polar] : {std::pair{Route::matrices, true},
                                     {Route::matrices, false},
                                     {Route::recursion, false},
                                     {Route::controller, false}}) {
    pairs.push_back({{route, polar, kArc}, {route, polar, kPoint}});
  }
  return pairs;
}

void add_errors(std::vector<MethodReport>& methods, const std::string& golden_file) {
  for (const MassModel mass : {MassModel::point, MassModel::distributed}) {
    std::vector<KnownState> golden;
    if (!golden_file.empty()) golden = golden_states(golden_file, mass);
    const auto sweep_u = sweep_states(false, mass), sweep_polar = sweep_states(true, mass);
    for (MethodReport& report : methods) {
      if (report.method.mass != mass) continue;
      report.golden = largest_error(report.method, golden);
      report.sweep = largest_error(report.method, report.method.polar ? sweep_polar : sweep_u);
    }
  }
}

}  // namespace

BenchBuild bench_build() {
  return {.compiler = SOFTARM_BENCH_COMPILER,
          .flags = SOFTARM_BENCH_FLAGS,
          .instruction_set = instruction_set(),
          .processor = processor(),
          .load = load(),
          .has_kdl = KdlChain::available()};
}

ModelReport bench_model(double seconds, const std::string& golden_file,
                        const std::function<void(const std::string&)>& progress) {
  ModelReport report{.build = bench_build(),
                     .segments = {std::begin(kSegments), std::end(kSegments)},
                     .methods = {},
                     .ratios = {}};
  InterleavedTiming timing;
  Places places;
  for (const Method& method : bench_methods(1)) {
    places.push_back({method, std::vector<int>(report.segments.size(), -1)});
  }
  int entries = 0;
  for (std::size_t k = 0; k < report.segments.size(); ++k) {
    const auto inputs = std::make_shared<const BenchInputs>(bench_inputs(report.segments[k]));
    const std::vector<Method> here = bench_methods(report.segments[k]);
    for (auto& [method, at] : places) {
      if (std::find(here.begin(), here.end(), method) == here.end()) continue;
      timing.add(Loop(method, inputs));
      at[k] = entries++;
    }
  }
  timing.measure(seconds, [&](double share) {
    progress(fmt::format("timing {} methods and sizes, {:.0f} %", entries, 100.0 * share));
  });
  for (const auto& [method, at] : places) {
    MethodReport one{.method = method, .times = {}, .golden = {}, .sweep = {}};
    for (const int place : at) {
      one.times.push_back(place < 0 ? CallTime{kNan, kNan, kNan, 0}
                                    : timing.time(static_cast<std::size_t>(place)));
    }
    one.exponent = exponent(one.times);
    report.methods.push_back(std::move(one));
  }
  for (const auto& [slow, fast] : compared()) {
    RatioReport one{slow, fast, {}};
    for (std::size_t k = 0; k < report.segments.size(); ++k) {
      one.ratios.push_back(ratio_at(timing, places, slow, fast, k));
    }
    const auto measured = [](double x) { return std::isfinite(x); };
    if (std::any_of(one.ratios.begin(), one.ratios.end(), measured)) {
      report.ratios.push_back(std::move(one));
    }
  }
  progress("errors against the golden file and over theta");
  add_errors(report.methods, golden_file);
  return report;
}

}  // namespace softarm
