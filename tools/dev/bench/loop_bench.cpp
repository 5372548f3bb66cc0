#include "dev/bench/loop_bench.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <memory>
#include <random>
#include <softarm_messages/controller_status_t.hpp>
#include <softarm_messages/mocap_frame_t.hpp>
#include <softarm_messages/pressure_command_t.hpp>
#include <softarm_messages/tick_record_t.hpp>
#include <stdexcept>
#include <thread>

#include "apps/child_process.hpp"
#include "dev/bench/loop_peers.hpp"
#include "dev/bench/temporary_folder.hpp"
#include "softarm/base/clock.hpp"
#include "softarm/base/realtime.hpp"
#include "softarm/base/time.hpp"
#include "softarm/config/load.hpp"
#include "softarm/model/kinematics.hpp"
#include "softarm/runtime/safety_monitor.hpp"
#include "softarm/transport/lcm_node.hpp"
#include "softarm/transport/message_decoding.hpp"
#include "softarm/transport/mocap_adapter.hpp"
#include "softarm/transport/settings.hpp"
#include "softarm/transport/softarm_mocap.hpp"

namespace softarm {
namespace {

using namespace std::chrono_literals;

constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr double kTheta_rad = 0.2;
constexpr int kPriority = 50;        ///< of daemon and rivals
constexpr int kDriverPriority = 60;  ///< of what stands for camera and valves
constexpr double kPatience_s = 20.0;

Durations durations(const std::vector<double>& samples_us) {
  return {.count = std::ssize(samples_us),
          .p50_us = quantile(samples_us, 0.5),
          .p99_us = quantile(samples_us, 0.99),
          .largest_us = quantile(samples_us, 1.0)};
}

/// Processor time since start that a virtual machine's host gave to others, of all processors; NaN
/// where the kernel does not tell.
double stolen_s() {
  std::ifstream file("/proc/stat");
  std::string name;
  double user, nice, system, idle, io, interrupts, soft_interrupts, steal;
  if (!(file >> name >> user >> nice >> system >> idle >> io >> interrupts >> soft_interrupts >>
        steal))
    return std::numeric_limits<double>::quiet_NaN();
  return steal / static_cast<double>(sysconf(_SC_CLK_TCK));
}

/// Its own port and folder; the arm holds a set point.
class Scene {
 public:
  Scene(const LoopBenchOptions& options, LoopScene& result)
      : options_(options), result_(result), period_ns_(to_ns(1.0 / options.rate_hz)) {
    const int second_ticks = static_cast<int>(options.rate_hz);  // the longest allowed
    setenv("XDG_STATE_HOME", folder_.path().c_str(), 1);         // of the daemon
    std::ofstream(config()) << fmt::format(
        "include: {}\nname: bench_loop\nreference: [{{kind: set_point, theta_rad: {}}}]\n{}"
        "daemon:\n  rate_hz: {}\n  capture_time: latency\n"
        "  lcm: {{url: \"{}\"}}\n"
        "  safety: {{arming: automatic, frame_period_s: {}, frame_latency_s: 0, hold_after_s: "
        "1,\n"
        "    vent_after_s: 2, hold_overruns: {}, vent_overruns: {}, valve_readback: "
        "false}}\n"
        "  realtime: {{fifo: {}, priority: {}, cpu: {}}}\n",
        std::filesystem::absolute(options.config).string(), kTheta_rad,
        options.law ? "control: {law: external}\n" : "", options.rate_hz, own_network(),
        1.0 / options.rate_hz, second_ticks - 1, second_ticks, result.fifo, kPriority,
        options.cpu < 0 ? "any" : std::to_string(options.cpu));
    experiment_ = load_experiment(config());
    if (experiment_.transport.mocap.source != softarm_mocap())
      throw ConfigError(options.config, 0, "daemon.mocap.source",
                        "softarm, whose frames this bench sends", "another source");
    make_frames();
  }

  void run(const std::function<void(const std::string&)>& progress);
  int frame_bytes() const { return frames_[0].getEncodedSize(); }
  int command_bytes() const { return command_bytes_; }

 private:
  struct Tick {
    std::int64_t woken_ns = 0, overruns_before = -1;
    bool complete() const { return woken_ns != 0 && overruns_before >= 0; }
    std::vector<std::pair<std::int64_t, std::int64_t>> frames;  ///< number, arrival in ns
  };

