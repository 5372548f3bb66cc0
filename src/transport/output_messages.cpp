#include "softarm/transport/output_messages.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "softarm/runtime/settings.hpp"

namespace softarm {
namespace {

std::int16_t flags_of(const TickOutput& output, bool shadow) noexcept {
  using Status = softarm_messages::controller_status_t;
  int flags = 0;
  if (output.saturated) flags |= Status::SATURATED;
  if (output.slew_limited) flags |= Status::SLEW_LIMITED;
  if (output.reference_limited) flags |= Status::REFERENCE_LIMITED;
  if (output.soft_limit) flags |= Status::SOFT_LIMIT;
  if (shadow) flags |= Status::SHADOW;
  if (output.armed) flags |= Status::ARMED;
  if (output.bounded) flags |= Status::BOUNDED;
  if (output.length_warning) flags |= Status::LENGTH;
  return static_cast<std::int16_t>(flags);
}

/// The first two of every segment's coordinates; NaN where there are none.
void put_pairs(const SegmentVector& from, Eigen::Index width,
               std::vector<std::vector<float>>& to) noexcept {
  for (std::size_t i = 0; i < to.size(); ++i)
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const Eigen::Index k = width * static_cast<Eigen::Index>(i) + static_cast<Eigen::Index>(axis);
      to[i][axis] =
          k < from.size() ? static_cast<float>(from[k]) : std::numeric_limits<float>::quiet_NaN();
    }
}

/// The third of every segment's, where segments stretch.
void put_third(const SegmentVector& from, std::vector<float>& to) noexcept {
  for (std::size_t i = 0; i < to.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(3 * i + 2);
    to[i] = k < from.size() ? static_cast<float>(from[k]) : std::numeric_limits<float>::quiet_NaN();
  }
}

/// Of every segment that stretches; nothing where the lists are empty.
void put_axial(const SegmentScalars& e_m, const ModelCorrection& from, std::vector<float>& to_e_m,
               std::vector<float>& force_n, std::vector<float>& stiffness,
               std::vector<float>& damping, std::vector<float>& gain) noexcept {
  for (std::size_t i = 0; i < to_e_m.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    to_e_m[i] =
        k < e_m.size() ? static_cast<float>(e_m[k]) : std::numeric_limits<float>::quiet_NaN();
    force_n[i] = static_cast<float>(from.segment[i].axial_force_n);
    stiffness[i] = static_cast<float>(from.segment[i].axial_stiffness);
    damping[i] = static_cast<float>(from.segment[i].axial_damping);
    gain[i] = static_cast<float>(from.segment[i].axial_gain);
  }
}

}  // namespace

std::int32_t counter(std::int64_t value) noexcept {
  return static_cast<std::int32_t>(
      std::min<std::int64_t>(value, std::numeric_limits<std::int32_t>::max()));
}

