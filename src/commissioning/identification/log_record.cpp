#include "softarm/commissioning/identification/log_record.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <vector>

#include "softarm/base/time.hpp"
#include "softarm/estimation/curvature_estimator.hpp"
#include "softarm/transport/event_log.hpp"
#include "softarm/transport/message_decoding.hpp"
#include "softarm/transport/mocap_source.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {
namespace {

constexpr std::size_t kFewest = 8;

struct Samples {
  std::vector<double> time_s;
  std::vector<double> values;  ///< row by row

  /// Times increase; of two at once the later counts.
  void add(double t_s, const double* row, std::size_t width) {
    if (!time_s.empty() && t_s <= time_s.back()) {
      std::copy(row, row + width, values.end() - static_cast<std::ptrdiff_t>(width));
      return;
    }
    time_s.push_back(t_s);
    values.insert(values.end(), row, row + width);
  }
  Eigen::VectorXd times() const {
    return Eigen::Map<const Eigen::VectorXd>(time_s.data(),
                                             static_cast<Eigen::Index>(time_s.size()));
  }
  Eigen::MatrixXd rows(Eigen::Index width) const {
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    return Eigen::Map<const RowMajor>(values.data(), static_cast<Eigen::Index>(time_s.size()),
                                      width);
  }
};

class LogReader {
 public:
  LogReader(const Experiment& experiment, LoggedInput input)
      : experiment_(experiment),
        input_(input),
        mocap_(experiment.transport, experiment.safety, experiment.arm),
        estimator_(experiment.estimation, experiment.arm,
                   body_noise(experiment.estimation, experiment.arm.size())) {
    chambers_ = static_cast<std::size_t>(chamber_count(experiment.actuation));
  }

  void take(const LogEvent& event) {
    const LcmSettings& lcm = experiment_.transport.lcm;
    const auto channel = mocap_.find(event.channel);
    const bool input =
        event.channel ==
        (input_ == LoggedInput::commanded ? lcm.command_channel : lcm.measurement_channel);
    if (!channel && !input) return;
    const auto arrival_ns = event.arrival_ns();
    const bool used =
        arrival_ns && (channel ? take_frame(*channel, event.data, *arrival_ns)
                       : input_ == LoggedInput::commanded
                           ? take_pressures(event.data, command_message_, *arrival_ns)
                           : take_pressures(event.data, measurement_message_, *arrival_ns));
    if (!used) ++malformed_;
  }
  /// Messages on our channels that could not be decoded.
  std::int64_t malformed() const { return malformed_; }

  MotionRecord record(const std::string& path) const {
    const LcmSettings& lcm = experiment_.transport.lcm;
    if (frames_.time_s.size() < kFewest)
      throw std::runtime_error(
          fmt::format("{}: expected at least {} frames with every segment on {}, got {}; "
                      "see daemon.lcm.mocap_channel and daemon.bodies",
                      path, kFewest, mocap_.channels().front(), frames_.time_s.size()));
    if (inputs_.time_s.size() < 2)
      throw std::runtime_error(fmt::format(
          "{}: expected pressures of {} chambers on {}, got {} such messages and {} of another "
          "size; --input chooses between commanded and measured ones",
          path, chambers_,
          input_ == LoggedInput::commanded ? lcm.command_channel : lcm.measurement_channel,
          inputs_.time_s.size(), wrong_size_));
    MotionRecord out;
    out.time_s = frames_.times().array() - frames_.time_s.front();
    out.u_rad = frames_.rows(experiment_.arm.dof());
    out.input.time_s = inputs_.times().array() - frames_.time_s.front();
    out.input.value = inputs_.rows(static_cast<Eigen::Index>(chambers_));
    out.input.held = input_ == LoggedInput::commanded;
    return out;
  }

 private:
  double time_s(std::int64_t time_ns) {
    if (start_us_ < 0) start_us_ = time_ns / 1000;
    return 1e-6 * static_cast<double>(time_ns / 1000 - start_us_);
  }

  /// False if the message could not be decoded.
  bool take_frame(std::size_t channel, std::span<const std::byte> bytes, std::int64_t arrival_ns) {
    arrival_ns_ = std::max(arrival_ns_, arrival_ns);
    const MocapReceipt receipt = mocap_.take(channel, bytes, arrival_ns_, frame_);
    if (receipt == MocapReceipt::frame && frame_.frame_number != last_frame_) add_frame();
    return receipt != MocapReceipt::malformed;
  }

  void add_frame() {
    last_frame_ = frame_.frame_number;
    estimator_.estimate(frame_, estimate_);
    if (!std::all_of(estimate_.valid.begin(), estimate_.valid.begin() + experiment_.arm.size(),
                     [](bool each) { return each; }))
      return;
    const Eigen::VectorXd u = estimate_.u_rad;
    frames_.add(time_s(frame_.capture_ns), u.data(), static_cast<std::size_t>(u.size()));
  }

  template <class Message>
  bool take_pressures(std::span<const std::byte> bytes, Message& message, std::int64_t arrival_ns) {
    if (!decode(bytes, message)) return false;
    if (message.pressure_bar.size() != chambers_) {
      ++wrong_size_;
      return true;
    }
    const std::vector<double> row(message.pressure_bar.begin(), message.pressure_bar.end());
    inputs_.add(time_s(arrival_ns), row.data(), row.size());
    return true;
  }

  const Experiment& experiment_;
  LoggedInput input_;
  MocapSource mocap_;
  CurvatureEstimator estimator_;
  std::size_t chambers_ = 0;
  Samples frames_, inputs_;
  std::int64_t start_us_ = -1, arrival_ns_ = 0;
  std::int64_t last_frame_ = kNever;
  std::int64_t wrong_size_ = 0, malformed_ = 0;
  MocapFrame frame_;
  CurvatureEstimate estimate_;
  softarm_messages::pressure_command_t command_message_;
  softarm_messages::pressure_measurement_t measurement_message_;
};

}  // namespace

LoggedMotion read_log(const Experiment& experiment, const std::filesystem::path& log,
                      LoggedInput input) {
  if (experiment.actuation.kind == ActuationKind::torque)
    throw std::runtime_error("a log holds pressures; expected actuation by chambers");
  EventLogReader events(log);
  LogReader reader(experiment, input);
  for (LogEvent event; events.next(event);) reader.take(event);
  std::string damage = events.damage_text();
  if (reader.malformed() > 0)
    damage +=
        fmt::format("{}{} messages on our channels could not be decoded, or have no valid time",
                    damage.empty() ? "" : "; ", reader.malformed());
  return {reader.record(log.string()), damage};
}

}  // namespace softarm
