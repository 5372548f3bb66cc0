// The top of the description, the arm and its chambers, sensing and control.
#include "config/schema.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace softarm {
namespace {

constexpr auto kRequired = Presence::required;
constexpr double kTwoPi = 6.283185307179586;
constexpr double kMany = 1e6;

/// One number of every segment, as a key of its own.
void per_segment(SchemaVisitor& visitor, const Field& field, ArmParameters& arm,
                 double SegmentParameters::*member) {
  std::vector<double> values;
  for (const auto& segment : arm.segments) values.push_back(segment.*member);
  visitor.numbers(field, {Shape::Kind::scalar_or_list, arm.size()}, values);
  for (std::size_t i = 0; i < values.size(); ++i) arm.segments[i].*member = values[i];
}

void describe_base(SchemaVisitor& visitor, ArmParameters& arm) {
  static const std::array<const char*, 2> kNames = {"hanging", "standing"};
  static const std::array<Eigen::Matrix3d, 2> kRotations = {
      Eigen::Matrix3d(Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal()), Eigen::Matrix3d::Identity()};
  visitor.vector3(
      {"position_m", "m", "origin of the base frame S_0 in the world", from_to(-1e3, 1e3)},
      arm.base_position_m);
  visitor.matrix_or_word(
      {"rotation", "",
       "of S_0 in the world: hanging diag(1, -1, -1), standing (identity), or a 3 x 3 matrix; the "
       "straight arm points along +z of S_0",
       from_to(-1.0, 1.0)},
      kNames, kRotations, arm.base_rotation);
}

void describe_run(SchemaVisitor& visitor, RunSettings& run) {
  visitor.number({"duration_s", "s", "of `softarm run` and the demo, where none is asked for",
                  above_to(0.0, kMany)},
                 run.duration_s);
  visitor.number({"tracking_from_s", "s", "after ACTIVE; tracking errors count from here on",
                  from_to(0.0, kMany)},
                 run.tracking_from_s);
  visitor.number({"log_rate_hz", "Hz",
                  "rows of log.csv, from which errors are taken; 0: every tick", from_to(0.0, 1e4)},
                 run.log_rate_hz);
}

void describe_identification(SchemaVisitor& visitor, IdentificationSettings& identification,
                             int segments) {
  visitor.numbers(
      {"steps_bar", "bar", "pressures of the steps, on every side in turn", above_to(0.0, 100.0)},
      {Shape::Kind::list, 0}, identification.steps_bar);
  visitor.number({"hold_s", "s", "from step to step", from_to(0.1, 100.0)}, identification.hold_s);
  visitor.number({"max_theta_rad", "rad", "a segment that bends farther ends the experiment",
                  above_to(0.0, kTwoPi)},
                 identification.max_theta_rad);
  visitor.number({"max_speed_radps", "rad/s", "a segment that moves faster ends the experiment",
                  above_to(0.0, 1e4)},
                 identification.max_speed_radps);
  identification.rest_u_rad.resize(static_cast<std::size_t>(2 * segments), 0.0);
  visitor.numbers({"rest_u_rad", "rad",
                   "where the springs rest, in predictions of a recorded motion; the controller "
                   "does not know it",
                   from_to(-kTwoPi, kTwoPi)},
                  {Shape::Kind::scalar_or_pairs, segments}, identification.rest_u_rad);
  visitor.number(
      {"cubic_nm_per_rad3", "N m/rad^3", "a spring that hardens, likewise", from_to(-1e4, 1e4)},
      identification.cubic_nm_per_rad3);
  visitor.number(
      {"lag_s", "s", "first order, from set point to pressure, likewise", from_to(0.0, 100.0)},
      identification.lag_s);
  visitor.number({"delay_s", "s", "from set point to frame, likewise", from_to(-1.0, 100.0)},
                 identification.delay_s);
}

void describe_chambers(SchemaVisitor& visitor, std::vector<Chamber>& chambers) {
  std::vector<double> angles;
  std::vector<double> gains;
  for (const Chamber& chamber : chambers) {
    angles.push_back(chamber.angle_rad);
    gains.push_back(chamber.gain_nm_per_bar);
  }
  const auto presence = chambers.empty() ? kRequired : Presence::optional;
  visitor.numbers({"angle_rad", "rad", "direction chi of every chamber about the segment's axis",
                   from_to(-kTwoPi, kTwoPi), presence},
                  {Shape::Kind::list, 0}, angles);
  gains.resize(angles.size(), gains.empty() ? 0.0 : gains.front());
  visitor.numbers({"gain_nm_per_bar", "N m/bar", "bending moment a bar, of all or of every chamber",
                   above_to(0.0, kMany), presence},
                  {Shape::Kind::scalar_or_list, static_cast<int>(angles.size())}, gains);
  chambers.resize(angles.size());
  for (std::size_t j = 0; j < angles.size(); ++j) chambers[j] = {angles[j], gains[j]};
}

}  // namespace