OutputMessages::OutputMessages(const PipelineSettings& settings, const Provenance& provenance,
                               bool shadow)
    : pressure_command{},
      torque_command{},
      status{},
      observer{},
      law_state{},
      width_(settings.arm.segment_dof()),
      by_torque_(settings.actuation.kind == ActuationKind::torque) {
  const auto segments = static_cast<std::size_t>(settings.arm.size());
  const auto chambers = static_cast<std::size_t>(chamber_count(settings.actuation));

  // All lists are grown here, so that the loop never has to.
  pressure_command.shadow = shadow ? 1 : 0;
  pressure_command.validity_us =
      static_cast<std::int32_t>(std::lround(1e6 * settings.safety.command_validity_s));
  pressure_command.num_chambers = static_cast<std::int16_t>(chambers);
  pressure_command.pressure_bar.assign(chambers, 0.0F);
  torque_command.shadow = pressure_command.shadow;
  torque_command.validity_us = pressure_command.validity_us;
  torque_command.num_moments = static_cast<std::int16_t>(chambers);
  torque_command.torque_nm.assign(chambers, 0.0);
  status.version = provenance.version;
  status.configuration_hash = static_cast<std::int64_t>(provenance.configuration_hash);
  status.seed = static_cast<std::int64_t>(provenance.seed);
  status.num_segments = static_cast<std::int16_t>(segments);
  status.num_chambers = static_cast<std::int16_t>(chambers);
  for (auto* pairs :
       {&status.u_rad, &status.velocity_radps, &status.reference_u_rad, &status.tau_actuation_nm})
    pairs->assign(segments, std::vector<float>(2));
  for (auto* list :
       {&status.phi_rad, &status.theta_rad, &status.residual_twist_rad, &status.residual_length_m})
    list->assign(segments, 0.0F);
  status.pressure_bar.assign(chambers, 0.0F);
  law_state.dimension = static_cast<std::int16_t>(settings.arm.dof());
  law_state.num_chambers = status.num_chambers;
  for (auto* list : {&law_state.u_rad, &law_state.velocity_radps, &law_state.reference_u_rad,
                     &law_state.reference_velocity_radps, &law_state.reference_acceleration_radps2})
    list->resize(static_cast<std::size_t>(settings.arm.dof()));
  law_state.pressure_bar.assign(chambers, 0.0F);
  if (settings.arm.extensible) {
    status.num_stretching = status.num_segments;
    for (auto* list : {&status.elongation_m, &status.elongation_rate_mps,
                       &status.reference_elongation_m, &status.axial_force_n})
      list->assign(segments, 0.0F);
  }
  if (settings.estimation.observer != ObserverKind::model) return;
  observer.num_segments = status.num_segments;
  for (auto* list :
       {&observer.stiffness, &observer.damping, &observer.gain, &observer.stiffness_deviation,
        &observer.damping_deviation, &observer.gain_deviation})
    list->assign(segments, 0.0F);
  for (auto* pairs : {&observer.load, &observer.disturbance_nm, &observer.load_deviation,
                      &observer.disturbance_deviation_nm})
    pairs->assign(segments, std::vector<float>(2));
  if (!settings.arm.extensible) return;
  observer.num_stretching = status.num_segments;
  for (auto* list :
       {&observer.elongation_m, &observer.axial_force_n, &observer.axial_stiffness,
        &observer.axial_damping, &observer.axial_gain, &observer.elongation_deviation_m,
        &observer.axial_force_deviation_n, &observer.axial_stiffness_deviation,
        &observer.axial_damping_deviation, &observer.axial_gain_deviation})
    list->assign(segments, 0.0F);
}

void OutputMessages::set_command(std::int64_t tick, const TickOutput& output) noexcept {
  pressure_command.sequence = torque_command.sequence = tick;
  for (std::size_t j = 0; j < pressure_command.pressure_bar.size(); ++j)
    pressure_command.pressure_bar[j] =
        static_cast<float>(output.pressure_bar[static_cast<Eigen::Index>(j)]);
  if (by_torque_)
    std::copy(output.pressure_bar.begin(), output.pressure_bar.end(),
              torque_command.torque_nm.begin());
}

void OutputMessages::set_law_state(std::int64_t tick, const TickOutput& output) noexcept {
  law_state.tick = tick;
  law_state.mode = static_cast<std::int8_t>(output.mode);
  law_state.active_s = output.law->active_s;
  const auto put = [](const SegmentVector& from, std::vector<double>& to) {
    std::copy(from.begin(), from.end(), to.begin());
  };
  put(output.law->u_rad, law_state.u_rad);
  put(output.law->velocity_radps, law_state.velocity_radps);
  put(output.law->reference.u, law_state.reference_u_rad);
  put(output.law->reference.velocity, law_state.reference_velocity_radps);
  put(output.law->reference.acceleration, law_state.reference_acceleration_radps2);
  std::transform(output.pressure_bar.begin(), output.pressure_bar.end(),
                 law_state.pressure_bar.begin(),
                 [](double bar) { return static_cast<float>(bar); });
}

