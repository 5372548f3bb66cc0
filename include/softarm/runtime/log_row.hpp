// The logged quantities of one tick of an experiment.
#pragma once

#include <limits>
#include <optional>

#include "softarm/actuation/pressure_allocator.hpp"
#include "softarm/estimation/observer_report.hpp"
#include "softarm/model/arm.hpp"
#include "softarm/runtime/control_pipeline.hpp"
#include "softarm/runtime/safety_monitor.hpp"

namespace softarm {

/// One tick. A vector is empty where its quantity is not known; its cells then stay empty.
struct LogRow {
  double t_s = 0.0;
  Mode mode = Mode::init;
  Reason reason = Reason::none;
  bool saturated = false;
  double frame_age_s = std::numeric_limits<double>::quiet_NaN();
  SegmentVector u, velocity, reference, truth;      ///< 2n each, rad and rad/s
  SegmentVector tau_actuation;                      ///< 2n, N m
  SegmentVector residual_torsion, residual_length;  ///< n each, rad and m
  /// Of segments that stretch, n each, m and N: measured, asked, of the simulated arm, commanded.
  SegmentScalars elongation, elongation_reference, elongation_truth, axial_force;
  PressureVector commanded, real;                     ///< bar
  std::optional<Eigen::Vector3d> tip, tip_reference;  ///< m, world
  bool tip_is_asked =
      false;  ///< tip_reference is a path of the tip (22), not the model's tip at u_ref
  std::optional<ObserverReport> observer;  ///< where there is a model-based one
  Eigen::VectorXd coordinates;  ///< of the simulated arm's segments, pieces or joints, rad
};

/// The row of a pipeline's tick, without the quantities that only the simulated arm knows.
void fill_from_pipeline(const ControlPipeline& pipeline, const ArmParameters& arm, LogRow& row);

}  // namespace softarm