std::string Range::text() const {
  constexpr double kUnbounded = std::numeric_limits<double>::max();
  if (low == -kUnbounded && high == kUnbounded) return "";
  const auto bound = [](double value) {
    if (std::abs(value) == kTwoPi) return std::string(value < 0.0 ? "-2*pi" : "2*pi");
    return fmt::format("{}", value);
  };
  return fmt::format("in {}{}, {}]", above_low ? "(" : "[", bound(low), bound(high));
}

void describe_arm(SchemaVisitor& visitor, ArmParameters& arm) {
  static const std::array<const char*, 2> kMassModels = {"point", "distributed"};
  static const std::array<const char*, 2> kActuationModels = {"chamber", "couple"};
  const auto presence = arm.segments.front().length_m > 0.0 ? Presence::optional : kRequired;
  per_segment(visitor,
              {"length_m", "m", "of all segments, or a list", above_to(0.0, 10.0), presence}, arm,
              &SegmentParameters::length_m);
  per_segment(visitor,
              {"mass_kg", "kg", "of all segments, or a list", above_to(0.0, 100.0), presence}, arm,
              &SegmentParameters::mass_kg);
  per_segment(visitor,
              {"stiffness_nm_per_rad", "N m/rad", "bending stiffness k of (14)", from_to(0.0, 1e4),
               presence},
              arm, &SegmentParameters::stiffness_nm_per_rad);
  per_segment(visitor,
              {"damping_nms_per_rad", "N m s/rad", "bending damping beta of (14)",
               from_to(0.0, 1e3), presence},
              arm, &SegmentParameters::damping_nms_per_rad);
  per_segment(visitor,
              {"radius_m", "m",
               "of the round cross-section, for its rotary inertia; 0: left out, as in the paper",
               from_to(0.0, 1.0)},
              arm, &SegmentParameters::radius_m);
  visitor.choice({"mass_model", "",
                  "point: the paper's masses at the centres of mass; distributed: along the arc"},
                 kMassModels, arm.mass);
  visitor.choice(
      {"actuation_model", "",
       "chamber: body-following moments of chambers and tendons; couple: the paper's (15)"},
      kActuationModels, arm.actuation);
  visitor.section({"base", "", "where the arm is mounted"}, SectionKind::plain,
                  [&] { describe_base(visitor, arm); });
  visitor.vector3({"gravity_mps2", "m/s^2", "in the world frame", from_to(-100.0, 100.0)},
                  arm.gravity_mps2);
}