void OutputMessages::set_status(std::int64_t tick, const ControlPipeline& pipeline) noexcept {
  const TickOutput& output = pipeline.output();
  const FrameCounters& frames = pipeline.counters();
  const CurvatureEstimate& estimate = pipeline.estimate();
  status.tick = tick;
  status.frame_number = output.frame_number;
  status.mode = static_cast<std::int8_t>(output.mode);
  status.reason = static_cast<std::int8_t>(output.reason);
  status.flags = flags_of(output, pressure_command.shadow != 0);
  status.frame_age_s = static_cast<float>(output.frame_age_s);
  status.frames_accepted = counter(frames.accepted);
  status.frames_rejected = counter(frames.rejected() + pipeline.late_frames());
  status.refusal = static_cast<std::int8_t>(output.refusal);
  status.frames_repeated = counter(frames.repeated);
  status.frames_missing = counter(frames.missing);
  // Entry 0 stays 0: accepted references are not refused.
  std::transform(pipeline.reference_counts().begin() + 1, pipeline.reference_counts().end(),
                 status.references_refused + 1, counter);
  std::transform(pipeline.law_counts().begin(), pipeline.law_counts().end(), status.law_answers,
                 counter);
  status.law_round_trip_s = static_cast<float>(output.law_round_trip_s);
  put_pairs(output.motion.u_rad, width_, status.u_rad);
  put_pairs(output.motion.velocity_radps, width_, status.velocity_radps);
  put_pairs(output.reference.u, width_, status.reference_u_rad);
  put_pairs(output.tau_actuation_nm, width_, status.tau_actuation_nm);
  put_third(output.motion.u_rad, status.elongation_m);
  put_third(output.motion.velocity_radps, status.elongation_rate_mps);
  put_third(output.reference.u, status.reference_elongation_m);
  put_third(output.tau_actuation_nm, status.axial_force_n);
  for (std::size_t i = 0; i < status.theta_rad.size(); ++i) {
    const float x = status.u_rad[i][0];
    const float y = status.u_rad[i][1];
    status.phi_rad[i] = std::atan2(y, x);
    status.theta_rad[i] = std::hypot(x, y);
    status.residual_twist_rad[i] = static_cast<float>(estimate.twist_rad[i]);
    status.residual_length_m[i] = static_cast<float>(estimate.length_error_m[i]);
  }
  status.pressure_bar = pressure_command.pressure_bar;
}

bool OutputMessages::set_observer(std::int64_t tick, const ControlPipeline& pipeline) noexcept {
  using Message = softarm_messages::observer_status_t;
  if (!pipeline.has_observer()) return false;
  pipeline.report(report_);
  const std::pair<bool, std::int16_t> flags[] = {{report_.running, Message::RUNNING},
                                                 {report_.surprised, Message::SURPRISED},
                                                 {report_.wrong_model, Message::WRONG_MODEL},
                                                 {report_.contact, Message::CONTACT},
                                                 {report_.pressure_loss, Message::PRESSURE_LOSS}};
  observer.tick = tick;
  observer.flags = 0;
  for (const auto& [set, flag] : flags)
    if (set) observer.flags = static_cast<std::int16_t>(observer.flags | flag);
  observer.failures = counter(report_.failures);
  observer.nis = static_cast<float>(report_.nis);
  for (Eigen::Index i = 0; i < 3; ++i) {
    observer.force_n[i] = static_cast<float>(report_.force_n[i]);
    for (Eigen::Index j = 0; j < 3; ++j)
      observer.force_covariance_n2[i][j] = static_cast<float>(report_.force_covariance_n2(i, j));
  }
  const auto put = [](const ModelCorrection& from, auto& stiffness, auto& damping, auto& gain,
                      auto& load, auto& disturbance_nm) {
    for (std::size_t i = 0; i < stiffness.size(); ++i) {
      stiffness[i] = static_cast<float>(from.segment[i].stiffness);
      damping[i] = static_cast<float>(from.segment[i].damping);
      gain[i] = static_cast<float>(from.segment[i].gain);
      load[i][0] = static_cast<float>(from.segment[i].load.x());
      load[i][1] = static_cast<float>(from.segment[i].load.y());
    }
    put_pairs(from.disturbance_nm, 2, disturbance_nm);
  };
  put(report_.correction, observer.stiffness, observer.damping, observer.gain, observer.load,
      observer.disturbance_nm);
  put(report_.deviation, observer.stiffness_deviation, observer.damping_deviation,
      observer.gain_deviation, observer.load_deviation, observer.disturbance_deviation_nm);
  put_axial(report_.elongation_m, report_.correction, observer.elongation_m, observer.axial_force_n,
            observer.axial_stiffness, observer.axial_damping, observer.axial_gain);
  put_axial(report_.elongation_deviation_m, report_.deviation, observer.elongation_deviation_m,
            observer.axial_force_deviation_n, observer.axial_stiffness_deviation,
            observer.axial_damping_deviation, observer.axial_gain_deviation);
  return true;
}

}  // namespace softarm
