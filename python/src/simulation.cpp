// softarm.Plant, SimulatedArm, advance and run.
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <limits>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "module.hpp"
#include "softarm/base/time.hpp"
#include "softarm/simulation/arm_plant.hpp"
#include "softarm/simulation/lock_step.hpp"
#include "softarm/simulation/simulated_arm.hpp"
#include "softarm/transport/arm_messages.hpp"

namespace softarm::python {
namespace {

using Eigen::VectorXd;

void reset(ArmPlant& plant, const VectorXd& u, const VectorXd& velocity, const VectorXd& pressure) {
  expect(u, 2 * plant.segments(), "u");
  expect(velocity, 2 * plant.segments(), "velocity");
  expect(pressure, plant.chambers(), "pressure_bar");
  plant.reset(u, velocity, std::span(pressure.data(), static_cast<std::size_t>(pressure.size())));
}

void advance(ArmPlant& plant, double duration_s, const VectorXd& command_bar) {
  if (!(duration_s > 0.0) || !std::isfinite(duration_s)) {
    throw std::invalid_argument("duration_s: expected a time > 0 in s");
  }
  expect(command_bar, plant.chambers(), "command_bar");
  plant.advance(plant.time_s() + duration_s,
                std::span(command_bar.data(), static_cast<std::size_t>(command_bar.size())));
}

/// Every plant on by `duration_s` with its row of commands, shared out to threads.
void advance_all(const std::vector<ArmPlant*>& plants, double duration_s,
                 const Eigen::Ref<const Eigen::MatrixXd>& commands_bar, int threads) {
  const auto count = static_cast<Eigen::Index>(plants.size());
  if (commands_bar.rows() != count) {
    throw std::invalid_argument(fmt::format("commands_bar: expected {} rows, one a plant, got {}",
                                            count, commands_bar.rows()));
  }
  std::vector<ArmPlant*> sorted = plants;
  std::sort(sorted.begin(), sorted.end());
  if (std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end()) {
    throw std::invalid_argument("plants: expected each one once");
  }
  const auto cores = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  const int workers =
      std::clamp(threads > 0 ? threads : cores, 1, std::max(1, static_cast<int>(count)));
  std::atomic<Eigen::Index> next = 0;
  std::mutex mutex;
  std::exception_ptr failure;
  const auto work = [&] {
    for (Eigen::Index i = next++; i < count; i = next++) {
      try {
        advance(*plants[static_cast<std::size_t>(i)], duration_s, commands_bar.row(i).transpose());
      } catch (...) {
        const std::lock_guard lock(mutex);
        if (!failure) failure = std::current_exception();
      }
    }
  };
  {
    std::vector<std::jthread> others;
    for (int k = 1; k < workers; ++k) others.emplace_back(work);
    work();
  }
  if (failure) std::rethrow_exception(failure);
}

/// Asks softarm.law.Answers.
class PythonLaw {
 public:
  explicit PythonLaw(const py::object& answers) : answers_(answers.ptr()) {}
  bool operator()(const TickOutput& output, LawInput& answer) {
    const py::gil_scoped_acquire acquire;
    LawRequest state;
    state.tick = ++ticks_;
    state.mode = output.mode;
    state.active_s = output.law->active_s;
    state.u_rad = output.law->u_rad;
    state.velocity_radps = output.law->velocity_radps;
    state.reference_u_rad = output.law->reference.u;
    state.reference_velocity_radps = output.law->reference.velocity;
    state.reference_acceleration_radps2 = output.law->reference.acceleration;
    state.pressure_bar = output.pressure_bar.cast<float>().cast<double>();  // as on the wire
    const auto given = py::reinterpret_borrow<py::object>(answers_)(state).cast<py::tuple>();
    answer.values = given[0].cast<VectorXd>();
    answer.answer = given[1].cast<bool>() ? LawAnswer::pressures : LawAnswer::force;
    answer.validity_ns = to_ns(std::clamp(given[2].cast<double>(), 0.0, 1e3));
    return true;
  }

