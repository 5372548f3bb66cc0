// softarm.ArmClient: a running arm, real or simulated.
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "module.hpp"
#include "softarm/client/arm_client.hpp"

namespace softarm::python {
namespace {

using Eigen::VectorXd;

OperatorRequest request_named(const std::string& name) {
  if (name == "arm") return OperatorRequest::arm;
  if (name == "disarm") return OperatorRequest::disarm;
  if (name == "emergency_stop") return OperatorRequest::emergency_stop;
  throw std::invalid_argument("request: expected 'arm', 'disarm' or 'emergency_stop', got '" +
                              name + "'");
}

const char* outcome_name(RequestOutcome outcome) {
  switch (outcome) {
    case RequestOutcome::done:
      return "done";
    case RequestOutcome::refused:
      return "refused";
    case RequestOutcome::unheard:
      break;
  }
  return "unheard";
}

/// Of those that are not zero.
template <class Verdict, class Counts>
py::dict counts_by_name(const Counts& counts) {
  py::dict named;
  for (std::size_t k = 0; k < counts.size(); ++k)
    if (counts[k] > 0) named[name(static_cast<Verdict>(k))] = counts[k];
  return named;
}

PressureVector chambers(const ArmClient& arm, const VectorXd& value) {
  return expect(value, chamber_count(arm.experiment().actuation), "pressure_bar");
}

void bind_messages(py::module_& module) {
  py::class_<ArmStatus>(module, "Status",
                        "What the daemon measured, decided and commanded in one tick.")
      .def_readonly("time_us", &ArmStatus::time_us)
      .def_readonly("tick", &ArmStatus::tick)
      .def_property_readonly("mode", [](const ArmStatus& s) { return name(s.mode); })
      .def_property_readonly("reason", [](const ArmStatus& s) { return name(s.reason); })
      .def_readonly("armed", &ArmStatus::armed)
      .def_readonly("saturated", &ArmStatus::saturated)
      .def_readonly("slew_limited", &ArmStatus::slew_limited)
      .def_readonly("reference_limited", &ArmStatus::reference_limited)
      .def_readonly("soft_limit", &ArmStatus::soft_limit)
      .def_readonly("frame_age_s", &ArmStatus::frame_age_s)
      .def_readonly("frames_rejected", &ArmStatus::frames_rejected)
      .def_property_readonly(
          "references_refused",
          [](const ArmStatus& s) { return counts_by_name<LiveVerdict>(s.references_refused); },
          "live references and targets of the tip that were refused, by reason")
      .def_property_readonly(
          "law_answers",
          [](const ArmStatus& s) { return counts_by_name<LawVerdict>(s.law_answers); },
          "answers of an external law, by what became of them")
      .def_readonly("law_round_trip_s", &ArmStatus::law_round_trip_s)
      .def_property_readonly("u", [](const ArmStatus& s) { return VectorXd(s.u_rad); })
      .def_property_readonly("velocity",
                             [](const ArmStatus& s) { return VectorXd(s.velocity_radps); })
      .def_property_readonly(
          "u_ref", [](const ArmStatus& s) { return VectorXd(s.reference_u_rad); },
          "NaN unless ACTIVE")
      .def_property_readonly(
          "elongation_m", [](const ArmStatus& s) { return VectorXd(s.elongation_m); },
          "e of every segment, (n,); empty where segments do not stretch")
      .def_property_readonly(
          "elongation_ref_m", [](const ArmStatus& s) { return VectorXd(s.reference_elongation_m); },
          "the same of the reference, NaN unless ACTIVE")
      .def_property_readonly(
          "tau_actuation_nm", [](const ArmStatus& s) { return VectorXd(s.tau_actuation_nm); },
          "NaN unless ACTIVE")
      .def_property_readonly(
          "pressure_bar", [](const ArmStatus& s) { return VectorXd(s.pressure_bar); }, "commanded")
      .def("__repr__",
           [](const ArmStatus& s) { return fmt::format("<softarm.Status {}>", s.text()); });
  py::class_<PlantState>(module, "PlantState", "The true state of a simulated arm.")
      .def_readonly("time_us", &PlantState::time_us)
      .def_readonly("vented", &PlantState::vented)
      .def_property_readonly("u", [](const PlantState& s) { return VectorXd(s.u_rad); })
      .def_property_readonly("velocity",
                             [](const PlantState& s) { return VectorXd(s.velocity_radps); })
      .def_property_readonly(
          "elongation_m", [](const PlantState& s) { return VectorXd(s.elongation_m); },
          "e of every segment, (n,); empty where segments do not stretch")
      .def_property_readonly("pressure_bar",
                             [](const PlantState& s) { return VectorXd(s.pressure_bar); })
      .def_readonly("tip_m", &PlantState::tip_m);
}

}  // namespace

void bind_client(py::module_& module) {
  bind_messages(module);
  py::register_exception<TransportError>(module, "TransportError", PyExc_RuntimeError);
  const auto release = py::call_guard<py::gil_scoped_release>();
  py::class_<ArmClient>(
      module, "ArmClient",
      "A running arm, real or simulated: status, requests, references, chamber commands.\n\n"
      "Messages are handled in update, wait_for_status and request only. For one thread at a time.")
      .def(py::init([](const Experiment& experiment) {
             return std::make_unique<ArmClient>(experiment);
           }),
           py::arg("experiment"))
      .def(
          "update",
          [](ArmClient& arm, double patience_s) {
            return arm.update(arm.now_ns() + to_ns(patience_s));
          },
          py::arg("patience_s") = 0.0, release,
          "Wait for a message for at most patience_s and handle all that have arrived; whether any "
          "did.")
      .def("wait_for_status", &ArmClient::wait_for_status, py::arg("patience_s"), release,
           "Handle messages until the next status; False if none comes within patience_s.")
      .def(
          "request",
          [](ArmClient& arm, const std::string& what, double patience_s) {
            return std::string(outcome_name(arm.request(request_named(what), patience_s)));
          },
          py::arg("what"), py::arg("patience_s") = 2.0, release,
          "'arm', 'disarm' or 'emergency_stop', until a status shows it: 'done', 'refused' (the\n"
          "daemon reports otherwise) or 'unheard' (no daemon reports).")
      .def("send_go", &ArmClient::send_go, py::arg("go"), "The dead-man input, held or released.")
      .def(
          "send_reference",
          [](ArmClient& arm, const VectorXd& u, const VectorXd& velocity,
             const VectorXd& acceleration) {
            const Eigen::Index dof = 2 * arm.experiment().arm.size();
            arm.send_reference(expect(u, dof, "u"), expect(velocity, dof, "velocity"),
                               expect(acceleration, dof, "acceleration"));
          },
          py::arg("u"), py::arg("velocity"), py::arg("acceleration"),
          "u, u', u'' (2n each; rad, rad/s, rad/s^2) for a daemon whose phase is `live`.")
      .def(
          "send_tip_target",
          [](ArmClient& arm, const Eigen::Vector3d& position, const Eigen::Vector3d& velocity) {
            arm.send_tip_target(position, velocity);
          },
          py::arg("position_m"), py::arg("velocity_mps") = Eigen::Vector3d(0.0, 0.0, 0.0),
          "A target of the tip in the world (m, m/s) for a daemon whose phase is `live_tip`.")
      .def(
          "wait_for_law_state",
          [](ArmClient& arm, double patience_s) -> std::optional<LawRequest> {
            const std::int64_t before = arm.law_request() ? arm.law_request()->tick : -1;
            const auto newer = [&] {
              return arm.law_request() && arm.law_request()->tick != before;
            };
            if (!arm.wait_for(newer, patience_s)) return std::nullopt;
            return arm.law_request();
          },
          py::arg("patience_s"), release,
          "The next state that a law of one's own is to answer; None if none comes.")
      .def(
          "answer_law",
          [](ArmClient& arm, const LawRequest& state, const VectorXd& values, bool pressures,
             double validity_s) {
            pressures ? arm.answer_pressures(state, values, validity_s)
                      : arm.answer_force(state, values, validity_s);
          },
          py::arg("state"), py::arg("values"), py::arg("pressures") = false,
          py::arg("validity_s") = 0.05,
          "Answer it by a generalized force (as long as u; N m, along e N) or by pressures (bar, "
          "one a\n"
          "chamber), valid for validity_s from the state on.")
      .def("lock_commands", &ArmClient::lock_commands,
           "Take softarmd's place on this machine. RuntimeError while another program has it.")
      .def(
          "command_chambers",
          [](ArmClient& arm, const VectorXd& pressure_bar) {
            arm.command_chambers(chambers(arm, pressure_bar));
          },
          py::arg("pressure_bar"),
          "Move the set points towards these (bar, one a chamber) within the experiment's limits "
          "and\n"
          "send them when due. The valves vent by themselves when calls stop.")
      .def("vent_to_rest", &ArmClient::vent_to_rest, release, "Vent completely; blocks.")
      .def("record", &ArmClient::record, py::arg("log"),
           "Write every message to an LCM event log from now on.")
      .def("stop_recording", &ArmClient::stop_recording)
      .def_property_readonly("status", [](const ArmClient& arm) { return arm.status(); })
      .def_property_readonly("plant", [](const ArmClient& arm) { return arm.plant(); })
      .def_property_readonly(
          "measured_bar",
          [](const ArmClient& arm) -> std::optional<VectorXd> {
            if (!arm.measured()) return std::nullopt;
            return VectorXd(arm.measured()->bar);
          },
          "pressures measured by the valves, bar; None before the first")
      .def_property_readonly(
          "seen_u", [](const ArmClient& arm) { return VectorXd(arm.seen().u_rad); },
          "u in the newest motion-capture frame that showed every segment; empty before the first")
      .def_property_readonly("other_commander", &ArmClient::other_commander);
}

}  // namespace softarm::python
