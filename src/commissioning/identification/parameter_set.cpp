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
constexpr double kFill_s = 0.1, kVent_s = 0.3;  ///< where no lag is configured, the prior's
constexpr double kLongest_s = 10.0;             ///< lag of a chamber
/// Chambers of one arm are built alike: how far one may differ, in parts of what all have.
constexpr double kAlike = 0.5;
constexpr double kSaturation_1pbar = 0.5, kMostSaturation_1pbar = 2.0, kStiffening_1pbar = 0.5;
constexpr double kByLength = 2.0, kMostByLength = 20.0;  ///< exponents
constexpr double kSlipShare = 0.1, kSlipScale = 0.3;     ///< of k, a slip spring
constexpr double kRemanent = 0.2, kRemanence_s = 20.0;   ///< share and time
constexpr double kSecondRemanence_s = 5.0, kSoonest_s = 0.3, kLatest_s = 30.0;
constexpr double kRemanentScale_rad = 0.05, kCross = 0.15;
constexpr double kStretch_mpbar = 0.02, kOffsetScale_m = 0.02, kFrictionScale_m = 2e-3;
constexpr double kSet = 0.2, kByBend_m_per_rad2 = 0.02;
constexpr double kLeastLoad_kg = 1e-3;  ///< scale of a load
constexpr double kCoarse = 1e-3;        ///< difference for what makes kinks

constexpr const char* kCubicName = "cubic stiffness";
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
  elongation_ = choice.elongation;
  if (!choice.hysteresis)
    std::erase_if(start_.slip_springs,
                  [](const SlipSpring& spring) { return spring.stiffness_nm_per_rad == 0.0; });
  if (elongation_) {
    add_elongation(choice);
    return;
  }
  add_impedance(choice);
  if (choice.gains_free && kind == ActuationKind::chambers) {
    add_gains(choice);
    if (choice.directions) start_.input_map.setZero();
  }
  for (Parameter& each : parameters_) each.linear = true;
  add_times(choice);
  if (choice.venting || choice.chamber_lags) {
    start_.lags = start_.input_lags();
    add_lags(
        "filling", "venting", choice.chamber_lags,
        [](const ArmHypothesis& arm) { return arm.input_lags(); },
        [](ArmHypothesis & arm) -> auto& {
          if (arm.lags.empty()) arm.lags = arm.input_lags();
          return arm.lags;
        });
  }
  add_memory(choice);
  add_masses(choice);
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
        kCubicName, "N m/rad^3",
        positive(start_.arm.segments[0].stiffness_nm_per_rad, 1.0) / (kHardens_rad * kHardens_rad),
        &ArmHypothesis::cubic_nm_per_rad3, kUnbounded);
  const bool lags = choice.venting || choice.chamber_lags;
  for (Parameter& each : parameters_) each.linear = true;
  if (choice.lag && !lags)
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

/// Of all chambers alike, and, with `each`, by how much every one differs.
/// @param read, write  the lags of an arm, one per chamber: a copy, and a reference
template <class Read, class Write>
void ParameterSet::add_lags(const char* filling, const char* venting, bool each, Read read,
                            Write write) {
  const std::vector<FillVentLag> configured = read(start_);
  for (const bool vent : {false, true}) {
    const auto time = vent ? &FillVentLag::vent_s : &FillVentLag::fill_s;
    const auto mean = [=](const std::vector<FillVentLag>& lags) {
      double sum = 0.0;
      for (const FillVentLag& lag : lags) sum += lag.*time;
      return sum / static_cast<double>(lags.size());
    };
    const double expected_s = vent ? kVent_s : kFill_s, scale_s = 2.0 * expected_s;
    const auto add = [&](std::string name, double scale, auto get, auto set, double lowest) {
      Parameter it{std::move(name), "s", scale, get, set, lowest};
      it.highest = kLongest_s;
      it.difference = kCoarse;
      parameters_.push_back(std::move(it));
    };
    const char* const name = vent ? venting : filling;
    add(
        name, scale_s, [=](const ArmHypothesis& arm) { return mean(read(arm)); },
        [=](ArmHypothesis& arm, double value) {
          for (FillVentLag& lag : write(arm)) lag.*time = value;
        },
        0.0);
    if (!(mean(configured) > 0.0)) parameters_.back().expected = expected_s;
    for (std::size_t j = 0; each && j < configured.size(); ++j)
      add(
          fmt::format("{}, chamber {} beyond that", name, j + 1), kAlike * scale_s,
          [=](const ArmHypothesis& arm) {
            const std::vector<FillVentLag> lags = read(arm);
            return lags[j].*time - mean(lags);
          },
          [=](ArmHypothesis& arm, double value) {
            double& lag_s = write(arm)[j].*time;
            lag_s = std::max(0.0, lag_s + value);  // no lag is less than none
          },
          kUnbounded);
  }
}

