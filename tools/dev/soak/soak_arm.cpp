#include "dev/soak/soak_arm.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <softarm_messages/deadman_t.hpp>
#include <softarm_messages/operator_command_t.hpp>

#include "softarm/base/clock.hpp"
#include "softarm/base/time.hpp"
#include "softarm/transport/message_decoding.hpp"

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
    : lcm_(experiment.transport.lcm),
      lowest_bar_(experiment.actuation.min_pressure_bar),
      highest_bar_(experiment.actuation.max_pressure_bar),
      largest_step_bar_(
          kRounding *
          std::max(experiment.actuation.slew_bar_per_s, experiment.actuation.vent_bar_per_s) /
          experiment.rate_hz),
      control_(experiment.control),
      segments_(experiment.arm.dof() / 2),
      seed_(experiment.seed),
      node_(lcm_.url),
      followed_(static_cast<std::size_t>(segments_)),
      next_reference_ns_(monotonic_now_ns()),
      next_go_ns_(next_reference_ns_),
      sequence_(next_reference_ns_) {
  node_.subscribe(lcm_.status_channel, 4096, [this](const auto& packet) { take_status(packet); });
  node_.subscribe(lcm_.command_channel, 4096, [this](const auto& packet) { take_command(packet); });
  node_.subscribe(lcm_.plant_channel, 4096,
                  [this](const ReceivedMessage& packet) { decode(packet.bytes, plant_); });
}

void SoakArm::take_status(const ReceivedMessage& packet) {
  if (!decode(packet.bytes, decoded_)) return;
  if (decoded_.tick < status_.tick) {  // another daemon
    ended_.ticks += status_.tick;
    ended_.overruns += status_.overruns;
  }
  const bool begins = mode() != Mode::active && static_cast<Mode>(decoded_.mode) == Mode::active;
  status_ = decoded_;
  const bool refused = mode() == Mode::active && (status_.flags & status_.REFERENCE_LIMITED) != 0 &&
                       monotonic_now_ns() - motion_began_ns_ > kSecond_ns;
  if (begins || refused) begin_motion();
  for (std::size_t i = 0; i < std::min(followed_.size(), status_.reference_u_rad.size()); ++i) {
    const auto& u = status_.reference_u_rad[i];
    const std::array<double, 2> now{static_cast<double>(u[0]), static_cast<double>(u[1])};
    if (now[0] * followed_[i][0] + now[1] * followed_[i][1] < 0.0) ++straight_poses_;
    followed_[i] = now;
  }
  active_in_row_ = mode() == Mode::active ? active_in_row_ + 1 : 0;
  seen_.insert({mode(), reason()});
}

void SoakArm::take_command(const ReceivedMessage& packet) {
  if (!decode(packet.bytes, command_)) return;  // bytes of our own that are no command
  ++commands_;
  bool inside = static_cast<double>(steps_.take(command_)) <= largest_step_bar_;
  for (const float each : command_.pressure_bar) {
    const auto bar = static_cast<double>(each);
    inside &= std::isfinite(bar) && bar >= std::min(0.0, lowest_bar_) && bar <= highest_bar_;
  }
  if (!inside) ++outside_;
}

bool SoakArm::wait_for(const std::function<bool()>& reached, double patience_s) {
  const std::int64_t end_ns = monotonic_now_ns() + to_ns(patience_s);
  for (std::int64_t now_ns = monotonic_now_ns(); now_ns < end_ns; now_ns = monotonic_now_ns()) {
    if (reached()) return true;
    speak(now_ns);
    node_.wait_until(std::min({end_ns, next_reference_ns_, next_go_ns_}));
    node_.drain(1000);
  }
  return reached();
}

void SoakArm::speak(std::int64_t now_ns) {
  if (now_ns >= next_reference_ns_) {
    publish_reference(now_ns);
    next_reference_ns_ = now_ns + kReferencePeriod_ns;
  }
  if (now_ns >= next_go_ns_) {
    if (dead_man_ != DeadMan::silent)
      node_.publish(lcm_.deadman_channel,
                    softarm_messages::deadman_t{
                        .sequence = ++sequence_,
                        .go = static_cast<std::int8_t>(dead_man_ == DeadMan::go ? 1 : 0)});
    next_go_ns_ = now_ns + kGoPeriod_ns;
  }
}

/// A live reference further than max_step_rad from the daemon's own is refused: so at first, where
/// the arm is, and where a busy machine kept ours from being heard for a while.
void SoakArm::begin_motion() {
  const auto& from = status_.reference_u_rad.empty() ? status_.u_rad : status_.reference_u_rad;
  SegmentVector u = SegmentVector::Zero(2 * segments_), rest = u;
  for (std::size_t i = 0; i < std::min(followed_.size(), from.size()); ++i)
    for (const int axis : {0, 1})
      u[2 * static_cast<int>(i) + axis] =
          static_cast<double>(from[i][static_cast<std::size_t>(axis)]);
  motion_began_ns_ = monotonic_now_ns();
  reference_.emplace(
      random_reference(segments_, std::min(kMostTheta_rad, 0.5 * control_.max_theta_rad), kPoses,
                       ++seed_),
      control_, segments_);
  reference_->start(to_seconds(monotonic_now_ns()), u, rest);
}

void SoakArm::publish_reference(std::int64_t now_ns) {
  if (!reference_) return;
  reference_->sample(to_seconds(now_ns), sample_);
  const auto list = [](const SegmentVector& from) {
    return std::vector<double>(from.begin(), from.end());
  };
  reference_message_.sequence = ++sequence_;
  reference_message_.dimension = static_cast<std::int16_t>(sample_.u.size());
  reference_message_.u_rad = list(sample_.u);
  reference_message_.velocity_radps = list(sample_.velocity);
  reference_message_.acceleration_radps2 = list(sample_.acceleration);
  node_.publish(lcm_.reference_channel, reference_message_);
}

void SoakArm::request(std::int8_t what) {
  node_.publish(lcm_.operator_channel,
                softarm_messages::operator_command_t{.sequence = ++sequence_, .request = what});
}

void SoakArm::set_dead_man(DeadMan says) { dead_man_ = says; }

int SoakArm::fullest_chamber() const {
  const auto& bar = command_.pressure_bar;
  return static_cast<int>(std::max_element(bar.begin(), bar.end()) - bar.begin());
}

double SoakArm::fullest_bar() const {
  const auto& bar = command_.pressure_bar;
  return bar.empty() ? 0.0 : static_cast<double>(*std::max_element(bar.begin(), bar.end()));
}

bool SoakArm::left_active() const {
  return std::any_of(seen_.begin(), seen_.end(),
                     [](const auto& each) { return each.first != Mode::active; });
}

}  // namespace softarm
