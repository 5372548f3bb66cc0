#include "dev/fault/fault_injector.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "softarm/base/time.hpp"

namespace softarm {
namespace {

using softarm_messages::mocap_body_t;
using softarm_messages::mocap_frame_t;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

constexpr std::array kFaults{
    FaultDescription{"stop", FaultKind::stop, "no frame goes through", "", 0.0,
                     "HOLD (frames_late), then VENT (frames_stale)"},
    FaultDescription{"occlude", FaultKind::occlude, "a body is not seen", "", 0.0,
                     "HOLD (frames_late), then VENT (frames_stale)"},
    FaultDescription{"nan", FaultKind::nan, "a coordinate of a body is not a number", "", 0.0,
                     "frames rejected; HOLD, then VENT"},
    FaultDescription{"inf", FaultKind::inf, "a coordinate of a body is infinite", "", 0.0,
                     "frames rejected; HOLD, then VENT"},
    FaultDescription{"quaternion", FaultKind::quaternion, "a body's quaternion is too long",
                     "its length", 1.2, "frames rejected; HOLD, then VENT"},
    FaultDescription{"length", FaultKind::length, "a body is off along the world's x axis",
                     "by how much (m)", 0.3, "frames rejected; HOLD, then VENT"},
    FaultDescription{"jump", FaultKind::jump,
                     "every other frame the arm's end is bent to another side",
                     "turned by how much about the segment's axis (rad)", 3.0,
                     "those frames rejected; ACTIVE on the others"},
    FaultDescription{"swap", FaultKind::swap, "a body and the next one exchange their ids", "", 0.0,
                     "frames rejected; HOLD, then VENT"},
    FaultDescription{"duplicate", FaultKind::duplicate, "every frame comes twice", "", 0.0,
                     "the second one is dropped; ACTIVE"},
    FaultDescription{"reorder", FaultKind::reorder, "of every two frames the second comes first",
                     "", 0.0, "the older one is dropped; ACTIVE"},
    FaultDescription{"restart", FaultKind::restart, "frame numbers begin again, once", "", 0.0,
                     "VENT (sender_restarted)"},
    FaultDescription{"delay", FaultKind::delay, "frames come late", "by how much (s)", 0.2,
                     "compensated up to daemon.safety.max_latency_s, stale beyond it"},
    FaultDescription{"freeze", FaultKind::freeze, "poses repeat, numbers and times go on", "", 0.0,
                     "HOLD (poses_frozen) while commands move"},
    FaultDescription{"clock", FaultKind::clock, "the sender's clock is set", "by how much (s)",
                     3600.0, "none: ACTIVE"},
    FaultDescription{"silence", FaultKind::silence, "measured pressures do not go through", "", 0.0,
                     "FAULT (valves_silent) with valve_readback"},
    FaultDescription{"burst", FaultKind::burst, "a chamber shows no pressure", "", 0.0,
                     "FAULT (pressure_mismatch) with valve_readback"},
    FaultDescription{"mirror", FaultKind::mirror, "y of all positions is reversed", "", 0.0,
                     "none at rest; softarm check --live --pulse sees it"},
    FaultDescription{"leak", FaultKind::leak, "a chamber shows less pressure than it has",
                     "which part less", 0.4, "FAULT beyond pressure_tolerance_bar"},
    FaultDescription{"stale", FaultKind::stale, "a body repeats its last pose, still valid", "",
                     0.0, "HOLD (frames_late), then VENT (frames_stale)"},
    FaultDescription{"turn", FaultKind::turn, "a body is recognised turned about its own axis",
                     "by how much (rad)", 1.5707963267948966,
                     "frames rejected (bad_torsion); HOLD, then VENT"},
    FaultDescription{"stick", FaultKind::stick, "a chamber repeats its last measurement", "", 0.0,
                     "FAULT (pressure_mismatch) with valve_readback, once its command has moved"},
};

Eigen::Vector3d position(const mocap_body_t& body) {
  return {body.position_m[0], body.position_m[1], body.position_m[2]};
}
Eigen::Quaterniond orientation(const mocap_body_t& body) {
  return {body.orientation[0], body.orientation[1], body.orientation[2], body.orientation[3]};
}
void put(const Eigen::Quaterniond& q, mocap_body_t& body) {
  body.orientation[0] = q.w();
  body.orientation[1] = q.x();
  body.orientation[2] = q.y();
  body.orientation[3] = q.z();
}

}  // namespace

std::span<const FaultDescription> fault_list() { return kFaults; }

std::optional<Fault> find_fault(const std::string& name) {
  const auto found = std::find_if(kFaults.begin(), kFaults.end(),
                                  [&](const FaultDescription& each) { return each.name == name; });
  if (found == kFaults.end()) return std::nullopt;
  return Fault{.kind = found->kind, .amount = found->usual};
}

void FaultInjector::set(const Fault& fault) {
  fault_ = fault;
  kept_.reset();
  kept_pressure_.reset();
  restart_ = fault.kind == FaultKind::restart;
}

void FaultInjector::corrupt_body(mocap_body_t& body) const {
  switch (fault_.kind) {
    case FaultKind::occlude:
      body.valid = 0;
      break;
    case FaultKind::nan:
      body.orientation[taken_ % 4] = kNan;
      break;
    case FaultKind::inf:
      body.position_m[taken_ % 3] = taken_ % 2 == 0 ? kInf : -kInf;
      break;
    case FaultKind::quaternion:
      for (double& component : body.orientation) component *= fault_.amount;
      break;
    case FaultKind::length:
      body.position_m[0] += fault_.amount;
      break;
    default:
      break;
  }
}

/// Turns the last body about the axis of the one before it: still a pose of constant curvature, in
/// another direction.
void FaultInjector::bend_to_other_side(mocap_frame_t& frame) const {
  if (frame.bodies.size() < 2) return;
  const mocap_body_t& upper = frame.bodies[frame.bodies.size() - 2];
  mocap_body_t& lower = frame.bodies.back();
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(fault_.amount, Eigen::Vector3d::UnitZ()));
  const Eigen::Quaterniond up = orientation(upper);
  const Eigen::Vector3d t = up.conjugate() * (position(lower) - position(upper));
  const Eigen::Quaterniond r = up.conjugate() * orientation(lower);
  const Eigen::Vector3d p = position(upper) + up * (turn * t);
  const Eigen::Quaterniond q = up * (turn * r * turn.conjugate());
  for (int axis = 0; axis < 3; ++axis) lower.position_m[axis] = p[axis];
  put(q, lower);
}

