#include "identification/live_experiment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <stdexcept>

#include "softarm/daemon/realtime.hpp"
#include "softarm/estimation/curvature_estimator.hpp"
#include "softarm/transport/lcm_node.hpp"
#include "softarm/transport/message_decoding.hpp"
#include "softarm/transport/mocap_source.hpp"

namespace softarm {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr std::int64_t kCommandPeriod_ns = 10'000'000;
constexpr std::int64_t kLost_ns = 200'000'000;  ///< without a frame: the arm is not seen
constexpr std::int64_t kPatience_ns = 5 * kSecond_ns;
constexpr std::int64_t kVent_ns = kSecond_ns;
constexpr double kSpeedSpan_s = 0.05;  ///< so far apart, noise is no speed
constexpr double kStill_radps = 0.5;

class LiveExperiment {
 public:
  LiveExperiment(const Experiment& experiment, const std::function<bool()>& stop,
                 const std::function<void(const std::string&)>& progress)
      : experiment_(experiment),
        lock_(experiment.daemon.lcm.command_channel + " on " + experiment.daemon.lcm.url),
        mocap_(experiment.daemon, experiment.arm),
        estimator_(experiment.estimation, experiment.arm,
                   body_noise(experiment.estimation, experiment.arm.size(),
                              experiment.daemon.bodies.base_id < 0)),
        node_(experiment.daemon.lcm.url),
        stop_(stop),
        progress_(progress) {
    for (std::size_t k = 0; k < mocap_.channels().size(); ++k)
      node_.subscribe(mocap_.channels()[k], 1024,
                      [this, k](const ReceivedMessage& packet) { take_frame(k, packet); });
  }

  LiveOutcome run(const std::vector<std::vector<double>>& steps, double hold_s) {
    wait_for_frames(steps.front().size());
    const std::int64_t start_ns = monotonic_now_ns();
    const auto hold_ns = static_cast<std::int64_t>(1e9 * hold_s);
    try {
      for (std::size_t k = 0; k < steps.size() && aborted_.empty(); ++k) {
        if (progress_) progress_(fmt::format("step {} of {}", k + 1, steps.size()));
        recording_ = true;
        command(steps[k], start_ns + static_cast<std::int64_t>(k) * hold_ns + hold_ns, true);
      }
    } catch (...) {
      vent(steps.front().size());
      throw;
    }
    recording_ = false;
    const std::string why = aborted_;
    vent(steps.front().size());
    return {record(), why};
  }

 private:
  void wait_for_frames(std::size_t chambers) {
    const std::int64_t end_ns = monotonic_now_ns() + kPatience_ns;
    // Zero first: whoever holds the valves knows us, and the arm hangs.
    while (monotonic_now_ns() < end_ns && !stop_requested() && (recent_.size() < 10 || !still()))
      command(std::vector<double>(chambers, 0.0), monotonic_now_ns() + kCommandPeriod_ns, false);
    if (stop_requested()) throw std::runtime_error("stopped before the first step");
    if (recent_.size() < 10)
      throw std::runtime_error(fmt::format(
          "no frame with every segment on {} for {} s: is motion capture running, and do "
          "daemon.bodies name its bodies?",
          mocap_.channels().front(), kPatience_ns / kSecond_ns));
    if (!still())
      throw std::runtime_error(
          "the arm moves before the first step: expected it at rest; is "
          "another controller commanding it?");
  }

  bool stop_requested() const { return stop_ && stop_(); }
  bool still() const { return speed_radps() < kStill_radps; }

  /// Sends a command until `until_ns`, handling frames and watching the limits meanwhile.
  void command(const std::vector<double>& bar, std::int64_t until_ns, bool watched) {
    bool first = true;
    for (std::int64_t now_ns = monotonic_now_ns(); now_ns < until_ns; now_ns = monotonic_now_ns()) {
      if (now_ns >= next_command_ns_ || first) {
        send(bar, now_ns);
        if (first && recording_) note_input(bar, now_ns);
        first = false;
        next_command_ns_ = now_ns + kCommandPeriod_ns;
      }
      node_.wait_until(std::min(until_ns, next_command_ns_));
      if (watched && !within_limits()) return;
    }
  }

  void send(const std::vector<double>& bar, std::int64_t now_ns) {
    ++message_.sequence;
    message_.time_us = now_ns / 1000;
    message_.validity_us =
        static_cast<std::int32_t>(std::llround(1e6 * experiment_.daemon.lcm.command_validity_s));
    message_.shadow = 0;
    message_.pressure_bar.assign(bar.begin(), bar.end());
    message_.num_chambers = static_cast<std::int16_t>(bar.size());
    if (!node_.publish(experiment_.daemon.lcm.command_channel, message_))
      throw TransportError("a command could not be sent: see tools/with_loopback_network --check");
  }

  void vent(std::size_t chambers) {
    command(std::vector<double>(chambers, 0.0), monotonic_now_ns() + kVent_ns, false);
  }

