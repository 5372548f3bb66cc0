#include "softarm/commissioning/identification/parameter_set.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace softarm {
namespace {

constexpr double kLeast = 1e-3;       ///< stiffness of an arm that has any, of that configured
constexpr double kShortest_s = 1e-3;  ///< beta / k of an arm without inertia
constexpr double kJagged_s = 0.02;
constexpr double kSlow_s = 0.5;       ///< scale of lag and delay in quasi-static motion
constexpr double kHardens_rad = 0.2;  ///< a cubic stiffness of its scale doubles k at that bend
constexpr double kLagScale_s = 0.1, kDelayScale_s = 0.05, kRestScale_rad = 0.1;

constexpr double kUnbounded = -std::numeric_limits<double>::infinity();

double positive(double value, double otherwise) { return value > 0.0 ? value : otherwise; }

std::string of_segment(const char* name, std::size_t segment, bool all) {
  return all ? std::string(name) : fmt::format("{}, segment {}", name, segment + 1);
}

/// The unit vector along a column of `push`, or across it.
Eigen::Vector2d along(const Eigen::Vector2d& push) { return push.normalized(); }
Eigen::Vector2d across(const Eigen::Vector2d& push) {
  return Eigen::Vector2d(-push.y(), push.x()).normalized();
}

}  // namespace

ParameterSet::ParameterSet(const ArmHypothesis& start, ActuationKind kind, const FitChoice& choice)
    : start_(start) {
  start_.inertia = choice.inertia;
  add_impedance(choice);
  if (choice.gains_free && kind == ActuationKind::chambers) {
    add_gains(choice);
    if (choice.directions) start_.input_map.setZero();
  }
  add_times(choice);
}

void ParameterSet::add_impedance(const FitChoice& choice) {
  const bool per_segment = choice.per_segment;
  const std::size_t count = per_segment ? start_.arm.segments.size() : 1;
  const auto add = [&](const char* name, const char* unit, double SegmentParameters::*member,
                       double otherwise, double least_scale, double lowest) {
    for (std::size_t i = 0; i < count; ++i)
      parameters_.push_back(
          {of_segment(name, i, !per_segment), unit,
           std::max(least_scale, positive(start_.arm.segments[i].*member, otherwise)),
           [=](const ArmHypothesis& arm) { return arm.arm.segments[i].*member; },
           [=](ArmHypothesis& arm, double value) {
             for (std::size_t k = 0; k < arm.arm.segments.size(); ++k)
               if (!per_segment || k == i) arm.arm.segments[k].*member = value;
           },
           lowest});
  };
  const double k = positive(start_.arm.segments[0].stiffness_nm_per_rad, 1.0);
  if (choice.stiffness)
    add("stiffness k", "N m/rad", &SegmentParameters::stiffness_nm_per_rad, 1.0, 0.0, kLeast * k);
  // Without inertia there is no motion without damping.
  if (choice.damping)
    add("damping beta", "N m s/rad", &SegmentParameters::damping_nms_per_rad, 0.05,
        choice.inertia ? 0.0 : kSlow_s * k, choice.inertia ? 0.0 : kShortest_s * k);
}

void ParameterSet::add_gains(const FitChoice& choice) {
  std::vector<int> side;  // of every chamber: its number in its segment
  for (std::size_t j = 0; j < start_.segment_of.size(); ++j)
    side.push_back(j > 0 && start_.segment_of[j] == start_.segment_of[j - 1] ? side.back() + 1 : 0);
  const auto group = [&](std::size_t j) {
    switch (choice.gains) {
      case GainSharing::side:
        return side[j];
      case GainSharing::segment:
        return start_.segment_of[j];
      case GainSharing::chamber:
        return static_cast<int>(j);
      default:
        return 0;
    }
  };
  int groups = 0;
  for (std::size_t j = 0; j < side.size(); ++j) groups = std::max(groups, group(j) + 1);
  for (int g = 0; g < groups; ++g) {
    std::vector<Eigen::Index> members;
    for (std::size_t j = 0; j < side.size(); ++j)
      if (group(j) == g) members.push_back(static_cast<Eigen::Index>(j));
    if (members.empty()) continue;
    const auto first = static_cast<std::size_t>(members.front());
    std::string which =
        choice.gains == GainSharing::arm    ? ""
        : choice.gains == GainSharing::side ? fmt::format(", side {}", g + 1)
        : choice.gains == GainSharing::segment
            ? fmt::format(", segment {}", g + 1)
            : fmt::format(", segment {} chamber {}", start_.segment_of[first] + 1, side[first] + 1);
    // Chambers that share a gain keep their ratios.
    const double scale = start_.input_map.col(members.front()).norm();
    const auto add = [&](const char* name, Eigen::Vector2d (*axis)(const Eigen::Vector2d&)) {
      parameters_.push_back(
          {name + which, "N m/bar", scale,
           [=, reference = start_.input_map](const ArmHypothesis& arm) {
             return axis(reference.col(members.front())).dot(arm.input_map.col(members.front()));
           },
           [=, reference = start_.input_map](ArmHypothesis& arm, double value) {
             for (const Eigen::Index j : members) {
               const Eigen::Vector2d direction = axis(reference.col(j));
               arm.input_map.col(j) +=
                   (value / scale * reference.col(j).norm() - direction.dot(arm.input_map.col(j))) *
                   direction;
             }
           },
           kUnbounded});
    };
    add("gain", along);
    if (choice.directions) add("gain across", across);
  }
}