 private:
  PyObject* answers_;  ///< the caller's: copies are made without the interpreter's lock
  std::int64_t ticks_ = 0;
};

/// The columns of log.csv that a program reads most, one row a tick.
py::dict run(const Experiment& asked, double duration_s, const py::object& law) {
  Experiment experiment = asked;
  if (!law.is_none()) experiment.control.law = ExternalLaw{};
  if (law.is_none() && experiment.control.law.get_if<ExternalLaw>() != nullptr) {
    throw std::invalid_argument("law: expected one, since control.law is external");
  }
  if (!(duration_s > 0.0) || !std::isfinite(duration_s)) {
    throw std::invalid_argument("duration_s: expected a time > 0 in s");
  }
  const int dof = 2 * experiment.arm.size();
  const auto ticks = static_cast<Eigen::Index>(std::llround(duration_s * experiment.rate_hz));
  const int chambers = chamber_count(experiment.actuation);
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const double unknown = std::numeric_limits<double>::quiet_NaN();
  VectorXd t(ticks);
  Rows u = Rows::Constant(ticks, dof, unknown), u_ref = u, truth = u;
  Rows commanded = Rows::Constant(ticks, chambers, unknown), measured = commanded;
  Rows tip = Rows::Constant(ticks, 3, unknown);
  std::vector<std::string> mode(static_cast<std::size_t>(ticks));
  py::object answers;
  if (!law.is_none()) {
    answers = py::module_::import("softarm.law").attr("Answers")(law, py::cast(asked));
  }
  {
    const py::gil_scoped_release release;
    const auto loop = std::make_unique<LockStep>(experiment, experiment.plant);
    if (!law.is_none()) loop->set_law(PythonLaw(answers));
    LogRow row;
    const auto put = [](const auto& from, auto to) {
      if (from.size() == to.size()) to = from.transpose();
    };
    for (Eigen::Index k = 0; k < ticks; ++k) {
      loop->step(row);
      t(k) = row.t_s;
      mode[static_cast<std::size_t>(k)] = name(row.mode);
      put(row.u, u.row(k));
      put(row.reference, u_ref.row(k));
      put(row.truth, truth.row(k));
      put(row.commanded, commanded.row(k));
      put(row.real, measured.row(k));
      if (row.tip) tip.row(k) = row.tip->transpose();
    }
  }
  py::dict log;
  log["t_s"] = t;
  log["mode"] = py::module_::import("numpy").attr("array")(mode);
  log["u"] = u;
  log["u_ref"] = u_ref;
  log["u_true"] = truth;
  log["command_bar"] = commanded;
  log["pressure_bar"] = measured;
  log["tip_m"] = tip;
  return log;
}

std::vector<MocapFrame> receive(SimulatedArm& arm) {
  std::vector<MocapFrame> frames;
  for (MocapFrame frame; arm.receive(frame);) frames.push_back(frame);
  return frames;
}

PressureVector pressures(const SimulatedArm& arm, const VectorXd& value) {
  return expect(value, arm.plant().chambers(), "pressure_bar");
}

}  // namespace

void bind_simulation(py::module_& module) {
  py::register_exception<PlantError>(module, "PlantError", PyExc_RuntimeError);
  const auto release = py::call_guard<py::gil_scoped_release>();

  py::class_<ArmPlant>(
      module, "Plant",
      "The simulated arm of an experiment behind its valves, with its true state.\n\n"
      "Starts at rest without pressure; the same calls give the same bits.")
      .def(py::init([](const Experiment& experiment) {
             return std::make_unique<ArmPlant>(experiment.plant);
           }),
           py::arg("experiment"))
      .def("reset", &reset, py::arg("u"), py::arg("velocity"), py::arg("pressure_bar"),
           "Put the arm into another state; the time stays.")
      .def("advance", &advance, py::arg("duration_s"), py::arg("command_bar"), release,
           "Integrate with a command (bar, one a chamber) held. Raises PlantError where the\n"
           "integrator fails.")
      .def_property_readonly("segments", &ArmPlant::segments)
      .def_property_readonly("chambers", &ArmPlant::chambers)
      .def_property_readonly("time_s", &ArmPlant::time_s)
      .def_property_readonly("u", [](const ArmPlant& plant) { return VectorXd(plant.u_rad()); })
      .def_property_readonly("velocity",
                             [](const ArmPlant& plant) { return VectorXd(plant.velocity_radps()); })
      .def_property_readonly(
          "elongation_m", [](const ArmPlant& plant) { return VectorXd(plant.elongation_m()); },
          "e of every segment, (n,); empty where segments do not stretch")
      .def_property_readonly(
          "elongation_rate_mps",
          [](const ArmPlant& plant) { return VectorXd(plant.elongation_rate_mps()); },
          "the same of e'")
      .def_property_readonly("pressure_bar",
                             [](const ArmPlant& plant) { return VectorXd(plant.pressures_bar()); })
      .def_property_readonly("tip_m", &ArmPlant::tip_m)
      .def_property_readonly("segment_poses", [](const ArmPlant& plant) {
        std::vector<Eigen::Isometry3d> ends(static_cast<std::size_t>(plant.segments()));
        plant.segment_ends(ends);
        return pose_array(ends);
      });

  module.def("advance", &advance_all, py::arg("plants"), py::arg("duration_s"),
             py::arg("commands_bar"), py::arg("threads") = 0, release,
             "Advance many plants at once, row i of commands_bar for plants[i], on worker threads\n"
             "(0: one a core). The result does not depend on their number.");

  py::class_<SimulatedArm>(module, "SimulatedArm",
                           "A plant with motion capture and valves that vent when commands expire.")
      .def(py::init([](const Experiment& experiment, std::int64_t start_ns) {
             return std::make_unique<SimulatedArm>(experiment.plant, start_ns);
           }),
           py::arg("experiment"), py::arg("start_ns") = 0)
      .def(
          "command",
          [](SimulatedArm& arm, const VectorXd& pressure_bar, double validity_s,
             std::int64_t now_ns) {
            if (!(validity_s > 0.0) || !std::isfinite(validity_s)) {
              throw std::invalid_argument("validity_s: expected a time > 0 in s");
            }
            if (now_ns < arm.time_ns()) throw std::invalid_argument("now_ns: this time has passed");
            const PressureVector command = pressures(arm, pressure_bar);
            arm.command(command, to_ns(validity_s), now_ns);
          },
          py::arg("pressure_bar"), py::arg("validity_s"), py::arg("now_ns"),
          "Set points (bar) that arrive at now_ns; the valves vent when validity_s has passed.")
      .def("advance_to", &SimulatedArm::advance_to, py::arg("now_ns"), release)
      .def("receive", &receive, "The frames that have arrived and were not fetched yet.")
      .def_property_readonly("time_ns", &SimulatedArm::time_ns)
      .def_property_readonly("vented", &SimulatedArm::vented)
      .def_property_readonly("plant", &SimulatedArm::plant,
                             py::return_value_policy::reference_internal);

  module.def("run", &run, py::arg("experiment"), py::arg("duration_s"), py::arg("law") = py::none(),
             "Run an experiment in lock step; a dict of arrays with one row a tick:\n"
             "t_s, mode, u, u_ref, u_true (rad), command_bar, pressure_bar, tip_m (world).\n"
             "law: a control law of one's own in place of the experiment's, see softarm.law.");
}

}  // namespace softarm::python
