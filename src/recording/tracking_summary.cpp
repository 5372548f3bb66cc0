#include "softarm/recording/tracking_summary.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "softarm/base/json_writer.hpp"

namespace softarm {
namespace {

constexpr double kThetaForPhi = 0.05;  ///< rad; phi means little below

double angle_difference(double a, double b) {
  return std::remainder(a - b, 2.0 * std::numbers::pi);
}

}  // namespace

double TrackingSummary::MeanSquare::rms() const {
  return count > 0 ? std::sqrt(sum / static_cast<double>(count))
                   : std::numeric_limits<double>::quiet_NaN();
}

TrackingSummary::TrackingSummary(int segments, double tracking_from_s)
    : segments_(segments),
      tracking_from_s_(tracking_from_s),
      u_of_segment_(static_cast<std::size_t>(segments)),
      theta_(static_cast<std::size_t>(segments)),
      phi_(static_cast<std::size_t>(segments)) {}

void TrackingSummary::add(const LogRow& row, double period_s) {
  if (ticks_++ == 0) first_t_s_ = row.t_s;
  last_t_s_ = row.t_s + period_s;
  mode_s_[static_cast<std::size_t>(row.mode)] += period_s;
  const bool changed = transitions_.empty() || transitions_.back().mode != row.mode;
  if (changed && transitions_.size() < kMaxTransitions)
    transitions_.push_back({row.t_s, row.mode, row.reason});
  if (row.commanded.size() > 0)
    command_max_ = std::max(
        command_max_, torques_ ? row.commanded.cwiseAbs().maxCoeff() : row.commanded.maxCoeff());
  if (row.mode != Mode::active) {
    active_since_s_ = std::numeric_limits<double>::quiet_NaN();
    return;
  }
  ++active_ticks_;
  if (row.saturated) ++saturated_ticks_;
  if (std::isnan(active_since_s_)) active_since_s_ = row.t_s;
  add_tip(row);
  if (row.t_s - active_since_s_ >= tracking_from_s_) add_tracking(row);
}

void TrackingSummary::add_tip(const LogRow& row) {
  if (!row.tip || !row.tip_reference) return;
  const double error = (*row.tip - *row.tip_reference).norm(), since = row.t_s - active_since_s_;
  if (since >= tracking_from_s_) {
    tip_.add(row.t_s, error);
    tip_max_m_ = std::isnan(tip_max_m_) ? error : std::max(tip_max_m_, error);
  }
  if (!row.tip_is_asked) return;
  tip_is_asked_ = true;
  if (error >= kTipNear_m || since < tip_last_s_) tip_last_far_s_ = since;
  tip_last_s_ = since;
}

void TrackingSummary::TipErrors::add(double t_s, double error_m) {
  if (stretches_.empty() || stretches_.back().errors.count >= rows_a_stretch_) {
    if (stretches_.size() == kMostStretches) {
      for (std::size_t k = 0; k < kMostStretches / 2; ++k) {
        stretches_[k] = stretches_[2 * k];
        stretches_[k].errors.add(stretches_[2 * k + 1].errors);
      }
      stretches_.resize(kMostStretches / 2);
      rows_a_stretch_ *= 2;
    }
    stretches_.push_back({t_s, {}});
  }
  stretches_.back().errors.add(error_m);
}

TrackingSummary::MeanSquare TrackingSummary::TipErrors::since(double t_s) const {
  MeanSquare all;
  for (const Stretch& stretch : stretches_)
    if (stretch.begin_s >= t_s) all.add(stretch.errors);
  return all;
}

void TrackingSummary::add_tracking(const LogRow& row) {
  if (row.truth.size() != row.reference.size() || row.truth.size() != 2 * segments_) return;
  for (int i = 0; i < segments_; ++i) {
    const auto index = static_cast<std::size_t>(i);
    const Eigen::Vector2d truth = row.truth.segment<2>(2 * i);
    const Eigen::Vector2d reference = row.reference.segment<2>(2 * i);
    const Eigen::Vector2d error = reference - truth;
    for (const double component : error) {
      u_.add(component);
      u_of_segment_[index].add(component);
    }
    const double largest = error.cwiseAbs().maxCoeff();
    u_max_rad_ = std::isnan(u_max_rad_) ? largest : std::max(u_max_rad_, largest);
    theta_[index].add(reference.norm() - truth.norm());
    if (truth.norm() > kThetaForPhi && reference.norm() > kThetaForPhi)
      phi_[index].add(angle_difference(std::atan2(reference.y(), reference.x()),
                                       std::atan2(truth.y(), truth.x())));
  }
}

std::string TrackingSummary::json() const {
  JsonWriter json;
  json.open_object();
  json.member("duration_s", duration_s());
  json.member("ticks", ticks_);
  json.key("tracking");
  write_tracking(json);
  json.key(torques_ ? "torque_nm" : "pressure_bar");
  json.open_object();
  json.member("max", command_max_);
  json.close_object();
  json.member("saturated_fraction", active_ticks_ > 0 ? static_cast<double>(saturated_ticks_) /
                                                            static_cast<double>(active_ticks_)
                                                      : 0.0);
  json.key("modes");
  json.open_object();
  for (std::size_t k = 0; k < mode_s_.size(); ++k)
    if (mode_s_[k] > 0.0) json.member(name(static_cast<Mode>(k)), mode_s_[k]);
  json.close_object();
  json.key("transitions");
  json.open_array();
  for (const Transition& transition : transitions_) {
    json.open_object();
    json.member("t_s", transition.t_s);
    json.member("mode", name(transition.mode));
    json.member("reason", name(transition.reason));
    json.close_object();
  }
  json.close_array();
  if (frames_) write_frames(json);
  json.close_object();
  return json.text() + "\n";
}

void TrackingSummary::write_tracking(JsonWriter& json) const {
  const auto list = [&json](const char* key, const std::vector<MeanSquare>& values) {
    json.key(key);
    json.open_array();
    for (const MeanSquare& each : values) json.value(each.rms());
    json.close_array();
  };
  const double half_s = 0.5 * (first_t_s_ + last_t_s_);
  json.open_object();
  json.member("u_rms_rad", u_.rms());
  json.member("u_max_rad", u_max_rad_);
  list("u_rms_segment_rad", u_of_segment_);
  list("theta_rms_rad", theta_);
  list("phi_rms_rad", phi_);
  json.member("tip_rms_m", tip_.since(-std::numeric_limits<double>::infinity()).rms());
  json.member("tip_rms_second_half_m", tip_.since(half_s).rms());
  if (tip_is_asked_) {
    json.member("tip_max_m", tip_max_m_);
    json.member("tip_near_after_s", tip_last_far_s_ < tip_last_s_
                                        ? tip_last_far_s_
                                        : std::numeric_limits<double>::quiet_NaN());
  }
  json.close_object();
}

void TrackingSummary::write_frames(JsonWriter& json) const {
  json.key("frames");
  json.open_object();
  json.member("accepted", frames_->accepted);
  json.member("rejected", frames_->rejected());
  json.member("repeated", frames_->repeated);
  json.member("missing", frames_->missing);
  json.member("late", late_frames_);
  json.close_object();
}

std::string TrackingSummary::tip_line() const {
  const std::string arrived =
      tip_last_far_s_ < tip_last_s_
          ? fmt::format("within {:.0f} mm for good {:.2f} s after ACTIVE", 1e3 * kTipNear_m,
                        tip_last_far_s_)
          : fmt::format("not within {:.0f} mm at the end", 1e3 * kTipNear_m);
  return fmt::format(
      "tip error {:.3f} mm rms, {:.3f} mm at most, from {:g} s after ACTIVE on; {}\n",
      1e3 * tip_.since(-std::numeric_limits<double>::infinity()).rms(), 1e3 * tip_max_m_,
      tracking_from_s_, arrived);
}

std::string TrackingSummary::table() const {
  std::string text;
  if (u_.count > 0) {
    text = "segment   u rms [mrad]   theta rms [mrad]   phi rms [mrad]\n";
    for (int i = 0; i < segments_; ++i) {
      const auto index = static_cast<std::size_t>(i);
      text += fmt::format("{:>7}   {:>12.3f}   {:>16.3f}   {:>14.3f}\n", i + 1,
                          1e3 * u_of_segment_[index].rms(), 1e3 * theta_[index].rms(),
                          1e3 * phi_[index].rms());
    }
    text += fmt::format("    all   {:>12.3f}   (largest {:.3f} mrad)\n", 1e3 * u_.rms(),
                        1e3 * u_max_rad_);
  } else {
    text = "no tracking error: the true state is not known, or ACTIVE was too short\n";
  }
  if (tip_is_asked_) text += tip_line();
  if (frames_)
    text += fmt::format("frames: {} accepted, {} rejected, {} repeated, {} missing\n",
                        frames_->accepted, frames_->rejected() + late_frames_, frames_->repeated,
                        frames_->missing);
  const double saturated_percent =
      active_ticks_ > 0
          ? 100.0 * static_cast<double>(saturated_ticks_) / static_cast<double>(active_ticks_)
          : 0.0;
  text += fmt::format("largest commanded {} {:.3f} {}; saturated {:.2f} % of {} active ticks\n",
                      torques_ ? "moment" : "pressure", command_max_, torques_ ? "N m" : "bar",
                      saturated_percent, active_ticks_);
  return text;
}

}  // namespace softarm