void describe_actuation(SchemaVisitor& visitor, ActuationSettings& actuation, int segments) {
  if (describe_actuation_kind(visitor, actuation, segments) == ActuationKind::torque) return;
  const bool given = !actuation.segments.empty();
  actuation.segments.resize(static_cast<std::size_t>(segments));
  const auto same = [](const Chamber& a, const Chamber& b) {
    return a.angle_rad == b.angle_rad && a.gain_nm_per_bar == b.gain_nm_per_bar;
  };
  const auto& first = actuation.segments.front();
  const bool all_equal =
      std::all_of(actuation.segments.begin(), actuation.segments.end(), [&](const auto& other) {
        return std::equal(first.begin(), first.end(), other.begin(), other.end(), same);
      });
  visitor.shared_or_list(
      {"chambers",
       "",
       "of all segments, or a list with those of every segment, base to tip",
       {},
       given ? Presence::optional : kRequired},
      segments, all_equal,
      [&](int i) { describe_chambers(visitor, actuation.segments[static_cast<std::size_t>(i)]); });
  visitor.number({"min_pressure_bar", "bar", "lowest commanded pressure", from_to(0.0, 100.0)},
                 actuation.min_pressure_bar);
  visitor.number({"max_pressure_bar", "bar", "highest commanded pressure", above_to(0.0, 100.0)},
                 actuation.max_pressure_bar);
  visitor.number({"bias_pressure_bar", "bar", "where pressures rest that no torque asks to move",
                  from_to(0.0, 100.0)},
                 actuation.bias_pressure_bar);
  visitor.number(
      {"slew_bar_per_s", "bar/s", "largest rate of a commanded pressure", above_to(0.0, kMany)},
      actuation.slew_bar_per_s);
  visitor.number({"vent_bar_per_s", "bar/s",
                  "rate of the ramp to zero; venting takes less than 1 s", above_to(0.0, kMany)},
                 actuation.vent_bar_per_s);
  visitor.optional_number(
      {"plane_rad", "rad", "a planar arm bends only in the plane at this phi (left out: any plane)",
       from_to(-kTwoPi, kTwoPi)},
      actuation.plane_rad);
}

void describe_observer(SchemaVisitor& visitor, EstimationSettings& estimation) {
  static const std::array<const char*, 2> kObservers = {"kinematic", "model"};
  visitor.choice({"observer", "",
                  "of u and u': kinematic (a filter on u alone) or model (a Kalman filter on (16), "
                  "with a disturbance and parameters)"},
                 kObservers, estimation.observer);
  ModelObserverSettings& model = estimation.model_observer;
  visitor.section({"model_observer", "", "of observer: model"}, SectionKind::plain, [&] {
    visitor.flag({"learn_parameters", "",
                  "stiffness, damping, gain and a horizontal load of every segment, on line"},
                 model.learn_parameters);
    visitor.number({"parameter_deviation", "",
                    "standard deviation of the parameters before anything was learnt, relative",
                    above_to(0.0, 1.0)},
                   model.parameter_deviation);
    visitor.number({"parameter_drift_per_sqrt_s", "1/s^0.5", "random walk of the parameters",
                    from_to(0.0, 1.0)},
                   model.parameter_drift_per_sqrt_s);
    visitor.number({"disturbance_drift_per_sqrt_s", "1/s^0.5",
                    "random walk of the disturbance over the torque that bends a segment by 1 rad, "
                    "at least",
                    above_to(0.0, 10.0)},
                   model.disturbance_drift_per_sqrt_s);
    visitor.number(
        {"largest_disturbance_drift_per_sqrt_s", "1/s^0.5",
         "the same, at most: it grows while the disturbance is seen to move", above_to(0.0, 10.0)},
        model.largest_disturbance_drift_per_sqrt_s);
  });
}