void ParameterSet::add_times(const FitChoice& choice) {
  const auto number = [&](const char* name, const char* unit, double scale,
                          double ArmHypothesis::*member, double lowest) {
    parameters_.push_back({name, unit, scale, [=](const ArmHypothesis& arm) { return arm.*member; },
                           [=](ArmHypothesis& arm, double value) { arm.*member = value; }, lowest});
  };
  if (choice.rest)
    for (Eigen::Index c = 0; c < start_.arm.dof(); ++c)
      parameters_.push_back(
          {fmt::format("rest {}, segment {}", c % 2 == 0 ? "u1" : "u2", c / 2 + 1), "rad",
           kRestScale_rad, [=](const ArmHypothesis& arm) { return arm.rest_rad[c]; },
           [=](ArmHypothesis& arm, double value) { arm.rest_rad[c] = value; }, kUnbounded});
  if (choice.cubic)
    number(
        "cubic stiffness", "N m/rad^3",
        positive(start_.arm.segments[0].stiffness_nm_per_rad, 1.0) / (kHardens_rad * kHardens_rad),
        &ArmHypothesis::cubic_nm_per_rad3, kUnbounded);
  if (choice.lag)
    number("lag", "s", std::max(start_.lag_s, choice.inertia ? kLagScale_s : kSlow_s),
           &ArmHypothesis::lag_s, 0.0);
  if (choice.delay)
    number("delay", "s", std::max(start_.dead_time_s, choice.inertia ? kDelayScale_s : kSlow_s),
           &ArmHypothesis::dead_time_s, kUnbounded);
  // Recorded inputs are jagged: the effect of a delay needs a difference over several of their
  // steps.
  if (choice.delay && !choice.inertia)
    parameters_.back().difference = kJagged_s / parameters_.back().scale;
}

Eigen::VectorXd ParameterSet::of(const ArmHypothesis& arm) const {
  Eigen::VectorXd x(size());
  for (Eigen::Index i = 0; i < size(); ++i) x[i] = (*this)[i].get(arm) / (*this)[i].scale;
  return x;
}

Eigen::VectorXd ParameterSet::lowest() const {
  Eigen::VectorXd x(size());
  for (Eigen::Index i = 0; i < size(); ++i) x[i] = (*this)[i].lowest / (*this)[i].scale;
  return x;
}

ArmHypothesis ParameterSet::arm(const Eigen::VectorXd& x) const {
  ArmHypothesis arm = start_;
  for (Eigen::Index i = 0; i < size(); ++i) (*this)[i].set(arm, x[i] * (*this)[i].scale);
  return arm;
}

bool ParameterSet::possible(const Eigen::VectorXd& x) const {
  if (!x.allFinite()) return false;
  const ArmHypothesis tried = arm(x);
  const bool springs = std::all_of(
      tried.arm.segments.begin(), tried.arm.segments.end(), [](const SegmentParameters& segment) {
        return segment.stiffness_nm_per_rad > 0.0 && segment.damping_nms_per_rad >= 0.0;
      });
  const bool moves =
      tried.inertia || std::all_of(tried.arm.segments.begin(), tried.arm.segments.end(),
                                   [](const SegmentParameters& segment) {
                                     return segment.damping_nms_per_rad > 0.0;
                                   });
  return springs && moves && tried.lag_s >= 0.0;
}

bool ParameterSet::linear(Eigen::Index i) const {
  return (*this)[i].name != "lag" && (*this)[i].name != "delay";
}

}  // namespace softarm
