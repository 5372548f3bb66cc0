#include "softarm/commissioning/identification/log_record.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "commissioning/median.hpp"
#include "softarm/base/time.hpp"
#include "softarm/estimation/curvature_estimator.hpp"
#include "softarm/transport/event_log.hpp"
#include "softarm/transport/log_timeline.hpp"
#include "softarm/transport/message_decoding.hpp"
#include "softarm/transport/mocap_source.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {
namespace {

constexpr std::size_t kFewest = 8;
constexpr float kMost_bar = 1e3;  ///< beyond it is damage
// What is missing for longer ends a part: pressures, which are then not known, and frames, whose
// motion would only be simulated. Slower logs: so many of their periods.
constexpr double kLongestPressureGap_s = 2.0, kLongestFrameGap_s = 20.0, kPeriods = 20.0;
constexpr double kSettle_s = 2.0;  ///< after a gap the simulation starts in an unknown state

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

/// The longest time of these that is not a gap.
double longest_wait_s(const Eigen::VectorXd& time_s, double least_s) {
  std::vector<double> waits;
  for (Eigen::Index k = 1; k < time_s.size(); ++k) waits.push_back(time_s[k] - time_s[k - 1]);
  return std::max(least_s, kPeriods * median(std::move(waits)));
}

/// The times in which both frames and pressures are there: the one with most frames.
MotionRecord longest_part(const MotionRecord& all, std::string& left_out) {
  std::vector<double> begins = {all.time_s[0]}, ends;
  const auto cut = [&](const Eigen::VectorXd& time_s, double longest_s) {
    for (Eigen::Index k = 1; k < time_s.size(); ++k) {
      if (time_s[k] - time_s[k - 1] <= longest_s) continue;
      ends.push_back(time_s[k - 1]);
      begins.push_back(time_s[k]);
    }
  };
  cut(all.time_s, longest_wait_s(all.time_s, kLongestFrameGap_s));
  cut(all.input.time_s, longest_wait_s(all.input.time_s, kLongestPressureGap_s));
  if (ends.empty()) return all;
  ends.push_back(all.time_s[all.time_s.size() - 1]);
  std::sort(begins.begin(), begins.end());
  std::sort(ends.begin(), ends.end());
  MotionRecord best;
  for (std::size_t k = 0; k < begins.size(); ++k) {
    MotionRecord part = all.part(begins[k], ends[k] + 1e-6, 0.0);
    if (k > 0) part.scored_from_s = begins[k] + kSettle_s;
    if (part.time_s.size() > best.time_s.size()) best = std::move(part);
  }
  if (best.time_s.size() < static_cast<Eigen::Index>(kFewest)) return all;
  const double from_s = best.time_s[0], to_s = best.time_s[best.time_s.size() - 1];
  left_out = fmt::format(
      "frames or pressures are missing for long, {} times: only {:.1f} to {:.1f} s of {:.1f} s, "
      "the longest part without, was used",
      begins.size() - 1, from_s, to_s, all.time_s[all.time_s.size() - 1]);
  // What was commanded before the gap is not known to have lasted.
  const auto first =
      std::lower_bound(best.input.time_s.begin(), best.input.time_s.end(), from_s - 1.0) -
      best.input.time_s.begin();
  const Eigen::Index kept = best.input.time_s.size() - first;
  best.input.time_s = best.input.time_s.tail(kept).eval();
  best.input.value = best.input.value.bottomRows(kept).eval();
  return best;
}

class LogReader {
 public:
  LogReader(const Experiment& experiment, LoggedInput input)
      : experiment_(experiment),
        input_(input),
        timeline_(experiment.transport),
        mocap_(experiment.transport, experiment.safety, experiment.arm),
        estimator_(experiment.estimation, experiment.arm,
                   body_noise(experiment.estimation, experiment.arm.size())) {
    chambers_ = static_cast<std::size_t>(chamber_count(experiment.actuation));
  }

  void take(const LogEvent& event) {
    const LcmSettings& lcm = experiment_.transport.lcm;
    const auto arrival_ns = timeline_.arrival_ns(event);
    const auto channel = mocap_.find(event.channel);
    const bool input =
        event.channel ==
        (input_ == LoggedInput::commanded ? lcm.command_channel : lcm.measurement_channel);
    if (!channel && !input) return;
    const bool used =
        arrival_ns && (channel ? take_frame(*channel, event.data, *arrival_ns)
                       : input_ == LoggedInput::commanded
                           ? take_pressures(event.data, command_message_, *arrival_ns)
                           : take_pressures(event.data, measurement_message_, *arrival_ns));
    if (!used) ++malformed_;
  }
  /// Messages on our channels that could not be decoded.
  std::int64_t malformed() const { return malformed_; }
  const LogTimeline& timeline() const { return timeline_; }

