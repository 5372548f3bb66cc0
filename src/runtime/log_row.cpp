#include "softarm/runtime/log_row.hpp"

#include "softarm/model/coordinates.hpp"
#include "softarm/model/kinematics.hpp"

namespace softarm {

void fill_from_pipeline(const ControlPipeline& pipeline, const ArmParameters& arm, LogRow& row) {
  const TickOutput& output = pipeline.output();
  const CurvatureEstimate& estimate = pipeline.estimate();
  row.mode = output.mode;
  row.reason = output.reason;
  row.saturated = output.saturated;
  row.frame_age_s = output.frame_age_s;
  row.u = bend_part(arm, output.motion.u_rad);
  row.velocity = bend_part(arm, output.motion.velocity_radps);
  row.reference = bend_part(arm, output.reference.u);
  row.tau_actuation = bend_part(arm, output.tau_actuation_nm);
  row.elongation = stretch_part(arm, output.motion.u_rad);
  row.elongation_reference = stretch_part(arm, output.reference.u);
  row.axial_force = stretch_part(arm, output.tau_actuation_nm);
  row.residual_torsion = Eigen::Map<const Eigen::VectorXd>(estimate.twist_rad.data(), arm.size());
  row.residual_length =
      Eigen::Map<const Eigen::VectorXd>(estimate.length_error_m.data(), arm.size());
  row.commanded = output.pressure_bar;
  if (pipeline.has_observer()) {
    if (!row.observer) row.observer.emplace();
    pipeline.report(*row.observer);
  }
  row.tip_reference.reset();
  row.tip_is_asked = row.reference.size() > 0 && output.reference.has_tip;
  if (row.tip_is_asked) {
    row.tip_reference = output.reference.tip.position_m;
  } else if (row.reference.size() > 0) {
    row.tip_reference = tip_position(arm, output.reference.u);
  }
}

}  // namespace softarm
