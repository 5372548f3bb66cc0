#include "softarm/commissioning/identification/live_experiment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "softarm/base/clock.hpp"
#include "softarm/base/time.hpp"
#include "softarm/client/arm_listener.hpp"
#include "softarm/client/commander.hpp"

namespace softarm {
namespace {

constexpr std::int64_t kListen_ns = 500'000'000;      ///< for others, before the first command
constexpr std::int64_t kPatience_ns = 5'000'000'000;  ///< for frames, and for the arm to rest
constexpr std::int64_t kLost_ns = 200'000'000;        ///< without a frame: the arm is not seen
constexpr std::int64_t kStill_ns = 500'000'000;       ///< so long at rest before the first step
constexpr double kStill_radps = 0.5;

struct Sample {
  std::int64_t time_ns;
  Eigen::VectorXd value;
};

class LiveExperiment {
 public:
  LiveExperiment(const Experiment& experiment, const std::function<bool()>& stop,
                 const std::function<void(const std::string&)>& progress)
      : experiment_(experiment),
        node_(experiment.transport.lcm.url),
        commander_(experiment, node_),
        listener_(experiment, node_, false),
        stop_(stop),
        progress_(progress) {}

  LiveOutcome run(const std::vector<std::vector<double>>& steps, double hold_s) {
    listen();
    std::string why;
    try {
      wait_for_rest();
      const std::int64_t start_ns = monotonic_now_ns();
      const auto hold_ns = to_ns(hold_s);
      for (std::size_t k = 0; k < steps.size() && why.empty(); ++k) {
        if (progress_) progress_(fmt::format("step {} of {}", k + 1, steps.size()));
        why = play(steps[k], start_ns + static_cast<std::int64_t>(k + 1) * hold_ns);
      }
    } catch (...) {
      commander_.vent_to_rest();
      throw;
    }
    commander_.vent_to_rest();
    return {record(), why};
  }

 private:
  bool stop_requested() const { return stop_ && stop_(); }

  void listen() {
    const std::int64_t end_ns = monotonic_now_ns() + kListen_ns;
    while (monotonic_now_ns() < end_ns && !stop_requested()) attend(end_ns);
    if (const std::string other = listener_.other_commander(); !other.empty())
      throw std::runtime_error(other);
    listener_.commanding();
  }

  /// With zeros meanwhile: whoever holds the valves gets to know us, and the arm hangs.
  void wait_for_rest() {
    const std::int64_t start_ns = monotonic_now_ns();
    std::int64_t moved_ns = start_ns;
    const auto seen = [&] {
      return listener_.whole_frame_ns() > std::max(start_ns, monotonic_now_ns() - kLost_ns);
    };
    for (std::int64_t now_ns = start_ns; now_ns < start_ns + kPatience_ns;
         now_ns = monotonic_now_ns()) {
      if (stop_requested()) throw std::runtime_error("stopped before the first step");
      if (!seen() || listener_.fastest_radps() > kStill_radps) moved_ns = now_ns;
      if (now_ns - moved_ns > kStill_ns) return;
      commander_.vent(now_ns);
      attend(commander_.next_ns());
    }
    if (!seen())
      throw std::runtime_error(fmt::format(
          "no frame with every segment on {} for {} s: is motion capture running, and do "
          "daemon.bodies name its bodies?",
          listener_.seen().channels.front(), kPatience_ns / 1'000'000'000));
    throw std::runtime_error(
        "the arm moves before the first step: expected it at rest; is another controller "
        "commanding it?");
  }

  /// One set point until `until_ns`; returns why the arm must be vented, or nothing.
  std::string play(const std::vector<double>& bar, std::int64_t until_ns) {
    const PressureVector wanted_bar =
        Eigen::Map<const Eigen::VectorXd>(bar.data(), std::ssize(bar));
    for (std::int64_t now_ns = monotonic_now_ns(); now_ns < until_ns; now_ns = monotonic_now_ns()) {
      if (stop_requested()) return "stopped";
      if (commander_.held_up()) return Commander::kHeldUp;
      if (std::string why = listener_.beyond_limits(kLost_ns); !why.empty()) return why;
      const std::int64_t due_ns = commander_.next_ns();
      commander_.update(wanted_bar, experiment_.actuation.slew_bar_per_s, now_ns);
      if (commander_.next_ns() != due_ns) note_input(now_ns);
      attend(std::min(until_ns, commander_.next_ns()));
      note_frame();
    }
    return {};
  }

  /// Handles one message at most.
  void attend(std::int64_t until_ns) {
    node_.wait_until(until_ns);
    listener_.look_at_clock();
  }

  void note_input(std::int64_t now_ns) {
    if (inputs_.empty() || inputs_.back().value != commander_.sent_bar())
      inputs_.push_back({now_ns, commander_.sent_bar()});
  }

  void note_frame() {
    const std::int64_t captured_ns = listener_.captured_ns();
    if (frames_.empty() || captured_ns > frames_.back().time_ns)
      frames_.push_back({captured_ns, listener_.u_rad()});
  }

  MotionRecord record() const {
    MotionRecord out;
    if (frames_.empty() || inputs_.empty()) return out;
    const std::int64_t zero_ns = frames_.front().time_ns;
    const auto fill = [&](const std::vector<Sample>& from, Eigen::VectorXd& time_s,
                          Eigen::MatrixXd& value) {
      const auto rows = static_cast<Eigen::Index>(from.size());
      time_s.resize(rows);
      value.resize(rows, from.front().value.size());
      for (Eigen::Index k = 0; k < rows; ++k) {
        const Sample& sample = from[static_cast<std::size_t>(k)];
        time_s[k] = to_seconds(sample.time_ns - zero_ns);
        value.row(k) = sample.value;
      }
    };
    fill(frames_, out.time_s, out.u_rad);
    // The zero that was commanded before the first step, then the steps.
    std::vector<Sample> inputs = {{std::min(zero_ns, inputs_.front().time_ns) - 1'000'000'000,
                                   Eigen::VectorXd::Zero(inputs_.front().value.size())}};
    inputs.insert(inputs.end(), inputs_.begin(), inputs_.end());
    fill(inputs, out.input.time_s, out.input.value);
    return out;
  }

  const Experiment& experiment_;
  LcmNode node_;
  Commander commander_;
  ArmListener listener_;
  const std::function<bool()>& stop_;
  const std::function<void(const std::string&)>& progress_;
  std::vector<Sample> frames_, inputs_;
};

}  // namespace

LiveOutcome play_steps(const Experiment& experiment, const StepPlan& plan,
                       const std::function<bool()>& stop,
                       const std::function<void(const std::string&)>& progress) {
  if (experiment.actuation.kind == ActuationKind::torque)
    throw std::runtime_error("--live plays pressures; expected actuation by chambers");
  LiveExperiment live(experiment, stop, progress);
  return live.run(step_commands(experiment, plan), plan.hold_s);
}

}  // namespace softarm
