// Everything that can go wrong around the pipeline, at random and in spells.
#pragma once

#include <limits>
#include <random>

#include "unit/runtime/pipeline_bench.hpp"

namespace softarm::test {

class RandomFaults {
 public:
  RandomFaults(PipelineBench& bench, unsigned seed)
      : bench_(bench), random_(seed), others_(seed + 1000) {}

  void before_tick() {
    if (chance(0.005)) spell_ = std::uniform_int_distribution<int>(0, kKinds)(random_);
    if (chance(0.01)) spell_ = 0;
    if (chance(0.0005)) bench_.next_number -= 50;
    if (chance(0.0003)) bench_.now_ns += 150 * kMs;
    bench_.latency_ns = spell_ == 5 ? 70 * kMs : 5 * kMs;
    bench_.input.requests.arm = chance(0.005);
    bench_.input.requests.disarm = chance(0.0005);
  }

  /// What people, valves and the machine do beside the frames.
  void others_before_tick() {
    bench_.input.requests.disarm |= chance(0.002);  // a fault must be acknowledged now and then
    bench_.input.requests.emergency_stop = chance(0.0002);
    if (chance(0.002)) bench_.going = !bench_.going;
    if (!bench_.going && chance(0.02)) bench_.going = true;
    if (chance(0.001)) bench_.valves_publish = false;
    if (chance(0.02)) bench_.valves_publish = true;
    if (chance(0.0005)) bench_.sends = false;
    if (chance(0.01)) bench_.sends = true;
    if (chance(0.0005)) leaking_ = true;
    if (chance(0.002)) leaking_ = false;
    bench_.input.consecutive_overruns =
        chance(0.002) ? std::uniform_int_distribution<int>(1, 20)(random_) : 0;
    std::bernoulli_distribution rarely(0.0001);
    bench_.input.requests.lost = rarely(others_);
    if (rarely(others_)) bench_.input.newest_foreign_ns = bench_.now_ns;
  }

  bool corrupt(MocapFrame& frame) {
    const std::size_t body = std::uniform_int_distribution<std::size_t>(0, 3)(random_);
    const int axis = std::uniform_int_distribution<int>(0, 2)(random_);
    switch (spell_) {
      case 1:
        return false;
      case 2:
        frame.body[body].position_m[axis] = bad_number();
        break;
      case 3:
        std::swap(frame.body[body], frame.body[(body + 1) % 4]);
        break;
      case 4:
        frame.body[body].position_m[axis] += 0.05;
        break;
      case 6:
        bench_.send(frame, bench_.latency_ns);
        break;
      case 7:
        frame.body = last_.body;
        break;
      case 8:
        frame.body[body].valid = false;
        break;
      case 9:
        frame.body[body].orientation.coeffs()[axis] = bad_number();
        break;
      case 10:
        frame.body[body].orientation.coeffs() *= 1.5;
        break;
      case 11:
        frame.segments = std::uniform_int_distribution<int>(-1, 4)(random_);
        break;
      default:
        break;
    }
    last_ = frame;
    return true;
  }

  void leak(PressureVector& measured_bar) const {
    if (leaking_) measured_bar[5] += 0.5;
  }

  bool chance(double p) { return std::bernoulli_distribution(p)(random_); }

 private:
  static constexpr int kKinds = 11;
  double bad_number() {
    constexpr double kBad[] = {std::numeric_limits<double>::quiet_NaN(),
                               std::numeric_limits<double>::infinity(),
                               -std::numeric_limits<double>::infinity(),
                               1e308,
                               -1e300,
                               std::numeric_limits<double>::denorm_min()};
    return kBad[std::uniform_int_distribution<int>(0, 5)(random_)];
  }

  PipelineBench& bench_;
  std::mt19937 random_, others_;
  MocapFrame last_;
  int spell_ = 0;
  bool leaking_ = false;
};

/// An external law that falls silent, is late and gives anything.
class RandomLaw {
 public:
  RandomLaw(PipelineBench& bench, unsigned seed) : bench_(bench), random_(seed + 2000) {}

  /// Answers the state of the tick before, or does not.
  void before_tick() {
    bench_.input.law = nullptr;
    if (chance(0.003)) silent_ = true;
    if (chance(0.02)) silent_ = false;
    if (silent_ || bench_.pipeline.output().law == nullptr) return;
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
    answer_.state_ns = bench_.now_ns - (chance(0.1) ? 40 * kMs : 0);
    answer_.arrival_ns = bench_.now_ns;
    answer_.validity_ns = chance(0.01) ? -1 : 30 * kMs;
    answer_.answer = chance(0.5) ? LawAnswer::force : LawAnswer::pressures;
    const bool force = answer_.answer == LawAnswer::force;
    std::uniform_real_distribution<double> number(force ? -0.5 : 0.0, force ? 0.5 : 1.0);
    answer_.values.resize(chance(0.02) ? 7 : force ? 6 : 12);
    for (double& each : answer_.values) each = number(random_);
    if (chance(0.05)) answer_.values[3] = chance(0.5) ? kNan : -1e9;
    bench_.input.law = &answer_;
  }
  /// What a daemon may go by after that tick: the end of the newest good answer.
  std::int64_t until_ns() {
    const bool came = bench_.input.law != nullptr;
    const Eigen::Index size = answer_.answer == LawAnswer::force ? 6 : 12;
    if (came && answer_.values.size() == size && answer_.values.allFinite() &&
        answer_.values.minCoeff() > -1e3 && bench_.now_ns < answer_.state_ns + answer_.validity_ns)
      until_ns_ = answer_.state_ns + answer_.validity_ns;
    return until_ns_;
  }

 private:
  bool chance(double p) { return std::bernoulli_distribution(p)(random_); }

  PipelineBench& bench_;
  std::mt19937 random_;
  LawInput answer_;
  std::int64_t until_ns_ = kNever;
  bool silent_ = false;
};

}  // namespace softarm::test
