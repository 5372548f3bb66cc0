#include "softarm/commissioning/identification/response_model.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "commissioning/identification/quasi_static.hpp"
#include "softarm/actuation/input_map.hpp"
#include "softarm/model/actuation_matrix.hpp"
#include "softarm/model/kinematics.hpp"
#include "softarm/model/modes.hpp"
#include "softarm/model/statics.hpp"

namespace softarm {
namespace {

constexpr double kLargest_rad = 20.0;     ///< a response beyond it is not that of an arm
constexpr double kFastest_1ps = 40000.0;  ///< beyond it a simulation takes too long
constexpr double kStep = 2.0;        ///< times the fastest mode's time constant; stable below 2.78
constexpr double kSlowStep_s = 0.1;  ///< without inertia: what follows valves and tubes

ArmHypothesis hypothesis(const ArmParameters& arm, const ActuationSettings& actuation) {
  ArmHypothesis out;
  out.arm = arm;
  out.arm.extensible = false;  // what is identified is how segments bend
  out.rest_rad.setZero(2 * arm.size());
  out.input_map.resize(2, chamber_count(actuation));
  Eigen::Index first = 0;
  for (std::size_t i = 0; i < actuation.segments.size(); ++i) {
    const Eigen::Matrix2Xd map = input_map(actuation.kind, actuation.segments[i]);
    out.input_map.middleCols(first, map.cols()) = map;
    out.segment_of.insert(out.segment_of.end(), actuation.segments[i].size(), static_cast<int>(i));
    first += map.cols();
  }
  return out;
}

/// Storage of one simulation, and the acceleration of (16).
class Motion {
 public:
  explicit Motion(const ArmHypothesis& arm)
      : arm_(arm),
        plain_(arm.arm),
        workspace_(arm.arm),
        stretched_(arm),
        force_(arm.arm.dof()),
        spring_(arm.arm.dof()) {
    // The springs are added here, with their rest and their cubic part.
    for (SegmentParameters& segment : plain_.segments) segment.stiffness_nm_per_rad = 0.0;
    remanents_.begin(arm, rest_);
  }

  [[nodiscard]] bool acceleration(const Eigen::VectorXd& u, const Eigen::VectorXd& v,
                                  const Eigen::VectorXd& input, Eigen::VectorXd& a) {
    actuation_force(arm_, u, input, force_);
    springs(u, input);
    force_ -= spring_;
    if (arm_.load_kg > 0.0) return loaded_acceleration(u, v, a);
    return forward_dynamics(plain_, workspace_, u, v, force_, a);
  }

  /// Residual of the static balance: G + springs - input.
  void imbalance(const Eigen::VectorXd& u, const Eigen::VectorXd& input, Eigen::VectorXd& out) {
    actuation_force(arm_, u, input, force_);
    springs(u, input);
    gravity_moments(plain_, workspace_, u, out);
    out += spring_ - force_;
    if (arm_.load_kg > 0.0) add_load_moments(arm_, u, out);
  }

  /// The shape at rest under an input.
  std::optional<Eigen::VectorXd> settled(const Eigen::VectorXd& input) {
    return solve_balance(
        [&](const Eigen::VectorXd& u, Eigen::VectorXd& left) { imbalance(u, input, left); },
        arm_.rest_rad);
  }

  StretchedStiffness& stretched() { return stretched_; }

  /// What remembers starts here: friction without tension.
  void remember_from(const Eigen::VectorXd& u) { centres_.assign(arm_.slip_springs.size(), u); }

  /// One step of length h; inputs at its begin, middle and end.
  [[nodiscard]] bool step(double h, const Eigen::VectorXd& p0, const Eigen::VectorXd& p1,
                          const Eigen::VectorXd& p2, Eigen::VectorXd& u, Eigen::VectorXd& v) {
    if (!acceleration(u, v, p0, a1_)) return false;
    u2_ = u + 0.5 * h * v;
    v2_ = v + 0.5 * h * a1_;
    if (!acceleration(u2_, v2_, p1, a2_)) return false;
    u3_ = u + 0.5 * h * v2_;
    v3_ = v + 0.5 * h * a2_;
    if (!acceleration(u3_, v3_, p1, a3_)) return false;
    u4_ = u + h * v3_;
    v4_ = v + h * a3_;
    if (!acceleration(u4_, v4_, p2, a4_)) return false;
    u += h / 6.0 * (v + 2.0 * v2_ + 2.0 * v3_ + v4_);
    v += h / 6.0 * (a1_ + 2.0 * a2_ + 2.0 * a3_ + a4_);
    if (arm_.remembers()) remember(h, u);
    return u.allFinite() && u.cwiseAbs().maxCoeff() < kLargest_rad;
  }

