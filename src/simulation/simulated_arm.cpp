#include "softarm/simulation/simulated_arm.hpp"

#include <algorithm>
#include <span>

#include "softarm/base/time.hpp"

namespace softarm {
namespace {

std::span<const double> as_span(const Eigen::VectorXd& values) {
  return {values.data(), static_cast<std::size_t>(values.size())};
}

}  // namespace

SimulatedArm::SimulatedArm(const PlantSettings& settings, std::int64_t start_ns,
                           std::int64_t longest_validity_ns)
    : start_ns_(start_ns),
      now_ns_(start_ns),
      plant_(settings),
      expiry_(plant_.chambers(), longest_validity_ns),
      mocap_(settings.mocap, plant_.segments(), settings.seed, start_ns),
      segment_ends_(static_cast<std::size_t>(plant_.segments())) {
  advance_to(start_ns);
}

void SimulatedArm::advance_plant(std::int64_t t_ns) {
  plant_.advance(to_seconds(t_ns - start_ns_));
  now_ns_ = t_ns;
}

void SimulatedArm::advance_to(std::int64_t now_ns) {
  while (now_ns >= now_ns_) {
    const std::int64_t event_ns = std::min(mocap_.next_capture_ns(), expiry_.expires_ns());
    if (event_ns > now_ns) {
      advance_plant(now_ns);
      return;
    }
    advance_plant(event_ns);
    if (expiry_.update(event_ns)) {
      plant_.command(as_span(expiry_.set_points_bar()));
    }
    if (mocap_.next_capture_ns() == event_ns) {
      plant_.segment_ends(segment_ends_);
      mocap_.capture(plant_.base(), segment_ends_);
    }
  }
}

CommandVerdict SimulatedArm::command(const PressureCommand& command, std::int64_t arrival_ns) {
  advance_to(arrival_ns);
  // A caller whose clock reads slightly less than what was asked of us before must not shorten the
  // validity.
  const CommandVerdict verdict = expiry_.receive(command, now_ns_);
  if (verdict == CommandVerdict::in_force) {
    plant_.command(as_span(expiry_.set_points_bar()));
  }
  return verdict;
}

CommandVerdict SimulatedArm::command(const PressureVector& pressure_bar, std::int64_t validity_ns,
                                     std::int64_t arrival_ns) {
  advance_to(arrival_ns);
  const std::span<const double> pressures(pressure_bar.data(),
                                          static_cast<std::size_t>(pressure_bar.size()));
  return command(
      {.sequence = sequence() + 1, .validity_ns = validity_ns, .pressure_bar = pressures},
      arrival_ns);
}

std::int64_t SimulatedArm::next_event_ns() const noexcept {
  return std::min({mocap_.next_capture_ns(), mocap_.next_arrival_ns(), expiry_.expires_ns()});
}

}  // namespace softarm
