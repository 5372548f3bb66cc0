#include "softarm/commissioning/identification/live_experiment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "commissioning/guarded_motion.hpp"
#include "softarm/transport/mocap_source.hpp"

namespace softarm {
namespace {

constexpr double kListen_s = 0.5;                     ///< for others, before the first command
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
      : client_(experiment), stop_(stop), progress_(progress), motion_(client_, kLost_ns, stop) {
    client_.lock_commands();
  }

  LiveOutcome run(const std::vector<std::vector<double>>& steps, double hold_s) {
    listen();
    wait_for_rest();
    client_.on_frame([this](const CapturedFrame&) { note_frame(); });
    const std::int64_t start_ns = noted_ns_ = client_.now_ns();
    for (std::size_t k = 0; k < steps.size() && motion_.aborted().empty(); ++k) {
      if (progress_) progress_(fmt::format("step {} of {}", k + 1, steps.size()));
      play(steps[k], start_ns + static_cast<std::int64_t>(k + 1) * to_ns(hold_s));
    }
    client_.on_frame({});
    client_.vent_to_rest();
    return {record(), motion_.aborted()};
  }

 private:
  bool stop_requested() const { return stop_ && stop_(); }

  void listen() {
    client_.wait_for([this] { return stop_requested(); }, kListen_s);
    if (const std::string other = client_.other_commander(); !other.empty())
      throw std::runtime_error(other);
  }

  /// Commands zeros meanwhile: the valve driver accepts us as the sender, and the arm hangs.
  void wait_for_rest() {
    const std::int64_t start_ns = client_.now_ns();
    std::int64_t moved_ns = start_ns;
    const auto seen = [&] {
      return client_.seen().arrival_ns > std::max(start_ns, client_.now_ns() - kLost_ns);
    };
    for (std::int64_t now_ns = start_ns; now_ns < start_ns + kPatience_ns;
         now_ns = client_.now_ns()) {
      if (stop_requested()) throw std::runtime_error("stopped before the first step");
      if (!seen() || client_.seen().speed_radps > kStill_radps) moved_ns = now_ns;
      if (now_ns - moved_ns > kStill_ns) return;
      client_.vent();
      client_.update(client_.next_command_ns());
    }
    if (!seen())
      throw std::runtime_error(fmt::format(
          "no frame with every segment on {} for {} s: is motion capture running, and do "
          "daemon.bodies name its bodies?",
          mocap_place(client_.experiment().transport), kPatience_ns / 1'000'000'000));
    throw std::runtime_error(
        "the arm moves before the first step: expected it at rest; is another controller "
        "commanding it?");
  }

  /// One set point until `until_ns`.
  void play(const std::vector<double>& bar, std::int64_t until_ns) {
    const PressureVector wanted_bar =
        Eigen::Map<const Eigen::VectorXd>(bar.data(), std::ssize(bar));
    const double slew_bar_per_s = client_.experiment().actuation.slew_bar_per_s;
    motion_.command(wanted_bar, slew_bar_per_s, [&] {
      note_input();
      return client_.now_ns() >= until_ns;
    });
  }

  void note_input() {
    if (client_.sent_ns() <= noted_ns_) return;
    noted_ns_ = client_.sent_ns();
    if (inputs_.empty() || inputs_.back().value != client_.set_points_bar())
      inputs_.push_back({noted_ns_, client_.set_points_bar()});
  }

  void note_frame() {
    const SeenArm& seen = client_.seen();
    if (frames_.empty() || seen.capture_ns > frames_.back().time_ns)
      frames_.push_back({seen.capture_ns, seen.u_rad});
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

  ArmClient client_;
  const std::function<bool()>& stop_;
  const std::function<void(const std::string&)>& progress_;
  GuardedMotion motion_;
  std::int64_t noted_ns_ = 0;  ///< the newest command sent that is among the inputs
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