void describe_estimation(SchemaVisitor& visitor, EstimationSettings& estimation) {
  static const std::array<const char*, 3> kMethods = {"pose", "orientation", "printed"};
  visitor.choice({"method", "",
                  "pose: position and orientation; orientation: inertial sensors; printed: the "
                  "paper's (20), for comparison only"},
                 kMethods, estimation.method);
  visitor.number({"position_noise_m", "m", "standard deviation an axis of every measured body",
                  above_to(0.0, 1.0)},
                 estimation.position_noise_m);
  visitor.number({"orientation_noise_rad", "rad",
                  "standard deviation of the rotation vector an axis of every measured body",
                  above_to(0.0, 1.0)},
                 estimation.orientation_noise_rad);
  visitor.number(
      {"filter_bandwidth_radps", "rad/s", "of the velocity filter on u", above_to(0.0, 1e5)},
      estimation.filter_bandwidth_radps);
  visitor.integer(
      {"predicted_frames", "", "frames an occluded segment may be predicted for", from_to(0, 1000)},
      estimation.predicted_frames);
  describe_observer(visitor, estimation);
  visitor.number({"quaternion_tolerance", "", "a frame with ||q| - 1| above it is rejected",
                  above_to(0.0, 1.0)},
                 estimation.quaternion_tolerance);
  visitor.number(
      {"length_tolerance", "", "a frame with ||t| - chord| / L of a segment above it is rejected",
       above_to(0.0, 100.0)},
      estimation.length_tolerance);
  visitor.number({"max_speed_radps", "rad/s", "a frame in which u jumps faster is rejected",
                  above_to(0.0, kMany)},
                 estimation.max_speed_radps);
}

void describe_control(SchemaVisitor& visitor, ControllerSettings& control, int segments) {
  static const std::array<const char*, 2> kCoordinates = {"u", "polar"};
  visitor.choice({"coordinates", "", "of (17): u (smooth everywhere) or polar (the paper's)"},
                 kCoordinates, control.coordinates);
  visitor.section({"terms", "", "of (17); one that is left out costs nothing"}, SectionKind::plain,
                  [&] {
                    visitor.flag({"inertia", "", "B u''_ref"}, control.terms.inertia);
                    visitor.flag({"coriolis", "", "C(u, u') u'_ref"}, control.terms.coriolis);
                    visitor.flag({"gravity", "", "G"}, control.terms.gravity);
                    visitor.flag({"stiffness", "", "K u_ref"}, control.terms.stiffness);
                    visitor.flag({"damping", "", "D u'_ref"}, control.terms.damping);
                  });
  const Shape gains = {Shape::Kind::scalar_or_pairs, segments};
  visitor.numbers({"kp_nm_per_rad", "N m/rad",
                   "K_P: one for all, one a segment, or [x, y] a segment (polar: [phi, theta])",
                   from_to(0.0, 1e4), kRequired},
                  gains, control.kp);
  control.kd.resize(static_cast<std::size_t>(2 * segments), 0.0);
  visitor.numbers({"kd_nms_per_rad", "N m s/rad", "K_D, in the same forms", from_to(0.0, 1e3)},
                  gains, control.kd);
  control.ki.resize(static_cast<std::size_t>(2 * segments), 0.0);
  visitor.numbers({"ki_nm_per_rad_s", "N m/(rad s)",
                   "integral gain on u, in the same forms; not in the paper", from_to(0.0, 1e4)},
                  gains, control.ki);
  static const std::array<const char*, 3> kRejections = {"cancel", "model_only", "none"};
  visitor.choice({"disturbance", "",
                  "what the model observer found: cancel (parameters and disturbance), model_only "
                  "(parameters; the arm stays soft), none"},
                 kRejections, control.disturbance);
  visitor.number(
      {"valve_lag_s", "s", "first-order lag inverted on what depends on the reference alone",
       from_to(0.0, 5.0)},
      control.valve_lag_s);
  visitor.number(
      {"delay_s", "s", "dead time of valves and tubes, for the check of the gains at load time",
       from_to(0.0, 5.0)},
      control.delay_s);
  visitor.number(
      {"max_theta_rad", "rad", "soft limit on theta of reference and arm", above_to(0.0, kTwoPi)},
      control.max_theta_rad);
  visitor.number({"max_speed_radps", "rad/s", "soft limit on the reference's |u'| a segment",
                  above_to(0.0, 1e4)},
                 control.max_speed_radps);
  visitor.number({"max_step_rad", "rad", "a larger jump of a live reference is refused",
                  above_to(0.0, kTwoPi)},
                 control.max_step_rad);
  visitor.number({"blend_s", "s", "time in which a reference is joined from wherever the arm is",
                  above_to(0.0, 1e3)},
                 control.blend_s);
  visitor.number({"polar_theta_min_rad", "rad",
                  "bounds A^-1 and the phi error near theta = 0 in polar mode", above_to(0.0, 1.0)},
                 control.polar_theta_min_rad);
  TaskSpaceSettings& tip = control.task_space;
  visitor.section({"task_space", "", "references of the tip, by (21)"}, SectionKind::plain, [&] {
    visitor.number(
        {"lambda_1ps", "1/s", "both poles of the tip's error are at -lambda", above_to(0.0, 1e3)},
        tip.lambda_1ps);
    visitor.number(
        {"tip_bandwidth_radps", "rad/s",
         "of the filter on the measured tip minus the reference's own", above_to(0.0, 1e4)},
        tip.tip_bandwidth_radps);
    visitor.number({"posture_rate_1ps", "1/s",
                    "at which what does not move the tip drifts to less bend", from_to(0.0, 100.0)},
                   tip.posture_rate_1ps);
  });
}

