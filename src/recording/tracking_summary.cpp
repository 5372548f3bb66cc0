#include "softarm/recording/tracking_summary.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

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
      phi_(static_cast<std::size_t>(segments)),
      elongation_(static_cast<std::size_t>(segments)) {}

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
  if (row.observer && row.observer->running) add_observer(*row.observer);
  if (row.t_s - active_since_s_ < tracking_from_s_) return;
  add_tracking(row);
  add_elongation(row);
}

void TrackingSummary::add_elongation(const LogRow& row) {
  const Eigen::Index n = segments_;
  if (row.elongation_truth.size() != n || row.elongation_reference.size() != n) return;
  for (int i = 0; i < segments_; ++i) {
    const double error_m = row.elongation_reference[i] - row.elongation_truth[i];
    elongation_[static_cast<std::size_t>(i)].add(error_m);
    elongation_max_m_ = std::max(elongation_max_m_, std::abs(error_m));
  }
}

void TrackingSummary::add_observer(const ObserverReport& report) {
  if (report.segments != segments_) return;
  observer_ = report;
  disturbance_.resize(static_cast<std::size_t>(segments_));
  ++observed_ticks_;
  surprised_ticks_ += report.surprised ? 1 : 0;
  wrong_model_ticks_ += report.wrong_model ? 1 : 0;
  nis_sum_ += report.nis;
  for (int i = 0; i < segments_; ++i) {
    const double size_nm = report.correction.disturbance_nm.segment<2>(2 * i).norm();
    disturbance_[static_cast<std::size_t>(i)].add(size_nm);
    disturbance_max_nm_ = std::max(disturbance_max_nm_, size_nm);
  }
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

struct TrackingSummary::Json {
  using Value = nlohmann::ordered_json;

  static Value rms_of(const std::vector<MeanSquare>& values) {
    Value list = Value::array();
    for (const MeanSquare& each : values) list.push_back(each.rms());
    return list;
  }

  static Value tracking(const TrackingSummary& of) {
    const double half_s = 0.5 * (of.first_t_s_ + of.last_t_s_);
    Value json{{"u_rms_rad", of.u_.rms()},
               {"u_max_rad", of.u_max_rad_},
               {"u_rms_segment_rad", rms_of(of.u_of_segment_)},
               {"theta_rms_rad", rms_of(of.theta_)},
               {"phi_rms_rad", rms_of(of.phi_)},
               {"tip_rms_m", of.tip_rms_m()},
               {"tip_rms_second_half_m", of.tip_.since(half_s).rms()}};
    if (of.elongation_.front().count > 0) {
      json["elongation_rms_segment_m"] = rms_of(of.elongation_);
      json["elongation_max_m"] = of.elongation_max_m_;
    }
    if (of.tip_is_asked_) {
      json["tip_max_m"] = of.tip_max_m_;
      json["tip_near_after_s"] = of.tip_last_far_s_ < of.tip_last_s_
                                     ? of.tip_last_far_s_
                                     : std::numeric_limits<double>::quiet_NaN();
    }
    return json;
  }

  /// @param elongation_m empty where segments do not stretch
  static Value correction(const ModelCorrection& of, const SegmentScalars& elongation_m,
                          int segments) {
    Value json{{"stiffness", Value::array()},
               {"damping", Value::array()},
               {"gain", Value::array()},
               {"load", Value::array()}};
    for (Eigen::Index i = 0; i < elongation_m.size(); ++i) {
      const SegmentCorrection& segment = of.segment[static_cast<std::size_t>(i)];
      json["elongation_m"].push_back(elongation_m[i]);
      json["axial_force_n"].push_back(segment.axial_force_n);
      json["axial_stiffness"].push_back(segment.axial_stiffness);
      json["axial_damping"].push_back(segment.axial_damping);
      json["axial_gain"].push_back(segment.axial_gain);
    }
    for (int i = 0; i < segments; ++i) {
      const SegmentCorrection& segment = of.segment[static_cast<std::size_t>(i)];
      json["stiffness"].push_back(segment.stiffness);
      json["damping"].push_back(segment.damping);
      json["gain"].push_back(segment.gain);
      json["load"].push_back({segment.load.x(), segment.load.y()});
    }
    return json;
  }

  static Value observer(const TrackingSummary& of) {
    const ObserverReport& newest = *of.observer_;
    return {
        {"correction", correction(newest.correction, newest.elongation_m, of.segments_)},
        {"deviation", correction(newest.deviation, newest.elongation_deviation_m, of.segments_)},
        {"disturbance_rms_nm", rms_of(of.disturbance_)},
        {"disturbance_max_nm", of.disturbance_max_nm_},
        {"nis", of.nis()},
        {"surprised_fraction", of.surprised_fraction()},
        {"wrong_model_fraction",
         static_cast<double>(of.wrong_model_ticks_) / static_cast<double>(of.observed_ticks_)},
        {"failures", newest.failures}};
  }

  static Value modes(const TrackingSummary& of) {
    Value json = Value::object();
    for (std::size_t k = 0; k < of.mode_s_.size(); ++k)
      if (of.mode_s_[k] > 0.0) json[name(static_cast<Mode>(k))] = of.mode_s_[k];
    return json;
  }

  static Value arm(const ArmParameters& arm) {
    const auto numbers = [](const Eigen::Vector3d& v) { return Value{v.x(), v.y(), v.z()}; };
    Value rows = Value::array(), lengths = Value::array();
    for (Eigen::Index i = 0; i < 3; ++i)
      rows.push_back(numbers(arm.base_rotation.row(i).transpose()));
    for (const SegmentParameters& segment : arm.segments) lengths.push_back(segment.length_m);
    return {{"length_m", lengths},
            {"base_rotation", rows},
            {"base_position_m", numbers(arm.base_position_m)}};
  }

  static Value transitions(const TrackingSummary& of) {
    Value list = Value::array();
    for (const Transition& each : of.transitions_)
      list.push_back({{"t_s", each.t_s}, {"mode", name(each.mode)}, {"reason", name(each.reason)}});
    return list;
  }
};

std::string TrackingSummary::json() const {
  const double saturated =
      active_ticks_ > 0 ? static_cast<double>(saturated_ticks_) / static_cast<double>(active_ticks_)
                        : 0.0;
  Json::Value json{{"duration_s", duration_s()},
                   {"ticks", ticks_},
                   {"tracking", Json::tracking(*this)},
                   {torques_ ? "torque_nm" : "pressure_bar", {{"max", command_max_}}},
                   {"saturated_fraction", saturated},
                   {"modes", Json::modes(*this)},
                   {"transitions", Json::transitions(*this)}};
  if (observer_) json["observer"] = Json::observer(*this);
  if (frames_)
    json["frames"] = {{"accepted", frames_->accepted},
                      {"rejected", frames_->rejected()},
                      {"repeated", frames_->repeated},
                      {"missing", frames_->missing},
                      {"late", late_frames_}};
  if (arm_) json["arm"] = Json::arm(*arm_);
  return json.dump() + "\n";
}

std::string TrackingSummary::observer_table() const {
  std::string text =
      "observer: the arm relative to its model, with standard deviations; loads in g\n"
      "segment      stiffness [%]        damping [%]           gain [%]   load x           load y  "
      "          disturbance [N m rms]\n";
  const auto pair = [](double value, double deviation, double unit, int digits) {
    return fmt::format("{:+.{}f} +- {:.{}f}", unit * value, digits, unit * deviation, digits);
  };
  for (int i = 0; i < segments_; ++i) {
    const auto index = static_cast<std::size_t>(i);
    const SegmentCorrection& is = observer_->correction.segment[index];
    const SegmentCorrection& sigma = observer_->deviation.segment[index];
    text += fmt::format(
        "{:>7}   {:>16}   {:>16}   {:>16}   {:>16} {:>16}   {:>8.4f}\n", i + 1,
        pair(is.stiffness, sigma.stiffness, 100.0, 1), pair(is.damping, sigma.damping, 100.0, 1),
        pair(is.gain, sigma.gain, 100.0, 1), pair(is.load.x(), sigma.load.x(), 1.0, 3),
        pair(is.load.y(), sigma.load.y(), 1.0, 3), disturbance_[index].rms());
  }
  const SegmentScalars& e_m = observer_->elongation_m;
  if (e_m.size() == segments_)
    text +=
        "segment    elongation [mm]            k_a [%]         beta_a [%]         area [%]"
        "      axial force [N]\n";
  for (int i = 0; i < e_m.size() && e_m.size() == segments_; ++i) {
    const auto index = static_cast<std::size_t>(i);
    const SegmentCorrection& is = observer_->correction.segment[index];
    const SegmentCorrection& sigma = observer_->deviation.segment[index];
    text += fmt::format("{:>7}   {:>16}   {:>16}   {:>16} {:>16}     {:>16}\n", i + 1,
                        pair(e_m[i], observer_->elongation_deviation_m[i], 1e3, 2),
                        pair(is.axial_stiffness, sigma.axial_stiffness, 100.0, 1),
                        pair(is.axial_damping, sigma.axial_damping, 100.0, 1),
                        pair(is.axial_gain, sigma.axial_gain, 100.0, 1),
                        pair(is.axial_force_n, sigma.axial_force_n, 1.0, 2));
  }
  const auto percent = [this](std::int64_t ticks) {
    return 100.0 * static_cast<double>(ticks) / static_cast<double>(observed_ticks_);
  };
  text += fmt::format("innovations {:.3f} of their covariance; surprised {:.2f} % of the time\n",
                      nis(), percent(surprised_ticks_));
  if (wrong_model_ticks_ > 0)
    text += fmt::format(
        "WRONG MODEL: a parameter stood at the limit of what a correction may be {:.2f} % of the "
        "time\n",
        percent(wrong_model_ticks_));
  return text;
}

std::string TrackingSummary::tip_line() const {
  const std::string arrived =
      tip_last_far_s_ < tip_last_s_
          ? fmt::format("within {:.0f} mm for good {:.2f} s after ACTIVE", 1e3 * kTipNear_m,
                        tip_last_far_s_)
          : fmt::format("not within {:.0f} mm at the end", 1e3 * kTipNear_m);
  return fmt::format(
      "tip error {:.3f} mm rms, {:.3f} mm at most, from {:g} s after ACTIVE on; {}\n",
      1e3 * tip_rms_m(), 1e3 * tip_max_m_, tracking_from_s_, arrived);
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
  if (elongation_.front().count > 0) {
    MeanSquare all;
    for (const MeanSquare& each : elongation_) all.add(each);
    text += fmt::format("elongation error {:.3f} mm rms, {:.3f} mm at most\n", 1e3 * all.rms(),
                        1e3 * elongation_max_m_);
  }
  if (tip_is_asked_) text += tip_line();
  if (observer_) text += observer_table();
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
