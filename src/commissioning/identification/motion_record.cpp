#include "softarm/commissioning/identification/motion_record.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace softarm {

MotionRecord MotionRecord::part(double from_s, double to_s, double lead_s) const {
  const auto first =
      std::lower_bound(time_s.begin(), time_s.end(), from_s - lead_s) - time_s.begin();
  const auto last = std::lower_bound(time_s.begin(), time_s.end(), to_s) - time_s.begin();
  MotionRecord out;
  out.time_s = time_s.segment(first, std::max<Eigen::Index>(0, last - first));
  out.u_rad = u_rad.middleRows(first, out.time_s.size());
  if (chord_m.rows() > 0) out.chord_m = chord_m.middleRows(first, out.time_s.size());
  out.lengths = lengths;
  if (lengths.pressed_m.rows() > 0)
    out.lengths.pressed_m = lengths.pressed_m.middleRows(first, out.time_s.size());
  out.input = input;
  out.noise_rad = noise_rad;
  out.scored_from_s = std::max(scored_from_s, from_s);
  return out;
}

InputTrack InputTrack::averaged(double span_s) const {
  const Eigen::Index count = time_s.size();
  if (held || count < 3 || !(span_s > 0.0)) return *this;
  InputTrack out = *this;
  Eigen::Index to = 1;
  for (Eigen::Index k = 1; k + 1 < count; ++to) {
    const Eigen::Index first = k;
    while (k + 1 < count && time_s[k] - time_s[first] < span_s) ++k;
    out.time_s[to] = time_s.segment(first, k - first).mean();
    out.value.row(to) = value.middleRows(first, k - first).colwise().mean();
  }
  out.time_s[to] = time_s[count - 1];
  out.value.row(to) = value.row(count - 1);
  out.time_s.conservativeResize(to + 1);
  out.value.conservativeResize(to + 1, Eigen::NoChange);
  return out;
}

MotionRecord MotionRecord::thinned(double apart_s) const {
  std::vector<Eigen::Index> kept;
  for (Eigen::Index k = 0; k < time_s.size(); ++k)
    if (kept.empty() || time_s[k] - time_s[kept.back()] >= apart_s) kept.push_back(k);
  MotionRecord out = *this;
  out.time_s = time_s(kept).eval();
  out.u_rad = u_rad(kept, Eigen::all).eval();
  if (chord_m.rows() > 0) out.chord_m = chord_m(kept, Eigen::all).eval();
  if (lengths.pressed_m.rows() > 0)
    out.lengths.pressed_m = lengths.pressed_m(kept, Eigen::all).eval();
  return out;
}

Eigen::MatrixXd chord_lengths_m(const MotionRecord& record) {
  Eigen::MatrixXd out(record.chord_m.rows(), record.chord_m.cols() / 3);
  for (Eigen::Index k = 0; k < out.rows(); ++k)
    for (Eigen::Index i = 0; i < out.cols(); ++i) {
      const Eigen::Vector3d t = record.chord_m.row(k).segment<3>(3 * i);
      const double across = std::hypot(t.x(), t.y());
      out(k, i) = t.norm();
      if (across > 0.0) out(k, i) *= t.norm() * std::atan2(across, t.z()) / across;
    }
  return out;
}

LaggedInput::LaggedInput(const InputTrack& track, double lag_s, double dead_time_s)
    : LaggedInput(track,
                  std::vector<FillVentLag>(static_cast<std::size_t>(track.value.cols()),
                                           FillVentLag{lag_s, lag_s}),
                  dead_time_s) {}

LaggedInput::LaggedInput(const InputTrack& track, std::vector<FillVentLag> lags, double dead_time_s)
    : track_(track),
      lags_(std::move(lags)),
      dead_time_s_(dead_time_s),
      now_s_(track.time_s[0]),
      state_(track.value.row(0)) {}

void LaggedInput::advance(double t_s) {
  const bool last = index_ + 1 >= track_.time_s.size();
  const double step_s = t_s - now_s_;
  now_s_ = t_s;
  if (step_s <= 0.0) return;
  const bool held = track_.held || last;
  const double span_s = held ? 1.0 : track_.time_s[index_ + 1] - track_.time_s[index_];
  const double into_s = t_s - track_.time_s[index_];
  for (Eigen::Index j = 0; j < state_.size(); ++j) {
    const FillVentLag& lag = lags_[static_cast<std::size_t>(j)];
    const double from = track_.value(index_, j);
    if (held) {
      state_[j] = lag.step(state_[j], from, step_s);
      continue;
    }
    const double slope = (track_.value(index_ + 1, j) - from) / span_s;
    const double to = from + into_s * slope;
    const double lag_s = lag.time_s(to - 0.5 * step_s * slope, state_[j]);
    if (!(lag_s > 0.0)) {
      state_[j] = to;
      continue;
    }
    const double end = to - lag_s * slope;  // behind a ramp by its lag
    state_[j] = end + std::exp(-step_s / lag_s) * (state_[j] - (end - step_s * slope));
  }
}

void LaggedInput::at(double t_s, Eigen::Ref<Eigen::VectorXd> out, bool before) {
  const double t = t_s - dead_time_s_;
  const Eigen::Index count = track_.time_s.size();
  while (index_ + 1 < count &&
         (before ? track_.time_s[index_ + 1] < t : track_.time_s[index_ + 1] <= t)) {
    advance(track_.time_s[index_ + 1]);
    ++index_;
  }
  if (t > now_s_) advance(t);
  const bool line = !track_.held && t >= track_.time_s[0] && index_ + 1 < count;
  const double x =
      line ? (t - track_.time_s[index_]) / (track_.time_s[index_ + 1] - track_.time_s[index_])
           : 0.0;
  for (Eigen::Index j = 0; j < out.size(); ++j) {
    const FillVentLag& lag = lags_[static_cast<std::size_t>(j)];
    if (lag.fill_s > 0.0 || lag.vent_s > 0.0) {
      out[j] = state_[j];
      continue;
    }
    out[j] = track_.value(index_, j);
    if (line) out[j] += x * (track_.value(index_ + 1, j) - track_.value(index_, j));
  }
}

}  // namespace softarm