void describe_experiment(SchemaVisitor& visitor, Experiment& experiment) {
  visitor.text({"name", "", "of the experiment, for logs and plots", from_to(1, 100), kRequired},
               experiment.name);
  auto seed = static_cast<std::int64_t>(experiment.seed);
  visitor.integer(
      {"seed", "", "of every random number of the simulated arm", from_to(0, 9007199254740992.0)},
      seed);
  experiment.seed = static_cast<std::uint64_t>(seed);

  ArmParameters& arm = experiment.arm;
  visitor.section({"arm", "", "what the controller believes about the arm", {}, kRequired},
                  SectionKind::plain, [&] {
                    int segments = std::max(1, arm.size());
                    visitor.integer(
                        {"segments", "", "how many", from_to(1, kMaxSegments), kRequired},
                        segments);
                    // A length of zero marks "not given yet", which makes the keys of the arm
                    // required.
                    arm.segments.resize(static_cast<std::size_t>(segments), {0.0, 0.0, 0.0, 0.0});
                    describe_arm(visitor, arm);
                  });
  const int n = arm.size();
  visitor.section({"actuation", "", "chambers and the limits of their valves", {}, kRequired},
                  SectionKind::plain,
                  [&] { describe_actuation(visitor, experiment.actuation, n); });
  visitor.section({"estimation", "", "from motion-capture frames to u"}, SectionKind::plain,
                  [&] { describe_estimation(visitor, experiment.estimation); });
  visitor.section({"control", "", "the controller (17)", {}, kRequired}, SectionKind::plain,
                  [&] { describe_control(visitor, experiment.control, n); });
  describe_reference(visitor, experiment.reference, n);
  visitor.section({"daemon", "", "rate, safety and connections of softarmd"}, SectionKind::plain,
                  [&] { describe_daemon(visitor, experiment, n); });
  int chambers = 0;
  for (const auto& segment : experiment.actuation.segments)
    chambers += static_cast<int>(segment.size());
  visitor.section({"valves", "", "the valve terminal that softarm-valves drives"},
                  SectionKind::plain,
                  [&] { describe_valves(visitor, experiment.valves, chambers); });
  visitor.section({"plant", "", "the simulated arm; left out: equal to the controller's"},
                  SectionKind::plain, [&] { describe_plant(visitor, experiment); });
  visitor.section({"run", "", "defaults of a simulated run"}, SectionKind::plain,
                  [&] { describe_run(visitor, experiment.run); });
  visitor.section({"identification", "", "the steps and the findings of `softarm identify`"},
                  SectionKind::plain,
                  [&] { describe_identification(visitor, experiment.identification, n); });
}

}  // namespace softarm
