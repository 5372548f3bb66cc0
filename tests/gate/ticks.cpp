// The worst ticks of the control pipeline, each scene for arms of several sizes:
//   gate_ticks          times them
//   gate_ticks --count  under callgrind: dumps the counters after every tick (check_instructions)
#include <fmt/format.h>
#include <valgrind/callgrind.h>

#include <algorithm>
#include <array>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "softarm/base/clock.hpp"
#include "unit/runtime/pipeline_bench.hpp"

namespace softarm {
namespace {

using test::PipelineBench;

constexpr int kTicks = 3;        // of a scene
constexpr int kMostFrames = 64;  // that the daemon takes in one tick

/// Everything that costs time is on: mass along the arc and across it, a path of the tip, valve lag,
/// integral gain, read-back and both watches.
Experiment heavy(int segments, ObserverKind observer, double max_pressure_bar) {
  Experiment it;
  const auto n = static_cast<std::size_t>(segments);
  it.arm.segments.resize(n, {.radius_m = 0.02});
  std::vector<Chamber> chambers(4);
  for (std::size_t k = 0; k < chambers.size(); ++k)
    chambers[k].angle_rad = 0.5 * std::numbers::pi * static_cast<double>(k);
  it.actuation.segments.assign(n, chambers);
  it.actuation.max_pressure_bar = max_pressure_bar;
  it.control.kp.assign(2 * n, 1.0);
  it.control.kd.assign(2 * n, 0.002);
  it.control.ki.assign(2 * n, 0.1);
  it.control.valve_lag_s = 0.02;
  const double reach_m = 0.11 * segments;
  it.reference.phases = {{TipPathReference{.shape = TipPathShape::circle,
                                           .centre_m = {0.0, 0.0, -0.9 * reach_m},
                                           .first_axis_m = {0.1 * reach_m, 0.0, 0.0},
                                           .second_axis_m = {0.0, 0.1 * reach_m, 0.0}},
                          0.0}};
  it.estimation.observer = observer;
  it.safety.frame_latency_s = 0.005;
  it.safety.good_frames = 5;  // callgrind is slow
  it.safety.valve_readback = true;
  it.safety.pressure_tolerance_bar = 10.0;  // the bench's arm is where it is asked to be
  it.safety.curvature_residual_nm = 1e3;
  it.safety.deadman = true;
  return it;
}

/// Frames of the last period, the most that fit.
void flood(PipelineBench& bench) {
  for (int k = 0; k < kMostFrames; ++k) {
    MocapFrame frame = bench.exact_frame();
    frame.capture_ns += 10'000 * (k + 1);
    frame.body[0].position_m.x() += k % 2 == 0 ? 1e-7 : -1e-7;
    bench.send(frame, 0);
  }
}

/// What happens before a tick.
struct Scene {
  const char* name;
  double max_pressure_bar;
  std::function<void(PipelineBench&)> before;
};

const std::vector<Scene>& scenes() {
  static const std::vector<Scene> kScenes{
      {"usual", 2.0, [](PipelineBench& bench) { bench.send(bench.exact_frame(), 0); }},
      {"silence", 2.0, [](PipelineBench&) {}},
      {"full_queue", 2.0, flood},
      {"saturated", 0.02, flood},
      {"rejects", 2.0,  // found wrong only after u has been computed: it jumps
       [](PipelineBench& bench) {
         const SegmentVector u = bench.u;
         bench.u.array() += 1.0;
         flood(bench);
         bench.u = u;
       }},
      {"restarts", 2.0,
       [](PipelineBench& bench) {
         bench.next_number -= 100 * kMostFrames;
         flood(bench);
       }},
      {"requests", 2.0,
       [](PipelineBench& bench) {
         flood(bench);
         bench.input.requests = {.arm = true, .disarm = true, .emergency_stop = true};
       }},
      {"after_stop", 2.0,
       [](PipelineBench& bench) {
         bench.now_ns += 150 * test::kMs;
         flood(bench);
       }},
  };
  return kScenes;
}

/// Calls `tick` for some ticks of every scene, each from ACTIVE.
void play(const std::function<void(const std::string& name, const std::function<void()>&)>& tick) {
  for (const ObserverKind observer : {ObserverKind::kinematic, ObserverKind::model}) {
    for (const int segments : {1, 3, 10}) {
      for (const Scene& scene : scenes()) {
        const auto bench =
            std::make_unique<PipelineBench>(heavy(segments, observer, scene.max_pressure_bar));
        if (bench->run_to(Mode::active) < 0)
          throw std::runtime_error(
              fmt::format("not ACTIVE: {}", name(bench->pipeline.output().reason)));
        bench->run(10);
        bench->publishing = false;
        for (int k = 0; k < kTicks; ++k) {
          scene.before(*bench);
          if (k == 0) CALLGRIND_START_INSTRUMENTATION;  // costs callgrind more than a tick
          tick(fmt::format("tick.{}.{}.{}", observer == ObserverKind::model ? "model" : "kinematic",
                           scene.name, segments),
               [&] { bench->tick(); });
        }
        CALLGRIND_STOP_INSTRUMENTATION;
      }
    }
  }
}

/// Dumps the counters after every tick, labelled tick.OBSERVER.SCENE.n.
void count_ticks() {
  play([](const std::string& name, const std::function<void()>& tick) {
    const std::string label = name + " 1";
    CALLGRIND_ZERO_STATS;
    tick();
    CALLGRIND_DUMP_STATS_AT(label.c_str());
  });
}

/// Prints the median and the slowest tick of every scene, us.
void time_ticks() {
  std::vector<std::pair<std::string, std::vector<double>>> times;
  for (int k = 0; k < 5; ++k) {
    play([&](const std::string& name, const std::function<void()>& tick) {
      const std::int64_t start_ns = monotonic_now_ns();
      tick();
      const double us = 1e-3 * static_cast<double>(monotonic_now_ns() - start_ns);
      auto at =
          std::find_if(times.begin(), times.end(), [&](auto& each) { return each.first == name; });
      if (at == times.end()) at = times.insert(at, {name, {}});
      at->second.push_back(us);
    });
  }
  for (auto& [name, us] : times) {
    std::sort(us.begin(), us.end());
    fmt::print("{:<36} median {:8.1f} us, slowest {:8.1f} us\n", name, us[us.size() / 2],
               us.back());
  }
}

}  // namespace
}  // namespace softarm

int main(int argc, char** argv) {
  if (argc == 2 && std::string_view(argv[1]) == "--count") {
    softarm::count_ticks();
  } else {
    softarm::time_ticks();
  }
}