/// Of all chambers alike, and, with `each`, by how much every one differs.
template <class Of>
void ParameterSet::add_saturation(const char* name, bool each, Of of) {
  const auto mean = [of](const ArmHypothesis& arm) {
    return of(arm).size() > 0 ? of(arm).mean() : 0.0;
  };
  const auto add = [&](std::string what, double scale, auto get, auto set) {
    Parameter it{std::move(what), "1/bar", scale, get, set, -kMostSaturation_1pbar};
    it.highest = kMostSaturation_1pbar;
    it.difference = kCoarse;
    parameters_.push_back(std::move(it));
  };
  const Eigen::Index inputs = start_.input_map.cols();
  add(name, kSaturation_1pbar, mean,
      [=](ArmHypothesis& arm, double value) { of(arm).setConstant(inputs, value); });
  for (Eigen::Index j = 0; each && j < inputs; ++j)
    add(
        fmt::format("{}, chamber {} beyond that", name, j + 1), kAlike * kSaturation_1pbar,
        [=](const ArmHypothesis& arm) { return of(arm).size() > j ? of(arm)[j] - mean(arm) : 0.0; },
        [=](ArmHypothesis& arm, double value) { of(arm)[j] += value; });
}

void ParameterSet::add_memory(const FitChoice& choice) {
  const double k = positive(start_.arm.segments[0].stiffness_nm_per_rad, 1.0);
  const auto number = [&](std::string name, const char* unit, double scale, auto get, auto set,
                          double lowest, double highest, double expected) {
    Parameter it{std::move(name), unit, scale, get, set, lowest};
    it.highest = highest;
    it.expected = expected;
    it.difference = kCoarse;
    parameters_.push_back(std::move(it));
  };
  const Eigen::Index inputs = start_.input_map.cols();
  const double none = std::numeric_limits<double>::quiet_NaN(), inf = -kUnbounded;
  if (choice.saturation || choice.one_saturation) {
    if (start_.saturation_1pbar.size() != inputs) start_.saturation_1pbar.setZero(inputs);
    add_saturation(
        "saturation", choice.saturation, [](auto& arm) -> auto& { return arm.saturation_1pbar; });
  }
  if (choice.hysteresis)
    for (std::size_t i = 0; i < start_.slip_springs.size(); ++i)
      number(
          fmt::format("slip spring of {:.3g} mrad", 1e3 * start_.slip_springs[i].radius_rad),
          "N m/rad", kSlipScale * k,
          [=](const ArmHypothesis& arm) {
            return arm.slip_springs.size() > i ? arm.slip_springs[i].stiffness_nm_per_rad : 0.0;
          },
          [i, springs = start_.slip_springs](ArmHypothesis& arm, double value) {
            if (arm.slip_springs.size() != springs.size()) arm.slip_springs = springs;
            arm.slip_springs[i].stiffness_nm_per_rad = value;
          },
          0.0, inf, start_.slip_springs[i].stiffness_nm_per_rad > 0.0 ? none : kSlipShare * k);
  if (choice.stiffening)
    number(
        "stiffening", "1/bar", kStiffening_1pbar,
        [](const ArmHypothesis& arm) { return arm.stiffening_1pbar; },
        [](ArmHypothesis& arm, double value) { arm.stiffening_1pbar = value; }, kUnbounded, inf,
        none);
  if (choice.by_length)
    number(
        "stiffening by length", "1", kByLength,
        [](const ArmHypothesis& arm) { return arm.stiffening_by_length; },
        [](ArmHypothesis& arm, double value) { arm.stiffening_by_length = value; }, -kMostByLength,
        kMostByLength, none);
  if (choice.remanence) {
    if (start_.remanent_rad.size() != start_.arm.dof())
      start_.remanent_rad.setZero(start_.arm.dof());
    number(
        "remanence", "1", kRemanent, [](const ArmHypothesis& arm) { return arm.remanence.share; },
        [](ArmHypothesis& arm, double value) { arm.remanence.share = value; }, 0.0, 0.9,
        start_.remanence.share > 0.0 ? none : 0.25 * kRemanent);
    number(
        "time of remanence", "s", kRemanence_s,
        [](const ArmHypothesis& arm) { return arm.remanence.time_s; },
        [](ArmHypothesis& arm, double value) { arm.remanence.time_s = value; }, 1.0, 300.0, none);
    for (Eigen::Index c = 0; c < start_.arm.dof(); ++c)
      number(
          fmt::format("remanent {} at first, segment {}", c % 2 == 0 ? "u1" : "u2", c / 2 + 1),
          "rad", kRemanentScale_rad,
          [=](const ArmHypothesis& arm) {
            return arm.remanent_rad.size() > c ? arm.remanent_rad[c] : 0.0;
          },
          [=, dof = start_.arm.dof()](ArmHypothesis& arm, double value) {
            if (arm.remanent_rad.size() != dof) arm.remanent_rad.setZero(dof);
            arm.remanent_rad[c] = value;
          },
          kUnbounded, inf, none);
  }
  if (choice.second_remanence) {
    number(
        "second remanence", "1", kRemanent,
        [](const ArmHypothesis& arm) { return arm.remanence_2.share; },
        [](ArmHypothesis& arm, double value) { arm.remanence_2.share = value; }, 0.0, 0.9,
        start_.remanence_2.share > 0.0 ? none : 0.25 * kRemanent);
    if (start_.remanence_2.share == 0.0) start_.remanence_2.time_s = kSecondRemanence_s;
    number(
        "its time", "s", kSecondRemanence_s,
        [](const ArmHypothesis& arm) { return arm.remanence_2.time_s; },
        [](ArmHypothesis& arm, double value) { arm.remanence_2.time_s = value; }, kSoonest_s,
        kLatest_s, none);
  }
  if (choice.cross && start_.arm.size() > 1) {
    const Eigen::Index dof = start_.arm.dof();
    if (start_.cross_nm_per_bar.size() == 0) start_.cross_nm_per_bar.setZero(dof, inputs);
    for (Eigen::Index j = 0; j < inputs; ++j)
      for (Eigen::Index c = 0; c < dof; ++c) {
        if (start_.segment_of[static_cast<std::size_t>(j)] <= c / 2) continue;
        number(
            fmt::format("chamber {} on {}, segment {}", j + 1, c % 2 == 0 ? "u1" : "u2", c / 2 + 1),
            "N m/bar", kCross * k,
            [=](const ArmHypothesis& arm) {
              return arm.cross_nm_per_bar.size() > 0 ? arm.cross_nm_per_bar(c, j) : 0.0;
            },
            [=](ArmHypothesis& arm, double value) {
              if (arm.cross_nm_per_bar.size() == 0) arm.cross_nm_per_bar.setZero(dof, inputs);
              arm.cross_nm_per_bar(c, j) = value;
            },
            kUnbounded, inf, none);
      }
  }
}

