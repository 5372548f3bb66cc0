#include "softarm/commissioning/identification/log_record.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <lcm/lcm-cpp.hpp>
#include <stdexcept>
#include <vector>

#include "softarm/base/time.hpp"
#include "softarm/estimation/curvature_estimator.hpp"
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

  void take(const lcm::LogEvent& event) {
    const LcmSettings& lcm = experiment_.transport.lcm;
    const std::span bytes(static_cast<const std::byte*>(event.data),
                          static_cast<std::size_t>(event.datalen));
    if (const auto channel = mocap_.find(event.channel))
      take_frame(*channel, bytes, event.timestamp);
    if (input_ == LoggedInput::commanded && event.channel == lcm.command_channel &&
        decode(bytes, command_message_))
      take_pressures(event.timestamp, command_message_.pressure_bar);
    if (input_ == LoggedInput::measured && event.channel == lcm.measurement_channel &&
        decode(bytes, measurement_message_))
      take_pressures(event.timestamp, measurement_message_.pressure_bar);
  }

  MotionRecord record(const std::string& path) const {
    const LcmSettings& lcm = experiment_.transport.lcm;
    if (frames_.time_s.size() < kFewest)
      throw std::runtime_error(
          fmt::format("{}: expected at least {} frames with every segment on {}, got {}; "
                      "daemon.lcm.mocap_channel and daemon.bodies say where to look",
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
  double time_s(std::int64_t time_us) {
    if (start_us_ < 0) start_us_ = time_us;
    return 1e-6 * static_cast<double>(time_us - start_us_);
  }

  void take_frame(std::size_t channel, std::span<const std::byte> bytes, std::int64_t arrival_us) {
    arrival_ns_ = std::max(arrival_ns_, arrival_us * 1000);
    if (mocap_.take(channel, bytes, arrival_ns_, frame_) != MocapReceipt::frame) return;
    if (frame_.frame_number == last_frame_) return;
    last_frame_ = frame_.frame_number;
    estimator_.estimate(frame_, estimate_);
    if (!std::all_of(estimate_.valid.begin(), estimate_.valid.begin() + experiment_.arm.size(),
                     [](bool each) { return each; }))
      return;
    const Eigen::VectorXd u = estimate_.u_rad;
    frames_.add(time_s(frame_.capture_ns / 1000), u.data(), static_cast<std::size_t>(u.size()));
  }

  void take_pressures(std::int64_t arrival_us, const std::vector<float>& pressures) {
    if (pressures.size() != chambers_) {
      ++wrong_size_;
      return;
    }
    const std::vector<double> row(pressures.begin(), pressures.end());
    inputs_.add(time_s(arrival_us), row.data(), row.size());
  }

  const Experiment& experiment_;
  LoggedInput input_;
  MocapSource mocap_;
  CurvatureEstimator estimator_;
  std::size_t chambers_ = 0;
  Samples frames_, inputs_;
  std::int64_t start_us_ = -1, arrival_ns_ = 0;
  std::int64_t last_frame_ = kNever;
  std::int64_t wrong_size_ = 0;
  MocapFrame frame_;
  CurvatureEstimate estimate_;
  softarm_messages::pressure_command_t command_message_;
  softarm_messages::pressure_measurement_t measurement_message_;
};

}  // namespace

MotionRecord read_log(const Experiment& experiment, const std::filesystem::path& log,
                      LoggedInput input) {
  if (experiment.actuation.kind == ActuationKind::torque)
    throw std::runtime_error("a log holds pressures; expected actuation by chambers");
  lcm::LogFile file(log.string(), "r");
  if (!file.good())
    throw std::runtime_error(fmt::format(
        "cannot read {}: is it an LCM log (softarm import, lcm-logger)?", log.string()));
  LogReader reader(experiment, input);
  while (const lcm::LogEvent* event = file.readNextEvent()) reader.take(*event);
  return reader.record(log.string());
}

}  // namespace softarm