  bool within_limits() {
    const IdentificationSettings& limits = experiment_.identification;
    double theta_rad = 0.0;
    for (Eigen::Index i = 0; i < experiment_.arm.size(); ++i)
      theta_rad = std::max(theta_rad, recent_.back().u_rad.segment<2>(2 * i).norm());
    if (stop_requested()) {
      aborted_ = "stopped";
    } else if (monotonic_now_ns() - last_frame_ns_ > kLost_ns) {
      aborted_ = fmt::format("no frame with every segment for {} ms", kLost_ns / 1'000'000);
    } else if (theta_rad > limits.max_theta_rad) {
      aborted_ = fmt::format(
          "a segment bends by {:.3g} rad, beyond identification.max_theta_rad "
          "of {:.3g} rad",
          theta_rad, limits.max_theta_rad);
    } else if (speed_radps() > limits.max_speed_radps) {
      aborted_ = fmt::format(
          "a segment moves at {:.3g} rad/s, beyond "
          "identification.max_speed_radps of {:.3g} rad/s",
          speed_radps(), limits.max_speed_radps);
    }
    return aborted_.empty();
  }

  double speed_radps() const {
    if (recent_.size() < 2) return 0.0;
    const double span_s = recent_.back().time_s - recent_.front().time_s;
    double fastest = 0.0;
    for (Eigen::Index i = 0; i < experiment_.arm.size(); ++i)
      fastest = std::max(fastest,
                         (recent_.back().u_rad - recent_.front().u_rad).segment<2>(2 * i).norm());
    return span_s > 0.0 ? fastest / span_s : 0.0;
  }

  struct Seen {
    double time_s;
    Eigen::VectorXd u_rad;
  };

  // Called from LCM: nothing may be thrown through it. Storage grows, which is all it can fail at.
  void take_frame(std::size_t channel, const ReceivedMessage& packet) {
    const std::int64_t now_ns = monotonic_now_ns();
    if (mocap_.take(channel, packet.bytes, now_ns, frame_) != MocapReceipt::frame) return;
    if (frame_.frame_number == last_number_) return;
    last_number_ = frame_.frame_number;
    estimator_.estimate(frame_, estimate_);
    if (!std::all_of(estimate_.valid.begin(), estimate_.valid.begin() + experiment_.arm.size(),
                     [](bool each) { return each; }))
      return;
    const double time_s = 1e-9 * static_cast<double>(frame_.capture_ns);
    if (!recent_.empty() && time_s <= recent_.back().time_s) return;
    last_frame_ns_ = now_ns;
    recent_.push_back({time_s, estimate_.u_rad});
    while (recent_.size() > 10 && recent_[1].time_s < time_s - kSpeedSpan_s) recent_.pop_front();
    if (recording_) frames_.push_back(recent_.back());
  }

  void note_input(const std::vector<double>& bar, std::int64_t now_ns) {
    inputs_.push_back(
        {1e-9 * static_cast<double>(now_ns),
         Eigen::Map<const Eigen::VectorXd>(bar.data(), static_cast<Eigen::Index>(bar.size()))});
  }

  MotionRecord record() const {
    MotionRecord out;
    if (frames_.empty() || inputs_.empty()) return out;
    const auto fill = [&](const std::vector<Seen>& from, Eigen::VectorXd& time_s,
                          Eigen::MatrixXd& value) {
      const auto rows = static_cast<Eigen::Index>(from.size());
      time_s.resize(rows);
      value.resize(rows, from.front().u_rad.size());
      for (Eigen::Index k = 0; k < rows; ++k) {
        time_s[k] = from[static_cast<std::size_t>(k)].time_s - frames_.front().time_s;
        value.row(k) = from[static_cast<std::size_t>(k)].u_rad;
      }
    };
    fill(frames_, out.time_s, out.u_rad);
    // The zero that was commanded before the first step, then the steps.
    std::vector<Seen> inputs = {{std::min(frames_.front().time_s, inputs_.front().time_s) - 1.0,
                                 Eigen::VectorXd::Zero(inputs_.front().u_rad.size())}};
    inputs.insert(inputs.end(), inputs_.begin(), inputs_.end());
    fill(inputs, out.input.time_s, out.input.value);
    return out;
  }

  const Experiment& experiment_;
  InstanceLock lock_;
  MocapSource mocap_;
  CurvatureEstimator estimator_;
  LcmNode node_;
  const std::function<bool()>& stop_;
  const std::function<void(const std::string&)>& progress_;
  std::string aborted_;
  bool recording_ = false;
  std::deque<Seen> recent_;
  std::vector<Seen> frames_, inputs_;
  std::int64_t last_frame_ns_ = 0, next_command_ns_ = 0;
  std::int64_t last_number_ = INT64_MIN;
  MocapFrame frame_;
  CurvatureEstimate estimate_;
  softarm_messages::pressure_command_t message_;
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