void ParameterSet::add_masses(const FitChoice& choice) {
  const auto factor = [&](const char* name, double SegmentParameters::*member) {
    const double first = start_.arm.segments[0].*member;
    Parameter it{name,
                 "1",
                 1.0,
                 [=](const ArmHypothesis& arm) { return arm.arm.segments[0].*member / first; },
                 [=, segments = start_.arm.segments](ArmHypothesis& arm, double value) {
                   for (std::size_t i = 0; i < segments.size(); ++i)
                     arm.arm.segments[i].*member = value * segments[i].*member;
                 },
                 0.01};
    parameters_.push_back(std::move(it));
  };
  if (choice.mass && start_.arm.segments[0].mass_kg > 0.0)
    factor("factor of masses", &SegmentParameters::mass_kg);
  if (choice.length) factor("factor of lengths", &SegmentParameters::length_m);
  if (!choice.load) return;
  double mass_kg = 0.0;
  for (const SegmentParameters& segment : start_.arm.segments) mass_kg += segment.mass_kg;
  parameters_.push_back({"load at the tip", "kg", std::max(kLeastLoad_kg, 0.2 * mass_kg),
                         [](const ArmHypothesis& arm) { return arm.load_kg; },
                         [](ArmHypothesis& arm, double value) { arm.load_kg = value; }, 0.0});
}