  /// @param left_out  gets what is not in the record, for a person
  MotionRecord record(const std::string& path, std::string& left_out) const {
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
    const Eigen::Index n = experiment_.arm.size();
    const Eigen::MatrixXd rows = frames_.rows(5 * n);
    out.u_rad = rows.leftCols(2 * n);
    out.chord_m = rows.rightCols(3 * n);
    out.noise_rad = std::sqrt(
        variance_rad2_ / static_cast<double>(frames_.time_s.size() * static_cast<std::size_t>(n)));
    out.input.time_s = inputs_.times().array() - frames_.time_s.front();
    out.input.value = inputs_.rows(static_cast<Eigen::Index>(chambers_));
    out.input.held = input_ == LoggedInput::commanded;
    return longest_part(out, left_out);
  }

 private:
  double time_s(std::int64_t time_ns) {
    if (start_us_ < 0) start_us_ = time_ns / 1000;
    return 1e-6 * static_cast<double>(time_ns / 1000 - start_us_);
  }

  /// False if the message could not be decoded.
  bool take_frame(std::size_t channel, std::span<const std::byte> bytes, std::int64_t arrival_ns) {
    const MocapReceipt receipt = mocap_.take(channel, bytes, arrival_ns, frame_);
    if (receipt == MocapReceipt::frame && frame_.frame_number != last_frame_) add_frame();
    return receipt != MocapReceipt::malformed;
  }

  void add_frame() {
    last_frame_ = frame_.frame_number;
    estimator_.estimate(frame_, estimate_);
    if (!std::all_of(estimate_.valid.begin(), estimate_.valid.begin() + experiment_.arm.size(),
                     [](bool each) { return each; }))
      return;
    const Eigen::Index n = experiment_.arm.size();
    Eigen::VectorXd row(5 * n);
    row.head(2 * n) = estimate_.u_rad;
    for (Eigen::Index i = 0; i < n; ++i) {
      const BodyPose& upper = frame_.body[static_cast<std::size_t>(i)];
      const BodyPose& lower = frame_.body[static_cast<std::size_t>(i) + 1];
      row.segment<3>(2 * n + 3 * i) =
          upper.orientation.conjugate() * (lower.position_m - upper.position_m);
    }
    if (!row.allFinite()) return;
    for (Eigen::Index i = 0; i < n; ++i)
      variance_rad2_ += estimate_.variance_rad2[static_cast<std::size_t>(i)];
    frames_.add(time_s(frame_.capture_ns), row.data(), static_cast<std::size_t>(row.size()));
  }

  template <class Message>
  bool take_pressures(std::span<const std::byte> bytes, Message& message, std::int64_t arrival_ns) {
    if (!decode(bytes, message)) return false;
    if (message.pressure_bar.size() != chambers_) {
      ++wrong_size_;
      return true;
    }
    if (!std::all_of(message.pressure_bar.begin(), message.pressure_bar.end(),
                     [](float p) { return std::abs(p) <= kMost_bar; }))
      return false;
    const std::vector<double> row(message.pressure_bar.begin(), message.pressure_bar.end());
    inputs_.add(time_s(arrival_ns), row.data(), row.size());
    return true;
  }

  const Experiment& experiment_;
  LoggedInput input_;
  LogTimeline timeline_;
  MocapSource mocap_;
  CurvatureEstimator estimator_;
  std::size_t chambers_ = 0;
  Samples frames_, inputs_;
  std::int64_t start_us_ = -1;
  std::int64_t last_frame_ = kNever;
  std::int64_t wrong_size_ = 0, malformed_ = 0;
  double variance_rad2_ = 0.0;  ///< of u, summed over segments and frames
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
  LoggedMotion out;
  std::string left_out;
  out.record = reader.record(log.string(), left_out);
  const auto add = [](std::string& text, const std::string& more) {
    if (!more.empty()) text += (text.empty() ? "" : "; ") + more;
  };
  add(out.damage, events.damage_text());
  if (reader.malformed() > 0)
    add(out.damage,
        fmt::format("{} messages on our channels could not be decoded, or have no valid time",
                    reader.malformed()));
  add(out.damage, left_out);
  add(reader.timeline().restarted() ? out.damage : out.notes, reader.timeline().text());
  return out;
}

}  // namespace softarm
