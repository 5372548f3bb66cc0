#include "dev/soak/soak_arm.hpp"

#include <algorithm>
#include <cmath>
#include <random>

namespace softarm {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr std::int64_t kReferencePeriod_ns = kSecond_ns / 100;
constexpr std::int64_t kGoPeriod_ns = kSecond_ns / 25;
constexpr double kMostTheta_rad = 0.8;
constexpr int kPoses = 100;
/// Of the limit of a step, for its rounding to float on the wire.
constexpr double kRounding = 1.00001;

}  // namespace

ReferenceSettings random_reference(int segments, double most_theta_rad, int poses,
                                   std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(generator);
  };
  WayPointReference way{.points = {}, .repeat = true};
  const auto dof = static_cast<std::size_t>(2 * segments);
  WayPoint point{.time_s = 0.0, .u_rad = std::vector<double>(dof, 0.0)};
  way.points.push_back(point);
  for (int k = 1; k < poses; ++k) {
    point.time_s += uniform(0.6, 2.0);
    for (std::size_t i = 0; i < dof; i += 2) {
      const double choice = uniform(0.0, 1.0), size = uniform(0.2, 1.0);
      const double theta = std::hypot(point.u_rad[i], point.u_rad[i + 1]);
      if (choice < 0.5 && theta > 0.0) {  // to the other side, through the straight pose
        const double scale = -size * most_theta_rad / theta;
        point.u_rad[i] *= scale;
        point.u_rad[i + 1] *= scale;
      } else {
        const double phi = uniform(-M_PI, M_PI);
        const double to = choice < 0.9 ? size * most_theta_rad : 0.0;
        point.u_rad[i] = to * std::cos(phi);
        point.u_rad[i + 1] = to * std::sin(phi);
      }
    }
    way.points.push_back(point);
  }
  way.points.push_back({point.time_s + 2.0, way.points.front().u_rad});
  return {.phases = {{.kind = way}}};
}

SoakArm::SoakArm(const Experiment& experiment)
    : client_(experiment),
      lowest_bar_(std::min(0.0, experiment.actuation.min_pressure_bar)),
      highest_bar_(experiment.actuation.max_pressure_bar),
      largest_step_bar_(
          kRounding *
          std::max(experiment.actuation.slew_bar_per_s, experiment.actuation.vent_bar_per_s) /
          experiment.rate_hz),
      seed_(experiment.seed),
      followed_rad_(SegmentVector::Zero(experiment.arm.dof())),
      next_reference_ns_(client_.now_ns()),
      next_go_ns_(next_reference_ns_) {
  client_.on_status([this](const ArmStatus& newest) { take_status(newest); });
  client_.on_command([this](const ChamberCommand& command) { take_command(command); });
}

void SoakArm::take_status(const ArmStatus& newest) {
  if (newest.tick < status_.tick) {  // another daemon
    ended_.ticks += status_.tick;
    ended_.overruns += status_.overruns;
  }
  const bool begins = mode() != Mode::active && newest.mode == Mode::active;
  status_ = newest;
  const bool refused = mode() == Mode::active && status_.reference_limited &&
                       client_.now_ns() - motion_began_ns_ > kSecond_ns;
  if (begins || refused) begin_motion();
  const SegmentVector& now_rad = status_.reference_u_rad;
  for (Eigen::Index k = 0; k < now_rad.size(); k += 2)
    if (now_rad.segment<2>(k).dot(followed_rad_.segment<2>(k)) < 0.0) ++straight_poses_;
  followed_rad_ = now_rad;
  active_in_row_ = mode() == Mode::active ? active_in_row_ + 1 : 0;
  seen_.insert({mode(), reason()});
}

void SoakArm::take_command(const ChamberCommand& command) {
  ++commands_;
  commanded_bar_ = command.pressure_bar;
  const bool inside = steps_.take(command) <= largest_step_bar_ && commanded_bar_.allFinite() &&
                      (commanded_bar_.array() >= lowest_bar_).all() &&
                      (commanded_bar_.array() <= highest_bar_).all();
  if (!inside) ++outside_;
}

bool SoakArm::wait_for(const std::function<bool()>& reached, double patience_s) {
  return client_.wait_for(
      [&] {
        if (client_.valves()) seen_of_valves_.insert(client_.valves()->reason);
        if (reached()) return true;
        speak(client_.now_ns());
        return false;
      },
      patience_s);
}

void SoakArm::speak(std::int64_t now_ns) {
  if (now_ns >= next_reference_ns_) {
    send_reference(now_ns);
    next_reference_ns_ = now_ns + kReferencePeriod_ns;
  }
  if (now_ns >= next_go_ns_) {
    if (dead_man_ != DeadMan::silent) client_.send_go(dead_man_ == DeadMan::go);
    next_go_ns_ = now_ns + kGoPeriod_ns;
  }
}

/// A live reference further than max_step_rad from the daemon's own is refused: so at first, where
/// the arm is, and where a busy machine kept ours from being heard for a while.
void SoakArm::begin_motion() {
  const ControllerSettings& control = client_.experiment().control;
  const SegmentVector& reference_rad = status_.reference_u_rad;
  const SegmentVector u_rad = reference_rad.allFinite() ? reference_rad : status_.u_rad;
  motion_began_ns_ = client_.now_ns();
  reference_.emplace(
      random_reference(status_.segments(), std::min(kMostTheta_rad, 0.5 * control.max_theta_rad),
                       kPoses, ++seed_),
      control, status_.segments());
  reference_->start(to_seconds(motion_began_ns_), u_rad, SegmentVector::Zero(u_rad.size()));
}

void SoakArm::send_reference(std::int64_t now_ns) {
  if (!reference_) return;
  reference_->sample(to_seconds(now_ns), sample_);
  client_.send_reference(sample_.u, sample_.velocity, sample_.acceleration);
}

int SoakArm::fullest_chamber() const {
  Eigen::Index fullest = 0;
  if (commanded_bar_.size() > 0) commanded_bar_.maxCoeff(&fullest);
  return static_cast<int>(fullest);
}

double SoakArm::fullest_bar() const {
  return commanded_bar_.size() > 0 ? commanded_bar_.maxCoeff() : 0.0;
}

void SoakArm::forget() {
  seen_.clear();
  seen_of_valves_.clear();
}

bool SoakArm::left_active() const {
  return std::any_of(seen_.begin(), seen_.end(),
                     [](const auto& each) { return each.first != Mode::active; });
}

}  // namespace softarm
