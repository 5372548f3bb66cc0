// softarm.LawState, and what softarm.law needs of the wire.
#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "module.hpp"
#include "softarm/transport/arm_messages.hpp"
#include "softarm/transport/message_decoding.hpp"

namespace softarm::python {
namespace {

using Eigen::VectorXd;

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

py::bytes encode_answer(const LawRequest& state, const VectorXd& values, bool pressures,
                        double validity_s) {
  softarm_messages::law_command_t message;
  message.sequence = state.tick;
  message.nonce = state.nonce;
  message.validity_us = static_cast<std::int32_t>(1e6 * std::clamp(validity_s, 0.0, 1e3));
  message.answer = pressures ? softarm_messages::law_command_t::PRESSURES
                             : softarm_messages::law_command_t::FORCE;
  message.num_values = static_cast<std::int16_t>(values.size());
  message.value.assign(values.begin(), values.end());
  std::string encoded(static_cast<std::size_t>(message.getEncodedSize()), '\0');
  message.encode(encoded.data(), 0, static_cast<int>(encoded.size()));
  return py::bytes(encoded);
}

}  // namespace

void bind_law(py::module_& module) {
  const auto vector = [](auto member) {
    return [member](const LawRequest& state) { return VectorXd(state.*member); };
  };
  py::class_<LawRequest>(
      module, "LawState",
      "What a control law of one's own is to answer, of the instant at which its answer acts. "
      "Unless\n"
      "ACTIVE, the reference rests where the arm is. Of segments that stretch (u_x, u_y, e) each:\n"
      "3n in place of 2n, every third number in m.")
      .def_readonly("tick", &LawRequest::tick)
      .def_property_readonly("mode", [](const LawRequest& s) { return name(s.mode); })
      .def_readonly("active_s", &LawRequest::active_s, "since the arm became ACTIVE, otherwise 0")
      .def_property_readonly("u", vector(&LawRequest::u_rad), "(2n,), rad")
      .def_property_readonly("velocity", vector(&LawRequest::velocity_radps), "(2n,), rad/s")
      .def_property_readonly("u_ref", vector(&LawRequest::reference_u_rad), "(2n,), rad")
      .def_property_readonly("velocity_ref", vector(&LawRequest::reference_velocity_radps),
                             "(2n,), rad/s")
      .def_property_readonly("acceleration_ref", vector(&LawRequest::reference_acceleration_radps2),
                             "(2n,), rad/s^2")
      .def_property_readonly(
          "pressure_bar", [](const LawRequest& s) { return VectorXd(s.pressure_bar); },
          "commanded, (chambers,), bar")
      .def("__repr__", [](const LawRequest& s) {
        return fmt::format("<softarm.LawState {} {:.3f} s>", name(s.mode), s.active_s);
      });
  module.def("_decode_law_state", [](const std::string& data) {
    LawRequest state;
    if (!decode(bytes_of(data), state)) throw std::invalid_argument("not a law_state_t");
    return state;
  });
  module.def("_encode_law_answer", &encode_answer);
}

}  // namespace softarm::python
