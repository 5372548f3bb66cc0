// Processor times of many functions in one process, interleaved in short rounds, so that whatever
// else the machine does meets all of them alike.
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace softarm {

/// Quartiles of the processor time a call takes, over the rounds.
struct CallTime {
  double median_ns = 0.0, lower_ns = 0.0, upper_ns = 0.0;
  std::size_t rounds = 0;
};

/// What time is taken by, in ns: of the machine, and of the calling thread alone.
struct BenchClocks {
  std::function<double()> wall_ns, processor_ns;
};
BenchClocks machine_clocks();

class InterleavedTiming {
 public:
  explicit InterleavedTiming(BenchClocks clocks = machine_clocks()) : clocks_(std::move(clocks)) {}

  /// @param run makes so many calls.
  void add(std::function<void(int calls)> run);

  /// Runs rounds for about `seconds`, three at least. In each, every function is called for about
  /// half a millisecond; one whose single call takes longer than 2 ms sits out most rounds.
  /// @param progress gets the share done, 0 to 1.
  void measure(double seconds, const std::function<void(double share)>& progress);

  CallTime time(std::size_t index) const;
  /// Median over the rounds of time(numerator) / time(denominator).
  double ratio(std::size_t numerator, std::size_t denominator) const;

 private:
  struct Entry {
    std::function<void(int)> run;
    int calls = 1;
    int every = 1;                ///< takes part in every so many-th round
    std::vector<double> call_ns;  ///< one a round; NaN where it sat out
  };

  void calibrate(Entry& entry) const;
  double timed_ns(const std::function<void(int)>& run, int calls) const;

  BenchClocks clocks_;
  std::vector<Entry> entries_;
};

/// Quantile of finite values by linear interpolation; NaN where there are none.
double quantile(std::vector<double> values, double share);

}  // namespace softarm
