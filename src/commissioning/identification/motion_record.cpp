#include "softarm/commissioning/identification/motion_record.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace softarm {

MotionRecord MotionRecord::part(double from_s, double to_s, double lead_s) const {
  const auto first =
      std::lower_bound(time_s.begin(), time_s.end(), from_s - lead_s) - time_s.begin();
  const auto last = std::lower_bound(time_s.begin(), time_s.end(), to_s) - time_s.begin();
  MotionRecord out;
  out.time_s = time_s.segment(first, std::max<Eigen::Index>(0, last - first));
  out.u_rad = u_rad.middleRows(first, out.time_s.size());
  out.input = input;
  out.scored_from_s = std::max(scored_from_s, from_s);
  return out;
}

MotionRecord MotionRecord::thinned(double apart_s) const {
  std::vector<Eigen::Index> kept;
  for (Eigen::Index k = 0; k < time_s.size(); ++k)
    if (kept.empty() || time_s[k] - time_s[kept.back()] >= apart_s) kept.push_back(k);
  MotionRecord out = *this;
  out.time_s = time_s(kept).eval();
  out.u_rad = u_rad(kept, Eigen::all).eval();
  return out;
}

LaggedInput::LaggedInput(const InputTrack& track, double lag_s, double dead_time_s)
    : track_(track),
      lag_s_(lag_s),
      dead_time_s_(dead_time_s),
      now_s_(track.time_s[0]),
      state_(track.value.row(0)) {}

void LaggedInput::advance(double t_s) {
  const bool last = index_ + 1 >= track_.time_s.size();
  const double step_s = t_s - now_s_;
  now_s_ = t_s;
  if (step_s <= 0.0 || !(lag_s_ > 0.0)) return;
  const double left = std::exp(-step_s / lag_s_);
  if (track_.held || last) {
    state_ += (1.0 - left) * (track_.value.row(index_).transpose() - state_);
    return;
  }
  const double span_s = track_.time_s[index_ + 1] - track_.time_s[index_];
  const Eigen::VectorXd slope =
      (track_.value.row(index_ + 1) - track_.value.row(index_)).transpose() / span_s;
  const Eigen::VectorXd end =
      track_.value.row(index_).transpose() + (t_s - track_.time_s[index_]) * slope - lag_s_ * slope;
  state_ = end + left * (state_ - (end - step_s * slope));
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
  if (lag_s_ > 0.0) {
    out = state_;
    return;
  }
  out = track_.value.row(index_);
  if (t < track_.time_s[0] || index_ + 1 >= count) return;
  if (!track_.held) {
    const double x =
        (t - track_.time_s[index_]) / (track_.time_s[index_ + 1] - track_.time_s[index_]);
    out += x * (track_.value.row(index_ + 1) - track_.value.row(index_)).transpose();
  }
}

}  // namespace softarm
