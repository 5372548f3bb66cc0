// Decoded messages with any numbers, offered to a pipeline that is ACTIVE. Whatever they
// are, pressures stay finite, within their limits, and change no faster than they may.
#include <cstring>
#include <memory>

#include "fuzz/target.hpp"
#include "softarm/estimation/clock_relation.hpp"
#include "unit/config/config_files.hpp"
#include "unit/runtime/pipeline_bench.hpp"

namespace softarm::test {
namespace {

constexpr unsigned kFrame = 1, kReference = 2, kMeasured = 4, kArm = 8, kDisarm = 16, kStop = 32;

const Experiment& frames_experiment() {
  static const Experiment loaded = [] {
    Experiment one = load_experiment(kConfigFolder / "one_segment.yaml");
    one.safety.good_frames = 2;
    return one;
  }();
  return loaded;
}

/// ACTIVE, and about to bend.
std::unique_ptr<PipelineBench> active_bench() {
  auto bench = std::make_unique<PipelineBench>(frames_experiment());
  require(bench->run_to(Mode::active) > 0, "the bench becomes ACTIVE");
  bench->run(5);
  return bench;
}

/// Numbers of any type, one after the other; zeros where the input has ended.
class Numbers {
 public:
  explicit Numbers(std::span<const std::byte> bytes) : left_(bytes) {}
  bool empty() const { return left_.empty(); }
  template <class Number>
  Number take() {
    Number value{};
    const std::size_t size = std::min(sizeof value, left_.size());
    std::memcpy(&value, left_.data(), size);
    left_ = left_.subspan(size);
    return value;
  }
  SegmentVector vector(int size) {
    SegmentVector made(size);
    for (double& each : made) each = take<double>();
    return made;
  }

 private:
  std::span<const std::byte> left_;
};

template <class Number>
void put(Number value, Bytes& bytes) {
  const auto* from = reinterpret_cast<const std::byte*>(&value);
  bytes.insert(bytes.end(), from, from + sizeof value);
}

MocapFrame take_frame(Numbers& numbers, ClockRelation& clock, std::int64_t now_ns) {
  MocapFrame frame;
  frame.frame_number = numbers.take<std::int64_t>();
  frame.capture_ns = clock.capture_ns(now_ns, numbers.take<std::int64_t>());
  frame.segments = frames_experiment().arm.size();
  for (std::size_t i = 0; i <= frames_experiment().arm.segments.size(); ++i) {
    BodyPose& body = frame.body[i];
    body.valid = (numbers.take<std::uint8_t>() & 1) != 0;
    for (double& each : body.position_m) each = numbers.take<double>();
    for (double& each : body.orientation.coeffs()) each = numbers.take<double>();
  }
  return frame;
}

void check(const PressureVector& before, const TickOutput& output) {
  const ActuationSettings& limits = frames_experiment().actuation;
  const double step = std::max(limits.slew_bar_per_s, limits.vent_bar_per_s) /
                      frames_experiment().rate_hz * (1.0 + 1e-9);
  for (Eigen::Index j = 0; j < output.pressure_bar.size(); ++j) {
    const double bar = output.pressure_bar[j];
    require(bar >= 0.0 && bar <= limits.max_pressure_bar, "pressures stay within their limits");
    require(std::abs(bar - before[j]) <= step, "pressures change no faster than they may");
  }
}

}  // namespace

void run_frames(std::span<const std::byte> input) {
  const auto made = active_bench();
  PipelineBench& bench = *made;
  ClockRelation clock(ClockMode::sender, 0.0);
  Numbers numbers(input);
  const int dof = frames_experiment().arm.dof();
  while (!numbers.empty()) {
    const auto flags = numbers.take<std::uint8_t>();
    bench.now_ns += bench.pipeline.period_ns();
    TickInput tick;
    tick.now_ns = bench.now_ns;
    tick.requests.arm = (flags & kArm) != 0;
    tick.requests.disarm = (flags & kDisarm) != 0;
    tick.requests.emergency_stop = (flags & kStop) != 0;
    MocapFrame frame;
    if ((flags & kFrame) != 0) {
      frame = take_frame(numbers, clock, bench.now_ns);
      tick.frames = {&frame, 1};
    }
    LiveReferenceInput reference;
    if ((flags & kReference) != 0) {
      reference = {numbers.vector(dof), numbers.vector(dof), numbers.vector(dof)};
      tick.reference = &reference;
    }
    const PressureVector before = bench.pipeline.output().pressure_bar;
    PressureVector measured = before;
    if ((flags & kMeasured) != 0) {
      // DaemonLink lets nothing but finite ones through.
      for (double& each : measured) {
        const float bar = numbers.take<float>();
        each = std::isfinite(bar) ? static_cast<double>(bar) : 0.0;
      }
      tick.measured_bar = &measured;
      tick.newest_measurement_ns = bench.now_ns;
    }
    check(before, bench.pipeline.tick(tick));
  }
}

std::vector<Bytes> frames_seeds() {
  std::vector<Bytes> seeds;
  for (const unsigned more : {0U, kReference | kMeasured | kArm, kDisarm}) {
    const auto made = active_bench();
    PipelineBench& bench = *made;
    Bytes bytes;
    for (int k = 0; k < 8; ++k) {
      bench.now_ns += bench.pipeline.period_ns();
      put(static_cast<std::uint8_t>(kFrame | (k % 4 == 3 ? more : 0U)), bytes);
      const MocapFrame frame = bench.exact_frame();
      put(frame.frame_number, bytes);
      put(frame.capture_ns / 1000, bytes);
      for (std::size_t i = 0; i <= frames_experiment().arm.segments.size(); ++i) {
        put(std::uint8_t{1}, bytes);
        for (const double each : frame.body[i].position_m) put(each, bytes);
        for (const double each : frame.body[i].orientation.coeffs()) put(each, bytes);
      }
      if (k % 4 != 3 || (more & kReference) == 0) continue;
      for (int i = 0; i < 3 * frames_experiment().arm.dof(); ++i) put(0.1, bytes);
      for (int i = 0; i < static_cast<int>(bench.pipeline.output().pressure_bar.size()); ++i)
        put(0.5F, bytes);
    }
    seeds.push_back(bytes);
  }
  return seeds;
}

}  // namespace softarm::test
