// softarm.Controller, Allocator and ControlPipeline.
#include <fmt/format.h>

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "module.hpp"
#include "softarm/actuation/pressure_allocator.hpp"
#include "softarm/control/curvature_controller.hpp"
#include "softarm/runtime/control_pipeline.hpp"

namespace softarm::python {
namespace {

using Eigen::VectorXd;

/// (17) of an experiment, without its reference.
class Controller {
 public:
  explicit Controller(const Experiment& experiment)
      : dof_(experiment.arm.dof()), controller_(experiment.arm, experiment.control) {}

  py::object compute(const Vector& u, const Vector& velocity, const Vector& u_ref,
                     const Vector& velocity_ref, const Vector& acceleration_ref) {
    ReferenceWindow window;
    window.now.u = expect(u_ref, dof_, "u_ref");
    window.now.velocity = expect(velocity_ref, dof_, "velocity_ref");
    window.now.acceleration = expect(acceleration_ref, dof_, "acceleration_ref");
    controller_.compute(expect(u, dof_, "u"), expect(velocity, dof_, "velocity"), window, out_);
    Result tau(dof_);
    tau.vector = out_.tau_actuation_nm;
    return tau.array;
  }

 private:
  int dof_;
  CurvatureController controller_;
  ControlOutput out_;
};

MocapFrame make_frame(std::int64_t frame_number, std::int64_t capture_ns,
                      const Eigen::Ref<const Eigen::MatrixXd>& poses) {
  if (poses.cols() != 7 || poses.rows() < 2 || poses.rows() > kMaxBodies) {
    throw std::invalid_argument(fmt::format(
        "poses: expected a row [x, y, z, qw, qx, qy, qz] for the base and every segment's end, "
        "got {} x {}",
        poses.rows(), poses.cols()));
  }
  MocapFrame frame;
  frame.frame_number = frame_number;
  frame.capture_ns = capture_ns;
  frame.segments = static_cast<int>(poses.rows()) - 1;
  for (Eigen::Index i = 0; i < poses.rows(); ++i) {
    BodyPose& body = frame.body[static_cast<std::size_t>(i)];
    body.position_m = poses.row(i).head<3>().transpose();
    body.orientation = Eigen::Quaterniond(poses(i, 3), poses(i, 4), poses(i, 5), poses(i, 6));
    body.valid = poses.row(i).allFinite();
  }
  return frame;
}

Eigen::MatrixXd poses_of(const MocapFrame& frame) {
  Eigen::MatrixXd poses(frame.segments + 1, 7);
  for (Eigen::Index i = 0; i < poses.rows(); ++i) {
    const BodyPose& body = frame.body[static_cast<std::size_t>(i)];
    const Eigen::Quaterniond& q = body.orientation;
    poses.row(i) << body.position_m.transpose(), q.w(), q.x(), q.y(), q.z();
    if (!body.valid) poses.row(i).setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  return poses;
}

/// What one tick gave, apart from the pipeline, whose output the next one overwrites.
struct Tick {
  std::string mode, reason;
  bool armed = false, saturated = false, slew_limited = false;
  double frame_age_s = 0.0;
  VectorXd pressure_bar, u, velocity, u_ref, velocity_ref, tau_actuation_nm;
};

class Pipeline {
 public:
  explicit Pipeline(const Experiment& experiment) : pipeline_(experiment) {}

  Tick tick(std::int64_t now_ns, const std::vector<MocapFrame>& frames,
            const std::optional<VectorXd>& measured_bar, bool arm, bool disarm, bool emergency_stop,
            bool go) {
    if (now_ns <= previous_ns_) {
      throw std::invalid_argument("now_ns: expected a time after the tick before");
    }
    PressureVector measured;
    TickInput input;
    input.now_ns = now_ns;
    input.frames = frames;
    input.requests.arm = arm;
    input.requests.disarm = disarm;
    input.requests.emergency_stop = emergency_stop;
    if (measured_bar) {
      measured = expect(*measured_bar, pipeline_.output().pressure_bar.size(), "measured_bar");
      input.measured_bar = &measured;
      input.newest_measurement_ns = now_ns;
    }
    if (go) input.newest_go_ns = now_ns;
    const TickOutput& output = pipeline_.tick(input);
    previous_ns_ = now_ns;
    return {.mode = name(output.mode),
            .reason = name(output.reason),
            .armed = output.armed,
            .saturated = output.saturated,
            .slew_limited = output.slew_limited,
            .frame_age_s = output.frame_age_s,
            .pressure_bar = output.pressure_bar,
            .u = output.motion.u_rad,
            .velocity = output.motion.velocity_radps,
            .u_ref = output.reference.u,
            .velocity_ref = output.reference.velocity,
            .tau_actuation_nm = output.tau_actuation_nm};
  }
  std::int64_t period_ns() const { return pipeline_.period_ns(); }

 private:
  ControlPipeline pipeline_;
  std::int64_t previous_ns_ = -1;
};

void bind_allocator(py::module_& module) {
  py::class_<PressureAllocator>(module, "Allocator",
                                "From actuation torques to chamber pressures, and back.")
      .def(py::init([](const Experiment& experiment) {
             return std::make_unique<PressureAllocator>(experiment.actuation,
                                                        experiment.arm.extensible);
           }),
           py::arg("experiment"))
      .def_property_readonly("chambers", &PressureAllocator::chambers)
      .def(
          "allocate",
          [](const PressureAllocator& allocator, const VectorXd& tau) {
            Allocation allocation;
            allocator.allocate(expect(tau, allocator.dimension(), "tau_actuation_nm"), allocation);
            return py::make_tuple(VectorXd(allocation.pressures_bar), VectorXd(allocation.scale));
          },
          py::arg("tau_actuation_nm"),
          "Pressures (bar) nearest the bias that give s tau, and s of every segment: below 1 "
          "where\n"
          "the chambers cannot reach tau (2n, N m) within their limits. For a generalized force in "
          "u:\n"
          "allocate(solve(arm.actuation_matrix(u), force)).")
      .def(
          "generalized_force",
          [](const PressureAllocator& allocator, const VectorXd& pressures) {
            VectorXd force(allocator.dimension());
            allocator.generalized_force(expect(pressures, allocator.chambers(), "pressure_bar"),
                                        force);
            return force;
          },
          py::arg("pressure_bar"),
          "Generalized force in u that pressures give, (2n,), N m; where segments stretch (3n,).")
      .def_property_readonly(
          "input_matrix",
          [](const PressureAllocator& allocator) {
            const int chambers = allocator.chambers();
            Eigen::MatrixXd matrix(allocator.dimension(), chambers);
            VectorXd force(allocator.dimension());
            for (int j = 0; j < chambers; ++j) {
              allocator.generalized_force(VectorXd::Unit(chambers, j), force);
              matrix.col(j) = force;
            }
            return matrix;
          },
          "d generalized_force / d pressure, (2n, chambers), N m/bar: it does not depend on u.\n"
          "Where segments stretch (3n, chambers), every third row in N/bar.");
}

}  // namespace

void bind_control(py::module_& module) {
  bind_allocator(module);
  py::class_<Controller>(module, "Controller", "The controller (17) of an experiment.")
      .def(py::init<const Experiment&>(), py::arg("experiment"))
      .def("compute", &Controller::compute, py::arg("u"), py::arg("velocity"), py::arg("u_ref"),
           py::arg("velocity_ref"), py::arg("acceleration_ref"),
           "tau_A, (2n,), N m, from the state and the reference with its derivatives.");

  py::class_<MocapFrame>(module, "Frame", "One motion-capture frame.")
      .def(py::init(&make_frame), py::arg("frame_number"), py::arg("capture_ns"), py::arg("poses"),
           "poses: (n + 1, 7), base first, [x, y, z, qw, qx, qy, qz] in m; a row with NaN was not "
           "seen.")
      .def_readonly("frame_number", &MocapFrame::frame_number)
      .def_readonly("capture_ns", &MocapFrame::capture_ns)
      .def_property_readonly("poses", &poses_of);

  py::class_<Tick>(module, "Tick",
                   "What one tick saw, decided and commands; vectors are empty where unknown.")
      .def_readonly("mode", &Tick::mode)
      .def_readonly("reason", &Tick::reason)
      .def_readonly("armed", &Tick::armed)
      .def_readonly("saturated", &Tick::saturated)
      .def_readonly("slew_limited", &Tick::slew_limited)
      .def_readonly("frame_age_s", &Tick::frame_age_s)
      .def_readonly("pressure_bar", &Tick::pressure_bar)
      .def_readonly("u", &Tick::u)
      .def_readonly("velocity", &Tick::velocity)
      .def_readonly("u_ref", &Tick::u_ref)
      .def_readonly("velocity_ref", &Tick::velocity_ref)
      .def_readonly("tau_actuation_nm", &Tick::tau_actuation_nm);

  py::class_<Pipeline>(module, "ControlPipeline",
                       "The daemon's tick: validate, estimate, safety, (17), allocate, limit.")
      .def(py::init<const Experiment&>(), py::arg("experiment"))
      .def_property_readonly("period_ns", &Pipeline::period_ns)
      .def("tick", &Pipeline::tick, py::arg("now_ns"),
           py::arg("frames") = std::vector<MocapFrame>(), py::arg("measured_bar") = py::none(),
           py::arg("arm") = false, py::arg("disarm") = false, py::arg("emergency_stop") = false,
           py::arg("go") = false,
           "One tick at a time (ns, one monotonic clock, never going back) with the frames that "
           "came\n"
           "since the last one. arm, disarm, emergency_stop: an operator's requests; go: a "
           "dead-man's.");
}

}  // namespace softarm::python