  void reserve(Eigen::Index dof) {
    for (Eigen::VectorXd* each : {&a1_, &a2_, &a3_, &a4_}) each->setZero(dof);
  }

 private:
  void springs(const Eigen::VectorXd& u, const Eigen::VectorXd& input) {
    if (!arm_.remembers() && arm_.stiffening_1pbar == 0.0 && !stretched_.given())
      return spring_force(arm_, u, spring_);
    for (Eigen::Index i = 0; i < u.size(); i += 2) {
      const Eigen::Vector2d bend = u.segment<2>(i) - rest_.segment<2>(i);
      double sum_bar = 0.0;
      for (std::size_t j = 0; j < arm_.segment_of.size(); ++j)
        if (arm_.segment_of[j] == i / 2) sum_bar += input[static_cast<Eigen::Index>(j)];
      const double k = arm_.arm.segments[static_cast<std::size_t>(i / 2)].stiffness_nm_per_rad *
                       (1.0 + arm_.stiffening_1pbar * sum_bar) *
                       stretched_.factor(i / 2, u.segment<2>(i));
      spring_.segment<2>(i) = (k + arm_.cubic_nm_per_rad3 * bend.squaredNorm()) * bend;
      for (std::size_t k2 = 0; k2 < centres_.size(); ++k2)
        spring_.segment<2>(i) +=
            arm_.slip_springs[k2].moment(centres_[k2].segment<2>(i), u.segment<2>(i));
    }
  }

  /// (B + m J'J) u'' = force - C u' - D u' - G - m J' (J' u' - g) by the Woodbury identity: B^-1 J'
  /// is four forward dynamics, which are affine in the force.
  [[nodiscard]] bool loaded_acceleration(const Eigen::VectorXd& u, const Eigen::VectorXd& v,
                                         Eigen::VectorXd& a) {
    const double m = arm_.load_kg;
    const Eigen::Index dof = u.size();
    Eigen::Matrix3Xd J(3, dof), rate(3, dof);
    tip_jacobians(plain_, u, v, J, rate);
    force_ -= m * J.transpose() * (rate * v - plain_.gravity_mps2);
    if (!forward_dynamics(plain_, workspace_, u, v, force_, a)) return false;
    Eigen::MatrixXd moved(dof, 3);
    Eigen::VectorXd with(dof);
    for (int axis = 0; axis < 3; ++axis) {
      spring_ = force_ + J.row(axis).transpose();
      if (!forward_dynamics(plain_, workspace_, u, v, spring_, with)) return false;
      moved.col(axis) = with - a;
    }
    const Eigen::Matrix3d inner = Eigen::Matrix3d::Identity() / m + J * moved;
    a -= moved * inner.ldlt().solve(J * a);
    return true;
  }

  void remember(double step_s, const Eigen::VectorXd& u) {
    for (std::size_t k = 0; k < centres_.size(); ++k)
      for (Eigen::Index i = 0; i < u.size(); i += 2)
        centres_[k].segment<2>(i) =
            play(centres_[k].segment<2>(i), u.segment<2>(i), arm_.slip_springs[k].radius_rad);
    remanents_.step(arm_, u, step_s, rest_);
  }