void ParameterSet::add_elongation(const FitChoice& choice) {
  const Eigen::Index n = start_.arm.size(), inputs = start_.input_map.cols();
  ElongationHypothesis& it = start_.elongation;
  if (!it.given()) {
    it.offset_m.resize(n);
    for (Eigen::Index i = 0; i < n; ++i)
      it.offset_m[i] = start_.arm.segments[static_cast<std::size_t>(i)].length_m;
    it.gain_m_per_bar.setZero(n, inputs);
    it.lags = start_.input_lags();
  }
  if (it.saturation_1pbar.size() != inputs) it.saturation_1pbar.setZero(inputs);
  const double none = std::numeric_limits<double>::quiet_NaN(), inf = -kUnbounded;
  const auto number = [&](std::string name, const char* unit, double scale, auto member,
                          double lowest, double highest, double expected) {
    Parameter one{std::move(name),
                  unit,
                  scale,
                  [=](const ArmHypothesis& arm) { return member(arm.elongation); },
                  [=](ArmHypothesis& arm, double value) { member(arm.elongation) = value; },
                  lowest};
    one.highest = highest;
    one.expected = expected;
    one.difference = kCoarse;
    parameters_.push_back(std::move(one));
  };
  for (Eigen::Index i = 0; i < n; ++i)
    number(
        fmt::format("length without pressure, segment {}", i + 1), "m",
        kOffsetScale_m, [=](auto& e) -> auto& { return e.offset_m[i]; }, 0.0, inf, none);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < inputs; ++j) {
      const int own = start_.segment_of[static_cast<std::size_t>(j)];
      if (choice.cross ? own < i : own != i) continue;
      number(
          fmt::format("stretch of segment {}, chamber {}", i + 1, j + 1), "m/bar",
          kStretch_mpbar, [=](auto& e) -> auto& { return e.gain_m_per_bar(i, j); }, kUnbounded, inf,
          none);
    }
  add_lags(
      "lengthening", "shortening", choice.chamber_lags,
      [](const ArmHypothesis& arm) { return arm.elongation.lags; },
      [](ArmHypothesis & arm) -> auto& { return arm.elongation.lags; });
  if (choice.saturation || choice.one_saturation)
    add_saturation(
        "saturation of stretch", choice.saturation,
        [](auto& arm) -> auto& { return arm.elongation.saturation_1pbar; });
  if (choice.hysteresis)
    number(
        "friction of stretch", "m", kFrictionScale_m, [](auto& e) -> auto& { return e.friction_m; },
        0.0, inf, it.friction_m > 0.0 ? none : 0.25 * kFrictionScale_m);
  if (choice.remanence) {
    number(
        "remanence of stretch", "1", kRemanent, [](auto& e) -> auto& { return e.remanence.share; },
        0.0, inf, it.remanence.share > 0.0 ? none : 0.25 * kRemanent);
    number(
        "its time", "s", kRemanence_s, [](auto& e) -> auto& { return e.remanence.time_s; }, 1.0,
        300.0, none);
  }
  if (choice.set)
    number(
        "set of stretch", "1", kSet, [](auto& e) -> auto& { return e.set; }, 0.0, inf,
        it.set > 0.0 ? none : 0.25 * kSet);
  if (choice.by_bend)
    number(
        "length by bend", "m/rad^2", kByBend_m_per_rad2,
        [](auto& e) -> auto& { return e.by_bend_m_per_rad2; }, kUnbounded, inf, none);
  if (choice.second_remanence) {
    number(
        "second remanence of stretch", "1", kRemanent,
        [](auto& e) -> auto& { return e.remanence_2.share; }, 0.0, inf,
        it.remanence_2.share > 0.0 ? none : 0.25 * kRemanent);
    if (it.remanence_2.share == 0.0) it.remanence_2.time_s = kSecondRemanence_s;
    number(
        "its time", "s", kSecondRemanence_s, [](auto& e) -> auto& { return e.remanence_2.time_s; },
        kSoonest_s, kLatest_s, none);
  }
}

Eigen::VectorXd ParameterSet::expected() const {
  Eigen::VectorXd x = configured();
  for (Eigen::Index i = 0; i < size(); ++i)
    if (std::isfinite((*this)[i].expected)) x[i] = (*this)[i].expected / (*this)[i].scale;
  return x;
}

Eigen::VectorXd ParameterSet::highest() const {
  Eigen::VectorXd x(size());
  for (Eigen::Index i = 0; i < size(); ++i) x[i] = (*this)[i].highest / (*this)[i].scale;
  return x;
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
  // Both rests together follow the bend by less than all of it: there is stiffness left in the end.
  return springs && tried.lag_s >= 0.0 && tried.remanence.share + tried.remanence_2.share < 0.95;
}

void ParameterSet::stay_stiff_to(double bend_rad) {
  double k = std::numeric_limits<double>::infinity();
  for (const SegmentParameters& segment : start_.arm.segments)
    k = std::min(k, segment.stiffness_nm_per_rad);
  for (Parameter& each : parameters_)
    if (each.name == kCubicName) each.lowest = -k / (3.0 * bend_rad * bend_rad);
}

bool ParameterSet::linear(Eigen::Index i) const { return (*this)[i].linear; }

}  // namespace softarm
