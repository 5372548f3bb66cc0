// softarm-dev bench model: what is measured, and how it is reported.
#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "dev/bench/accuracy.hpp"
#include "dev/bench/interleaved.hpp"
#include "dev/bench/methods.hpp"

namespace softarm {

/// The machine and the build: without them no time means anything.
struct BenchBuild {
  std::string compiler, flags, instruction_set, processor, load;
  bool has_kdl = false;
};
BenchBuild bench_build();
/// As the first members of a report.
nlohmann::ordered_json json_of(const BenchBuild& build);

/// One method over all n.
struct MethodReport {
  Method method;
  std::vector<CallTime> times;  ///< one per n of `segments`; no rounds where it was not measured
  double exponent = 0.0;        ///< of the median time over n, 6 to 100; NaN where not measured
  LargestError golden, sweep;
};

/// How many times faster: `slow` over `fast`, paired in every round, one per n (NaN: not measured).
struct RatioReport {
  Method slow, fast;
  std::vector<double> ratios;
};

struct ModelReport {
  BenchBuild build;
  std::vector<int> segments;
  std::vector<MethodReport> methods;
  std::vector<RatioReport> ratios;
};

/// @param golden_file empty: no comparison with it.
ModelReport bench_model(double seconds, const std::string& golden_file,
                        const std::function<void(const std::string&)>& progress);

std::string table(const ModelReport& report);
std::string json(const ModelReport& report);

}  // namespace softarm