  const ArmHypothesis& arm_;
  ArmParameters plain_;
  DynamicsWorkspace workspace_;
  StretchedStiffness stretched_;
  Eigen::VectorXd force_, spring_, rest_;
  RemanentRest remanents_;
  std::vector<Eigen::VectorXd> centres_;  ///< of the slip springs
  Eigen::VectorXd a1_, a2_, a3_, a4_, u2_, u3_, u4_, v2_, v3_, v4_;
};

using Numbers = std::vector<double>;

bool any(const Numbers& numbers) {
  return std::any_of(numbers.begin(), numbers.end(), [](double x) { return x != 0.0; });
}

/// A column of `rows` numbers for every chamber.
Eigen::MatrixXd columns(const Numbers& numbers, Eigen::Index rows) {
  return Eigen::Map<const Eigen::MatrixXd>(numbers.data(), rows,
                                           static_cast<Eigen::Index>(numbers.size()) / rows);
}
Eigen::VectorXd vector(const Numbers& numbers) { return columns(numbers, 1).transpose(); }

std::vector<FillVentLag> lags(const Numbers& fill_s, const Numbers& vent_s) {
  std::vector<FillVentLag> out;
  for (std::size_t j = 0; j < fill_s.size(); ++j) out.push_back({fill_s[j], vent_s[j]});
  return out;
}

void with_memory(const IdentificationSettings& extra, ArmHypothesis& out) {
  if (any(extra.push_nm_per_bar)) out.input_map = columns(extra.push_nm_per_bar, 2);
  if (any(extra.fill_lag_s) || any(extra.vent_lag_s))
    out.lags = lags(extra.fill_lag_s, extra.vent_lag_s);
  if (any(extra.saturation_1pbar)) out.saturation_1pbar = vector(extra.saturation_1pbar);
  out.stiffening_1pbar = extra.stiffening_1pbar;
  out.stiffening_by_length = extra.stiffening_by_length;
  if (any(extra.cross_nm_per_bar))
    out.cross_nm_per_bar = columns(extra.cross_nm_per_bar, out.arm.dof());
  for (std::size_t k = 0; k < extra.slip_radius_rad.size(); ++k)
    if (k < extra.slip_stiffness_nm_per_rad.size() && extra.slip_stiffness_nm_per_rad[k] > 0.0)
      out.slip_springs.push_back({extra.slip_radius_rad[k], extra.slip_stiffness_nm_per_rad[k]});
  out.remanence = {extra.remanence, extra.remanence_s};
  out.remanence_2 = {extra.remanence_2, extra.remanence_2_s};
  if (any(extra.remanent_u_rad)) out.remanent_rad = vector(extra.remanent_u_rad);
}

void with_stretch(const IdentificationSettings& extra, ArmHypothesis& out) {
  if (!any(extra.stretch_m_per_bar)) return;
  ElongationHypothesis& it = out.elongation;
  it.gain_m_per_bar = columns(extra.stretch_m_per_bar, out.arm.size());
  it.offset_m = vector(extra.stretch_length_m);
  it.lags = lags(extra.stretch_fill_s, extra.stretch_vent_s);
  if (any(extra.stretch_saturation_1pbar))
    it.saturation_1pbar = vector(extra.stretch_saturation_1pbar);
  it.friction_m = extra.stretch_friction_m;
  it.remanence = {extra.stretch_remanence, extra.stretch_remanence_s};
  it.remanence_2 = {extra.stretch_remanence_2, extra.stretch_remanence_2_s};
  it.set = extra.stretch_set;
  it.by_bend_m_per_rad2 = extra.stretch_by_bend_m_per_rad2;
}

}  // namespace

ArmHypothesis configured(const Experiment& experiment) {
  ArmHypothesis out = hypothesis(experiment.arm, experiment.actuation);
  const IdentificationSettings& extra = experiment.identification;
  for (std::size_t c = 0; c < extra.rest_u_rad.size(); ++c)
    out.rest_rad[static_cast<Eigen::Index>(c)] = extra.rest_u_rad[c];
  out.cubic_nm_per_rad3 = extra.cubic_nm_per_rad3;
  out.lag_s = extra.lag_s;
  out.dead_time_s = extra.dead_time_s;
  out.inertia = extra.inertia;
  out.load_kg = extra.load_kg;
  with_memory(extra, out);
  with_stretch(extra, out);
  return out;
}

std::vector<FillVentLag> ArmHypothesis::input_lags() const {
  if (!lags.empty()) return lags;
  return std::vector<FillVentLag>(static_cast<std::size_t>(input_map.cols()),
                                  FillVentLag{lag_s, lag_s});
}

ArmHypothesis of_plant(const Experiment& experiment) {
  ArmHypothesis out = hypothesis(experiment.plant.arm, experiment.plant.actuation);
  out.lag_s = experiment.plant.valves.lag_s;
  out.dead_time_s = experiment.plant.valves.dead_time_s;
  if (!experiment.plant.payload_kg.empty()) out.load_kg = experiment.plant.payload_kg.back();
  return out;
}

void actuation_force(const ArmHypothesis& arm, ConstVectorRef u, const Eigen::VectorXd& input,
                     VectorRef force) {
  force.setZero();
  for (Eigen::Index j = 0; j < arm.input_map.cols(); ++j) {
    double p = input[j];
    if (arm.saturation_1pbar.size() > 0) p *= 1.0 + arm.saturation_1pbar[j] * p;
    force.segment<2>(2 * arm.segment_of[static_cast<std::size_t>(j)]) += p * arm.input_map.col(j);
    if (arm.cross_nm_per_bar.size() > 0) force += p * arm.cross_nm_per_bar.col(j);
  }
  if (arm.arm.actuation == ActuationModel::chamber) return;
  for (Eigen::Index i = 0; i < arm.arm.size(); ++i) {
    const Eigen::Vector2d f = force.segment<2>(2 * i);  // = A_chamber tau_A
    force.segment<2>(2 * i) =
        actuation_matrix(arm.arm.actuation, u.segment<2>(2 * i)) * Eigen::Vector2d(-f.y(), f.x());
  }
}

void add_load_moments(const ArmHypothesis& arm, ConstVectorRef u, VectorRef out) {
  Eigen::Matrix3Xd J(3, u.size());
  tip_jacobian(arm.arm, u, J);
  out -= arm.load_kg * J.transpose() * arm.arm.gravity_mps2;
}

void spring_force(const ArmHypothesis& arm, ConstVectorRef u, VectorRef force) {
  for (Eigen::Index i = 0; i < arm.arm.size(); ++i) {
    const Eigen::Vector2d bend = u.segment<2>(2 * i) - arm.rest_rad.segment<2>(2 * i);
    force.segment<2>(2 * i) = (arm.arm.segments[static_cast<std::size_t>(i)].stiffness_nm_per_rad +
                               arm.cubic_nm_per_rad3 * bend.squaredNorm()) *
                              bend;
  }
}

double ResponseModel::fastest_1ps(const ArmHypothesis& arm) const {
  const Eigen::Index dof = arm.arm.dof();
  DynamicsWorkspace workspace(arm.arm);
  double bend_rad = 0.0;  // where the cubic springs are stiffest
  if (arm.cubic_nm_per_rad3 > 0.0)
    for (Eigen::Index i = 0; i < record_.u_rad.cols() / 2; ++i)
      bend_rad = std::max(bend_rad, record_.u_rad.middleCols<2>(2 * i).rowwise().norm().maxCoeff());
  Eigen::VectorXd damping(dof), springs(dof);
  for (Eigen::Index c = 0; c < dof; ++c) {
    const SegmentParameters& segment = arm.arm.segments[static_cast<std::size_t>(c / 2)];
    damping[c] = segment.damping_nms_per_rad;
    springs[c] = segment.stiffness_nm_per_rad + 3.0 * arm.cubic_nm_per_rad3 * bend_rad * bend_rad;
  }
  const Eigen::VectorXd straight = Eigen::VectorXd::Zero(dof);
  Eigen::MatrixXd B(dof, dof);
  inertia_matrix(arm.arm, workspace, straight, B);
  const double smallest = symmetric_modes(B).values[0];
  const Eigen::MatrixXd impedance = damping.asDiagonal();
  const double damped = symmetric_modes(impedance, B).values[dof - 1];
  return std::max(damped, std::sqrt(springs.maxCoeff() / smallest));
}

std::optional<double> ResponseModel::step_s(const ArmHypothesis& arm) const {
  if (!arm.inertia) return kSlowStep_s;
  const double rate = fastest_1ps(arm);
  if (!(rate < kFastest_1ps)) return std::nullopt;
  return kStep / rate;
}

double ResponseModel::longest_step_s(const ArmHypothesis& arm) const {
  if (const std::optional<double> step = step_s(arm)) return *step;
  throw std::runtime_error(fmt::format(
      "the fastest mode of the arm is at {:.3g} 1/s: its response cannot be simulated in "
      "reasonable time; arm.mass_model: distributed has slower modes, --linear needs none",
      fastest_1ps(arm)));
}

bool ResponseModel::simulate(const ArmHypothesis& arm, double longest_step_s,
                             Eigen::MatrixXd& u) const {
  u.resize(record_.time_s.size(), arm.arm.dof());
  return arm.inertia ? simulate_motion(arm, longest_step_s, u)
                     : simulate_balance(arm, longest_step_s, u);
}

KnownLengths ResponseModel::stretching(const ArmHypothesis& arm) const {
  if (arm.stiffening_by_length == 0.0) return {};
  return record_.lengths.pressed_m.rows() > 0 || !arm.elongation.given() ? record_.lengths
                                                                         : lengths_of(arm);
}

bool ResponseModel::simulate_motion(const ArmHypothesis& arm, double longest_step_s,
                                    Eigen::MatrixXd& u) const {
  const Eigen::Index frames = record_.time_s.size(), dof = arm.arm.dof();
  LaggedInput input(record_.input, arm.input_lags(), arm.dead_time_s);
  Motion motion(arm);
  motion.reserve(dof);
  Eigen::VectorXd p0(arm.input_map.cols()), p1 = p0, p2 = p0, v = Eigen::VectorXd::Zero(dof);
  input.at(record_.time_s[0], p0);
  const KnownLengths lengths = stretching(arm);
  motion.stretched().at(0, lengths);
  const std::optional<Eigen::VectorXd> settled = motion.settled(p0);
  if (!settled) return false;
  Eigen::VectorXd now = *settled;
  motion.remember_from(now);
  u.row(0) = now;
  for (Eigen::Index k = 1; k < frames; ++k) {
    const double from_s = record_.time_s[k - 1], span_s = record_.time_s[k] - from_s;
    const int steps = std::max(1, static_cast<int>(std::ceil(span_s / longest_step_s - 1e-9)));
    const double h = span_s / steps;
    motion.stretched().at(k, lengths);
    for (int j = 0; j < steps; ++j) {
      input.at(from_s + (j + 0.5) * h, p1);
      const double to_s = j + 1 == steps ? record_.time_s[k] : from_s + (j + 1) * h;
      input.at(to_s, p2, true);
      if (!motion.step(h, p0, p1, p2, now, v)) return false;
      input.at(to_s, p0);
    }
    u.row(k) = now;
  }
  return true;
}

bool ResponseModel::simulate_balance(const ArmHypothesis& arm, double longest_step_s,
                                     Eigen::MatrixXd& u) const {
  constexpr int kStages = QuasiStaticMotion::kStages;
  LaggedInput input(record_.input, arm.input_lags(), arm.dead_time_s);
  QuasiStaticMotion motion(arm);
  Eigen::VectorXd inputs[kStages];
  for (Eigen::VectorXd& each : inputs) each.setZero(arm.input_map.cols());
  input.at(record_.time_s[0], inputs[0]);
  const KnownLengths lengths = stretching(arm);
  motion.stretched().at(0, lengths);
  if (!motion.settle(inputs[0])) return false;
  u.row(0) = motion.u_rad();
  for (Eigen::Index k = 1; k < record_.time_s.size(); ++k) {
    const double from_s = record_.time_s[k - 1], span_s = record_.time_s[k] - from_s;
    const int steps = std::max(1, static_cast<int>(std::ceil(span_s / longest_step_s - 1e-9)));
    const double h = span_s / steps;
    motion.stretched().at(k, lengths);
    for (int j = 0; j < steps; ++j) {
      for (int i = 0; i < kStages; ++i)
        input.at(from_s + (j + QuasiStaticMotion::kNodes[i]) * h, inputs[i], i + 1 == kStages);
      if (!motion.step(h, inputs)) return false;
    }
    u.row(k) = motion.u_rad();
  }
  return true;
}

KnownLengths ResponseModel::lengths_of(const ArmHypothesis& arm) const {
  const ElongationHypothesis& it = arm.elongation;
  const Eigen::Index frames = record_.time_s.size(), n = it.offset_m.size();
  KnownLengths out{Eigen::MatrixXd(frames, n), it.by_bend_m_per_rad2};
  LaggedInput input(record_.input, it.lags, arm.dead_time_s);
  Eigen::VectorXd p(it.gain_m_per_bar.cols()), centre, most;
  Eigen::VectorXd remanent = Eigen::VectorXd::Zero(n), remanent_2 = remanent;
  for (Eigen::Index k = 0; k < frames; ++k) {
    input.at(record_.time_s[k], p);
    for (Eigen::Index j = 0; j < it.saturation_1pbar.size(); ++j)
      p[j] *= 1.0 + it.saturation_1pbar[j] * p[j];
    const Eigen::VectorXd target = it.gain_m_per_bar * p;
    if (k == 0) centre = most = target;
    for (Eigen::Index i = 0; i < n; ++i) {
      centre[i] = std::clamp(centre[i], target[i] - it.friction_m, target[i] + it.friction_m);
      most[i] = std::max(most[i], centre[i]);
      if (k == 0) continue;
      const double passed_s = record_.time_s[k] - record_.time_s[k - 1];
      if (it.remanence.share != 0.0)
        remanent[i] = it.remanence.step(remanent[i], centre[i], passed_s);
      if (it.remanence_2.share != 0.0)
        remanent_2[i] = it.remanence_2.step(remanent_2[i], centre[i], passed_s);
    }
    out.pressed_m.row(k) = it.offset_m + centre + remanent + remanent_2 + it.set * most;
  }
  return out;
}

void ResponseModel::simulate_lengths(const ArmHypothesis& arm, const Eigen::MatrixXd& u_rad,
                                     Eigen::MatrixXd& length_m) const {
  const KnownLengths lengths = lengths_of(arm);
  length_m = lengths.pressed_m;
  for (Eigen::Index i = 0; i < length_m.cols(); ++i)
    length_m.col(i) +=
        lengths.by_bend_m_per_rad2 * u_rad.middleCols<2>(2 * i).rowwise().squaredNorm();
}

}  // namespace softarm