void FaultInjector::corrupt_poses(mocap_frame_t& frame) {
  const auto size = static_cast<int>(frame.bodies.size());
  if (size == 0) return;
  const int which = std::clamp(fault_.body, 0, size - 1);
  corrupt_body(frame.bodies[static_cast<std::size_t>(which)]);
  if (fault_.kind == FaultKind::swap)
    std::swap(frame.bodies[static_cast<std::size_t>(which)].id,
              frame.bodies[static_cast<std::size_t>((which + 1) % size)].id);
  if (fault_.kind == FaultKind::jump && taken_ % 2 == 0) bend_to_other_side(frame);
  if (fault_.kind == FaultKind::mirror)
    for (mocap_body_t& body : frame.bodies) body.position_m[1] *= -1.0;
  if (fault_.kind == FaultKind::turn) {
    mocap_body_t& body = frame.bodies[static_cast<std::size_t>(which)];
    put(orientation(body) * Eigen::AngleAxisd(fault_.amount, Eigen::Vector3d::UnitZ()), body);
  }
  if (fault_.kind == FaultKind::stale) {
    if (!kept_) kept_ = frame;
    if (kept_->bodies.size() == frame.bodies.size())
      frame.bodies[static_cast<std::size_t>(which)] =
          kept_->bodies[static_cast<std::size_t>(which)];
  }
  if (fault_.kind == FaultKind::freeze) {
    if (!kept_) kept_ = frame;
    frame.bodies = kept_->bodies;
  }
}

void FaultInjector::take(const mocap_frame_t& sent, std::int64_t now_ns) {
  ++taken_;
  mocap_frame_t frame = sent;
  if (sent.frame_number < newest_number_) number_offset_ = 0;  // the sender itself restarted
  newest_number_ = sent.frame_number;
  if (std::exchange(restart_, false)) number_offset_ = 1 - frame.frame_number;
  frame.frame_number += number_offset_;
  if (fault_.kind == FaultKind::stop) return;
  if (fault_.kind == FaultKind::clock)
    frame.capture_time_us += static_cast<std::int64_t>(1e6 * fault_.amount);
  corrupt_poses(frame);
  const double delay_s = fault_.kind == FaultKind::delay ? fault_.amount : 0.0;
  const std::int64_t due_ns = now_ns + to_ns(delay_s);
  if (fault_.kind == FaultKind::reorder && !kept_) {
    kept_ = frame;
    return;
  }
  waiting_.push_back({frame, due_ns});
  if (fault_.kind == FaultKind::duplicate) waiting_.push_back({frame, due_ns});
  if (fault_.kind == FaultKind::reorder) {
    waiting_.push_back({*kept_, due_ns});
    kept_.reset();
  }
}

bool FaultInjector::next(std::int64_t now_ns, mocap_frame_t& frame) {
  // A delay that was lifted must not let late frames overtake: they go in their order.
  if (waiting_.empty() || waiting_.front().due_ns > now_ns) return false;
  frame = std::move(waiting_.front().frame);
  waiting_.pop_front();
  return true;
}

std::int64_t FaultInjector::next_due_ns() const {
  return waiting_.empty() ? kForever : waiting_.front().due_ns;
}

bool FaultInjector::pass(softarm_messages::pressure_measurement_t& measurement) {
  if (fault_.kind == FaultKind::silence) return false;
  auto& pressures = measurement.pressure_bar;
  if (pressures.empty()) return true;
  float& chosen = pressures[static_cast<std::size_t>(
      std::clamp(fault_.body, 0, static_cast<int>(pressures.size()) - 1))];
  if (fault_.kind == FaultKind::burst) chosen = 0.0F;
  if (fault_.kind == FaultKind::stick) {
    if (!kept_pressure_) kept_pressure_ = chosen;
    chosen = *kept_pressure_;
  }
  if (fault_.kind == FaultKind::leak) chosen *= 1.0F - static_cast<float>(fault_.amount);
  return true;
}

}  // namespace softarm
