#include "estimation/arm_predictor.hpp"

#include <algorithm>
#include <cmath>

#include "softarm/base/time.hpp"
#include "softarm/model/actuation_matrix.hpp"
#include "softarm/model/coordinates.hpp"

namespace softarm {

TorqueHistory::TorqueHistory(int size, int commands, double lag_s)
    : lag_s_(lag_s), ring_(static_cast<std::size_t>(commands)), zero_(SegmentVector::Zero(size)) {
  for (Command& each : ring_) each.tau_nm = zero_;
}

void TorqueHistory::command(std::int64_t from_ns, ConstVectorRef tau_nm) noexcept {
  Command& next = ring_[static_cast<std::size_t>(count_) % ring_.size()];
  next.from_ns = from_ns;
  next.tau_nm = tau_nm;
  ++count_;
}

void TorqueHistory::clear() noexcept {
  for (Command& each : ring_) each.tau_nm.setZero();
}

void TorqueHistory::settle(std::int64_t time_ns, LaggedTorque& out) const noexcept {
  const std::int64_t oldest = std::max<std::int64_t>(0, count_ - std::ssize(ring_));
  out.next = count_;
  while (out.next > oldest && at(out.next - 1).from_ns > time_ns) --out.next;
  out.command_nm = out.next > oldest ? at(out.next - 1).tau_nm : zero_;
  out.tau_nm = out.command_nm;
  out.time_ns = time_ns;
}

void TorqueHistory::advance(std::int64_t time_ns, LaggedTorque& state,
                            SegmentVector& mean_nm) const noexcept {
  mean_nm.setZero(zero_.size());
  const double whole_s = to_seconds(time_ns - state.time_ns);
  state.next = std::max(state.next, count_ - std::ssize(ring_));
  while (true) {
    const bool changes = state.next < count_ && at(state.next).from_ns <= time_ns;
    const std::int64_t until_ns =
        changes ? std::max(at(state.next).from_ns, state.time_ns) : time_ns;
    const double part_s = to_seconds(until_ns - state.time_ns);
    if (part_s > 0.0) {
      const double gone = lag_s_ > 0.0 ? -std::expm1(-part_s / lag_s_) : 1.0;
      // The command's share of the integral, less what the lag still owes.
      mean_nm += part_s * state.command_nm + lag_s_ * gone * (state.tau_nm - state.command_nm);
      state.tau_nm += gone * (state.command_nm - state.tau_nm);
      state.time_ns = until_ns;
    }
    if (!changes) break;
    state.command_nm = at(state.next++).tau_nm;
    if (lag_s_ <= 0.0) state.tau_nm = state.command_nm;
  }
  if (whole_s > 0.0) {
    mean_nm /= whole_s;
  } else {
    mean_nm = state.tau_nm;
  }
}

ArmPredictor::ArmPredictor(const ArmParameters& arm)
    : arm_(arm),
      workspace_(arm),
      horizontal_(arm),
      inertia_(arm.dof(), arm.dof()),
      implicit_(arm.dof(), arm.dof()),
      factor_(arm.dof()) {
  for (SegmentVector* each : {&stiffness_, &damping_, &load_, &along_x_, &along_y_, &force_,
                              &product_, &k1u_, &k1v_, &u2_, &v2_, &rate_, &k2v_})
    each->setZero(arm.dof());
}

void ArmPredictor::set_stretch(ConstVectorRef length_m, const SegmentVector& coupling_nm) noexcept {
  coupling_ = coupling_nm;
  set_lengths(arm_, length_m);
  horizontal_.set_lengths(length_m);
}

void ArmPredictor::linearize(ConstVectorRef u, const ModelCorrection& correction) noexcept {
  inertia_matrix(arm_, workspace_, u, inertia_);
  factored_step_s_ = 0.0;
  horizontal_.rows(u, workspace_, along_x_, along_y_);
  for (int i = 0; i < arm_.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    const SegmentParameters& segment = arm_.segments[k];
    const SegmentCorrection& off = correction.segment[k];
    stiffness_.segment<2>(2 * i).setConstant((1.0 + off.stiffness) * segment.stiffness_nm_per_rad);
    damping_.segment<2>(2 * i).setConstant((1.0 + off.damping) * segment.damping_nms_per_rad);
    load_.segment<2>(2 * i) =
        off.load.x() * along_x_.segment<2>(2 * i) + off.load.y() * along_y_.segment<2>(2 * i);
  }
  if (coupling_.size() > 0) load_ += coupling_;
}

void ArmPredictor::force(ConstVectorRef tau_nm, const ModelCorrection& correction,
                         const SegmentVector& u, const SegmentVector& velocity,
                         SegmentVector& out) noexcept {
  constexpr DynamicsTerms kTerms{false, true, true};
  apply_actuation(arm_, u, tau_nm, out);
  for (int i = 0; i < arm_.size(); ++i)
    out.segment<2>(2 * i) *= 1.0 + correction.segment[static_cast<std::size_t>(i)].gain;
  inverse_dynamics(arm_, workspace_, u, velocity, velocity, velocity, kTerms, product_);
  out += correction.disturbance_nm - load_ - product_;
  out.array() -= stiffness_.array() * u.array() + damping_.array() * velocity.array();
}

bool ArmPredictor::step(double step_s, ConstVectorRef tau_nm, const ModelCorrection& correction,
                        SegmentVector& u, SegmentVector& velocity) noexcept {
  constexpr double kGamma = 0.29289321881345248;  // 1 - 1/sqrt(2): L-stable
  const double gh = kGamma * step_s;
  if (step_s != factored_step_s_) {
    implicit_ = inertia_;
    implicit_.diagonal().array() += gh * damping_.array() + gh * gh * stiffness_.array();
    factor_.compute(implicit_);
    factored_step_s_ = step_s;
    if (factor_.info() != Eigen::Success) {
      factored_step_s_ = 0.0;
      return false;
    }
  }
  force(tau_nm, correction, u, velocity, k1v_);
  k1v_.array() -= gh * stiffness_.array() * velocity.array();
  factor_.solveInPlace(k1v_);
  k1u_ = velocity + gh * k1v_;
  u2_ = u + step_s * k1u_;
  v2_ = velocity + step_s * k1v_;
  force(tau_nm, correction, u2_, v2_, k2v_);
  rate_ = v2_ - 2.0 * k1u_;
  k2v_.noalias() -= 2.0 * (inertia_ * k1v_);
  k2v_.array() -= gh * stiffness_.array() * rate_.array();
  factor_.solveInPlace(k2v_);
  u2_ = u + step_s * (1.5 * k1u_ + 0.5 * (rate_ + gh * k2v_));
  v2_ = velocity + step_s * (1.5 * k1v_ + 0.5 * k2v_);
  if (!u2_.allFinite() || !v2_.allFinite()) return false;
  u = u2_;
  velocity = v2_;
  return true;
}

}  // namespace softarm
