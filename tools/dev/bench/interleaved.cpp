#include "dev/bench/interleaved.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "softarm/base/clock.hpp"

namespace softarm {
namespace {

constexpr double kSlot_ns = 0.5e6;
constexpr double kLongCall_ns = 2e6;
constexpr int kMostCalls = 1 << 20;  ///< a slot, where a call takes no time at all
constexpr std::size_t kMinimumRounds = 3;

}  // namespace

BenchClocks machine_clocks() {
  return {.wall_ns = [] { return static_cast<double>(monotonic_now_ns()); },
          // Of this thread: what others do on the same core does not count.
          .processor_ns = [] { return static_cast<double>(thread_cpu_ns()); }};
}

double quantile(std::vector<double> values, double share) {
  std::erase_if(values, [](double x) { return !std::isfinite(x); });
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::sort(values.begin(), values.end());
  const double place = share * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const std::size_t above = std::min(below + 1, values.size() - 1);
  return std::lerp(values[below], values[above], place - static_cast<double>(below));
}

void InterleavedTiming::add(std::function<void(int calls)> run) {
  entries_.push_back({.run = std::move(run), .calls = 1, .every = 1, .call_ns = {}});
}

double InterleavedTiming::timed_ns(const std::function<void(int)>& run, int calls) const {
  const double start_ns = clocks_.processor_ns();
  run(calls);
  return (clocks_.processor_ns() - start_ns) / calls;
}

void InterleavedTiming::calibrate(Entry& entry) const {
  constexpr int kTrials = 3;  // the fastest counts: the first is cold, any may be interrupted
  double call_ns = 0.0;
  for (entry.calls = 1;; entry.calls *= 2) {
    call_ns = std::numeric_limits<double>::infinity();
    for (int trial = 0; trial < kTrials; ++trial) {
      call_ns = std::min(call_ns, timed_ns(entry.run, entry.calls));
    }
    if (call_ns * entry.calls >= 0.5 * kSlot_ns || entry.calls >= kMostCalls) break;
  }
  entry.calls = static_cast<int>(std::clamp(kSlot_ns / call_ns, 1.0, 1.0 * kMostCalls));
  entry.every = call_ns > kLongCall_ns ? static_cast<int>(4.0 * call_ns / kLongCall_ns) : 1;
}

void InterleavedTiming::measure(double seconds, const std::function<void(double)>& progress) {
  for (Entry& entry : entries_) {
    entry.call_ns.clear();
    calibrate(entry);
  }
  const double start_ns = clocks_.wall_ns(), length_ns = 1e9 * seconds;
  for (std::size_t round = 0; round < kMinimumRounds || clocks_.wall_ns() - start_ns < length_ns;
       ++round) {
    for (Entry& entry : entries_) {
      const bool takes_part = round % static_cast<std::size_t>(entry.every) == 0;
      // The first calls fetch code and data that the others have driven out.
      if (takes_part && entry.calls > 1) entry.run(1 + entry.calls / 16);
      entry.call_ns.push_back(takes_part ? timed_ns(entry.run, entry.calls)
                                         : std::numeric_limits<double>::quiet_NaN());
    }
    progress(std::min(1.0, (clocks_.wall_ns() - start_ns) / length_ns));
  }
}

CallTime InterleavedTiming::time(std::size_t index) const {
  const std::vector<double>& values = entries_.at(index).call_ns;
  const auto rounds =
      std::count_if(values.begin(), values.end(), [](double x) { return std::isfinite(x); });
  return {quantile(values, 0.5), quantile(values, 0.25), quantile(values, 0.75),
          static_cast<std::size_t>(rounds)};
}

double InterleavedTiming::ratio(std::size_t numerator, std::size_t denominator) const {
  const Entry &a = entries_.at(numerator), &b = entries_.at(denominator);
  std::vector<double> ratios;
  for (std::size_t k = 0; k < a.call_ns.size(); ++k) ratios.push_back(a.call_ns[k] / b.call_ns[k]);
  return quantile(ratios, 0.5);
}

}  // namespace softarm