  std::filesystem::path config() const { return folder_.path() / "loop.yaml"; }
  void make_frames();
  void listen();
  void drive(double seconds, const std::function<void(const std::string&)>& progress);
  bool wait_for(const std::function<bool()>& reached);
  /// What happened in between: numbers of frames, of requests, of ticks, of bare wake-ups.
  struct Window {
    std::size_t frame = 0, request = 0, bare = 0, law = 0;
    std::int64_t tick = 0, missed = 0, bare_missed = 0;
    double stolen_s = 0.0;
  };
  Window window(const SharedWakeUps& wake_ups) const;
  void evaluate(const Window& from, const Window& to, const SharedWakeUps& wake_ups);
  void evaluate_ticks(const Window& from, const Window& to);
  bool answers() const;

  LoopBenchOptions options_;
  LoopScene& result_;
  std::int64_t period_ns_;
  TemporaryFolder folder_;
  Experiment experiment_;
  std::array<softarm_messages::mocap_frame_t, 2> frames_;
  std::unique_ptr<LcmNode> node_;
  std::mt19937_64 random_{1};
  // By number, from 1; 0: not there.
  std::vector<std::int64_t> sent_ns_{0}, echo_sent_ns_{0}, echoed_ns_{0};
  std::map<std::int64_t, std::int64_t> commanded_ns_;
  std::map<std::int64_t, Tick> ticks_;
  std::vector<double> law_us_;  ///< of every tick, the newest
  std::int64_t first_ns_ = 0, echoes_ = 0;
  softarm_messages::controller_status_t status_{};
  softarm_messages::tick_record_t record_{};
  softarm_messages::pressure_command_t command_{}, answer_{};
  int command_bytes_ = 0;
};

/// Two poses in turn, a hundredth of a millimetre apart: a sensor's noise, for an arm that rests.
void Scene::make_frames() {
  const ArmParameters& arm = experiment_.arm;
  SegmentVector u = SegmentVector::Zero(arm.dof());
  for (int i = 0; i < arm.dof(); i += 2) u[i] = kTheta_rad;
  std::vector<Eigen::Isometry3d> ends(static_cast<std::size_t>(arm.size()));
  forward_kinematics(arm, u, ends);
  MocapFrame frame;
  frame.segments = arm.size();
  frame.body[0] = {arm.base_position_m, Eigen::Quaterniond(arm.base_rotation), true};
  const auto sent = std::make_unique<SentFrame>();
  for (std::size_t k = 0; k < frames_.size(); ++k) {
    for (std::size_t i = 0; i < ends.size(); ++i)
      frame.body[i + 1] = {
          ends[i].translation() + 1e-5 * static_cast<double>(k) * Eigen::Vector3d::UnitX(),
          Eigen::Quaterniond(ends[i].linear()), true};
    MocapAdapter(experiment_.transport.bodies, arm).to_sent(frame, 0, *sent);
    to_message(*sent, frames_[k]);
  }
}

void Scene::listen() {
  const LcmSettings& lcm = experiment_.transport.lcm;
  node_ = std::make_unique<LcmNode>(lcm.url);
  node_->subscribe(kEchoAnswer, 256, [this](const ReceivedMessage& packet) {
    const std::int64_t now_ns = monotonic_now_ns();
    if (!decode(packet.bytes, answer_)) return;
    const auto number = static_cast<std::size_t>(answer_.sequence);
    if (number >= echoed_ns_.size()) return;
    echoed_ns_[number] = now_ns;
    ++echoes_;
  });
  node_->subscribe(lcm.command_channel, 256, [this](const ReceivedMessage& packet) {
    const std::int64_t now_ns = monotonic_now_ns();
    if (!decode(packet.bytes, command_)) return;
    commanded_ns_.emplace(command_.sequence, now_ns);
    command_bytes_ = static_cast<int>(packet.bytes.size());
  });
  node_->subscribe(lcm.status_channel, 256, [this](const ReceivedMessage& packet) {
    if (!decode(packet.bytes, status_)) return;
    ticks_[status_.tick].overruns_before = status_.overruns;
    if (std::isfinite(status_.law_round_trip_s)) law_us_.push_back(1e6 * status_.law_round_trip_s);
  });
  node_->subscribe(lcm.tick_channel, 256, [this](const ReceivedMessage& packet) {
    if (!decode(packet.bytes, record_)) return;
    first_ns_ = record_.first_ns;
    Tick& tick = ticks_[record_.tick];
    tick.woken_ns = record_.now_ns;
    tick.frames.clear();
    for (const auto& frame : record_.frames)
      tick.frames.emplace_back(frame.frame_number, frame.capture_ns);
  });
}

bool Scene::wait_for(const std::function<bool()>& reached) {
  const std::int64_t end_ns = monotonic_now_ns() + to_ns(kPatience_s);
  while (!reached() && monotonic_now_ns() < end_ns) drive(0.05, [](const std::string&) {});
  return reached();
}

/// A frame to the daemon, a request to the echo, in turn, at random times.
void Scene::drive(double seconds, const std::function<void(const std::string&)>& progress) {
  const std::int64_t start_ns = monotonic_now_ns();
  const std::int64_t end_ns = start_ns + to_ns(seconds);
  std::uniform_int_distribution<std::int64_t> pause_ns(2'000'000, 4'000'000);
  for (std::int64_t next_ns = start_ns; next_ns < end_ns; next_ns += pause_ns(random_)) {
    while (monotonic_now_ns() < next_ns) node_->wait_until(next_ns);
    const bool to_echo = echo_sent_ns_.size() < sent_ns_.size();
    std::vector<std::int64_t>& sent_ns = to_echo ? echo_sent_ns_ : sent_ns_;
    const auto number = static_cast<std::int64_t>(sent_ns.size());
    softarm_messages::mocap_frame_t& frame = frames_[static_cast<std::size_t>(number % 2)];
    frame.frame_number = number;
    if (to_echo) echoed_ns_.push_back(0);
    const std::int64_t now_ns = monotonic_now_ns();
    sent_ns.push_back(now_ns);
    frame.capture_time_us = now_ns / 1000;
    node_->publish(to_echo ? kEchoRequest : experiment_.transport.lcm.mocap_channel, frame);
    progress(
        fmt::format("{}: {:.0f} / {:.0f} s", result_.name, to_seconds(now_ns - start_ns), seconds));
  }
}

bool Scene::answers() const {
  return static_cast<Mode>(status_.mode) == Mode::active && first_ns_ != 0 && echoes_ > 0;
}

Scene::Window Scene::window(const SharedWakeUps& wake_ups) const {
  return {.frame = sent_ns_.size(),
          .request = echo_sent_ns_.size(),
          .bare = wake_ups.count(),
          .law = law_us_.size(),
          .tick = status_.tick,
          .missed = status_.overruns,
          .bare_missed = wake_ups.missed(),
          .stolen_s = stolen_s()};
}

/// The daemon's first tick is due before it is asked for, so its time is that of the first
/// deadline, but for less than a microsecond as a rule: what another tick is earlier is taken off.
void Scene::evaluate_ticks(const Window& from, const Window& to) {
  const auto due_ns = [&](std::int64_t number, const Tick& tick) {
    return first_ns_ + (number - 1 + tick.overruns_before) * period_ns_;
  };
  std::int64_t earliest_ns = 0;
  for (const auto& [number, tick] : ticks_)
    if (tick.complete()) earliest_ns = std::min(earliest_ns, tick.woken_ns - due_ns(number, tick));
  std::vector<double> lateness_us, command_us, wait_us, whole_us;
  for (auto each = ticks_.upper_bound(from.tick); each != ticks_.end(); ++each) {
    const auto& [number, tick] = *each;
    if (!tick.complete()) continue;
    const std::int64_t deadline_ns = due_ns(number, tick) + earliest_ns;
    const std::int64_t lateness_ns = tick.woken_ns - deadline_ns;
    if (number <= to.tick) lateness_us.push_back(1e-3 * static_cast<double>(lateness_ns));
    // What the newest tick missed, its own status cannot tell yet.
    if (number < to.tick) result_.missed_asleep += lateness_ns / period_ns_;
    const auto commanded = commanded_ns_.find(number);
    for (const auto& [frame, arrival_ns] : tick.frames) {
      const auto index = static_cast<std::size_t>(frame);
      if (index < from.frame || index >= to.frame || commanded == commanded_ns_.end()) continue;
      const std::int64_t whole_ns = commanded->second - sent_ns_[index];
      const std::int64_t wait_ns =
          std::max<std::int64_t>(0, deadline_ns - std::max(arrival_ns, sent_ns_[index]));
      whole_us.push_back(1e-3 * static_cast<double>(whole_ns));
      wait_us.push_back(1e-3 * static_cast<double>(wait_ns));
      command_us.push_back(1e-3 * static_cast<double>(whole_ns - wait_ns));
    }
  }
  result_.lateness = durations(lateness_us);
  result_.command = durations(command_us);
  result_.wait = durations(wait_us);
  result_.whole = durations(whole_us);
}

void Scene::evaluate(const Window& from, const Window& to, const SharedWakeUps& wake_ups) {
  evaluate_ticks(from, to);
  std::vector<double> echo_us, bare_us;
  for (std::size_t k = from.request; k < to.request; ++k)
    if (echoed_ns_[k] != 0)
      echo_us.push_back(1e-3 * static_cast<double>(echoed_ns_[k] - echo_sent_ns_[k]));
  for (std::size_t k = from.bare; k < to.bare; ++k)
    bare_us.push_back(1e-3 * static_cast<double>(wake_ups.lateness_ns(k)));
  result_.law = durations({law_us_.begin() + static_cast<std::ptrdiff_t>(from.law),
                           law_us_.begin() + static_cast<std::ptrdiff_t>(to.law)});
  result_.echo = durations(echo_us);
  result_.bare_lateness = durations(bare_us);
  result_.missed = to.missed - from.missed;
  result_.bare_missed = to.bare_missed - from.bare_missed;
  result_.stolen_s = to.stolen_s - from.stolen_s;
  result_.unanswered =
      static_cast<std::int64_t>(to.frame - from.frame + to.request - from.request) -
      result_.echo.count - result_.command.count;
}

void Scene::run(const std::function<void(const std::string&)>& progress) {
  const RealtimeSettings realtime{.fifo = result_.fifo, .priority = kPriority, .cpu = options_.cpu};
  SharedWakeUps wake_ups(
      static_cast<std::size_t>((options_.seconds + 2.0 * kPatience_s) * options_.rate_hz));
  // Before this process has a thread of LCM's.
  const ForkedPeer sleeper([&] { wake_ups.sleep_forever(period_ns_, realtime); });
  const ForkedPeer echo([&] {
    echo_forever(experiment_.transport.lcm.url, chamber_count(experiment_.actuation), realtime);
  });
  std::unique_ptr<ForkedPeer> law;
  if (options_.law)
    law = std::make_unique<ForkedPeer>([&] { answer_states_forever(experiment_, realtime); });
  ChildProcess daemon(program_beside_this("softarmd"), {config().string()},
                      folder_.path() / "softarmd.txt");
  std::vector<std::unique_ptr<ForkedPeer>> load;
  for (int k = 0; k < result_.busy_processes; ++k)
    load.push_back(std::make_unique<ForkedPeer>([] {
      while (true) std::atomic_signal_fence(std::memory_order_seq_cst);  // busy
    }));
  // In a separate thread: SCHED_FIFO is not for the rest of this program.
  std::string problem;
  std::thread([&] {
    apply_realtime_settings({.fifo = result_.fifo, .priority = kDriverPriority});
    listen();
    if (!wait_for([this] { return answers(); })) {
      problem = fmt::format("{} echoes; softarmd {} ({})\n{}", echoes_,
                            name(static_cast<Mode>(status_.mode)),
                            name(static_cast<Reason>(status_.reason)), daemon.printed());
      return;
    }
    // Half a period apart from the daemon, so that neither wakes in the other's work.
    wake_ups.start(first_ns_ + (status_.tick + 100) * period_ns_ + period_ns_ / 2);
    drive(1.5, progress);  // joining the set point
    const Window from = window(wake_ups);
    drive(options_.seconds, progress);
    const Window to = window(wake_ups);
    drive(0.2, progress);  // the last answers
    evaluate(from, to, wake_ups);
    node_.reset();
  }).join();
  if (!problem.empty()) throw std::runtime_error(problem);
  daemon.signal(SIGTERM);
  if (const int code = daemon.wait(5s); code != 0)
    throw std::runtime_error(fmt::format("softarmd ended with {}\n{}", code, daemon.printed()));
}

bool fifo_is_permitted() {
  bool permitted = false;
  std::thread([&] {
    permitted = apply_realtime_settings({.fifo = true, .priority = kDriverPriority}).empty();
  }).join();
  return permitted;
}

}  // namespace

LoopReport bench_loop(const LoopBenchOptions& options,
                      const std::function<void(const std::string&)>& progress) {
  LoopReport report{.build = bench_build(),
                    .seconds = options.seconds,
                    .rate_hz = options.rate_hz,
                    .frame_bytes = 0,
                    .command_bytes = 0,
                    .scenes = {{.name = "as it is"},
                               {.name = "SCHED_FIFO", .fifo = true},
                               {.name = "SCHED_FIFO under load",
                                .fifo = true,
                                .busy_processes = options.busy_processes}}};
  for (LoopScene& result : report.scenes) {
    if (result.fifo && !fifo_is_permitted()) {
      result.skipped =
          "SCHED_FIFO is not permitted here: run as root or raise the limit (ulimit -r)";
      continue;
    }
    Scene scene(options, result);
    scene.run(progress);
    report.frame_bytes = scene.frame_bytes();
    report.command_bytes = scene.command_bytes();
  }
  return report;
}

}  // namespace softarm
