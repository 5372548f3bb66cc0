#include "softarm/simulation/valve_side.hpp"

#include <algorithm>

#include "softarm/actuation/pressure_ramps.hpp"

namespace softarm {
namespace {

constexpr std::int64_t kDegradedFor_ns = 250'000'000;
/// Steps of a rise that the limits delay.
constexpr std::int64_t kStep_ns = 1'000'000;
constexpr std::int64_t kLongestStep_ns = 10'000'000;

}  // namespace

ValveSide::ValveSide(const ActuationSettings& actuation, std::int64_t longest_validity_ns)
    : expiry_(chamber_count(actuation), longest_validity_ns),
      slew_per_s_(actuation.slew_bar_per_s),
      set_points_(Eigen::VectorXd::Zero(chamber_count(actuation))) {}

CommandVerdict ValveSide::receive(const PressureCommand& command, std::int64_t now_ns) noexcept {
  update(now_ns);
  const CommandVerdict verdict = expiry_.receive(command, now_ns);
  if (verdict == CommandVerdict::in_force || verdict == CommandVerdict::other_sender)
    heard_ns_ = now_ns;
  if (verdict == CommandVerdict::other_sender) {
    if (in_force_) vent();
    degraded_until_ns_ = now_ns + kDegradedFor_ns;
    must_see_zero_ = true;
  }
  update(now_ns);
  return verdict;
}

void ValveSide::pause() noexcept {
  expiry_.vent();
  if (in_force_) vent();
}

void ValveSide::vent() noexcept {
  in_force_ = false;
  ++times_vented_;
  set_points_.setZero();
}

void ValveSide::update(std::int64_t now_ns) noexcept {
  expiry_.update(now_ns);
  const bool silent = expiry_.vented() && age_ns(now_ns, heard_ns_) >= expiry_.longest_ns();
  const bool zero = !expiry_.vented() && expiry_.set_points_bar().isZero(0.0);
  if (silent || zero) must_see_zero_ = false;
  const bool in_force = !expiry_.vented() && !degraded(now_ns);
  if (in_force_ && !in_force) vent();
  const std::int64_t passed_ns = in_force_ ? std::min(now_ns - updated_ns_, kLongestStep_ns) : 0;
  in_force_ = in_force;
  updated_ns_ = now_ns;
  if (!in_force) return;
  const double rise = slew_per_s_ * to_seconds(passed_ns);
  reached_ = true;
  for (Eigen::Index i = 0; i < set_points_.size(); ++i) {
    const double wanted = expiry_.set_points_bar()[i];
    set_points_[i] = rise_towards(set_points_[i], wanted, rise);
    reached_ = reached_ && set_points_[i] == wanted;
  }
}

std::int64_t ValveSide::next_event_ns() const noexcept {
  if (!in_force_) return kForever;
  return reached_ ? expiry_.expires_ns() : std::min(expiry_.expires_ns(), updated_ns_ + kStep_ns);
}

}  // namespace softarm
