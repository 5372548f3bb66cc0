// The description of the valve terminal.
#include <numeric>

#include "config/schema.hpp"
#include "softarm/valves/register_map.hpp"

namespace softarm {
namespace {

constexpr double kLastAddress = 65535.0;

void describe_registers(SchemaVisitor& visitor, RegisterMap& map) {
  const Range address = from_to(0.0, kLastAddress);
  const Range words = from_to(1.0, 125.0);
  const Range place = from_to(0.0, 124.0);
  const Range bits = from_to(0.0, 65535.0);
  const auto optional_place = [&](const char* key, const char* doc, const Range& range,
                                  int& value) {
    std::int64_t wide = value;
    visitor.integer_or_word({key, "", doc, range}, "none", wide);
    value = static_cast<int>(wide);
  };
  visitor.integer(
      {"write_address", "", "of the first slot's set points, as the protocol counts", address},
      map.write_address);
  visitor.integer({"write_words", "", "of a slot", words}, map.write_words);
  visitor.integer({"set_point_word", "", "in the slot, of its first valve", place},
                  map.set_point_word);
  visitor.integer({"valves_per_slot", "", "whose words stand side by side", from_to(1.0, 64.0)},
                  map.valves_per_slot);
  optional_place("control_word", "in the slot, or none", place, map.control_word);
  visitor.integer({"control_value", "", "written there in every cycle", bits}, map.control_value);
  visitor.integer({"read_address", "", "of the first slot's measured pressures", address},
                  map.read_address);
  visitor.integer({"read_words", "", "of a slot", words}, map.read_words);
  visitor.integer({"actual_word", "", "in the slot, of its first valve", place}, map.actual_word);
  optional_place("echo_word", "in the slot, set points as the terminal has them, or none", place,
                 map.echo_word);
  optional_place("diagnosis_word", "in the slot, or none", place, map.diagnosis_word);
  visitor.integer({"diagnosis_mask", "", "bits of the diagnosis that vent", bits},
                  map.diagnosis_mask);
  optional_place("status_word", "in the slot, or none", place, map.status_word);
  visitor.integer({"status_mask", "", "bits of the status that count", bits}, map.status_mask);
  visitor.integer({"status_ready", "", "these bits of a slot that regulates", bits},
                  map.status_ready);
  visitor.number(
      {"units_per_bar", "1/bar", "of set points and measured pressures", above_to(0.0, 32767.0)},
      map.units_per_bar);
  optional_place("timeout_address", "of the terminal's own fail-safe time-out", address,
                 map.timeout_address);
  visitor.integer({"timeout_words", "", "of it, low word first", from_to(1.0, 2.0)},
                  map.timeout_words);
  visitor.number({"timeout_unit_s", "s", "what it counts", above_to(0.0, 60.0)},
                 map.timeout_unit_s);
  visitor.number({"timeout_least_s", "s", "the terminal takes no less", from_to(0.0, 60.0)},
                 map.timeout_least_s);
}

void describe_stuck_valves(SchemaVisitor& visitor, ValveDriverSettings& valves) {
  visitor.number({"stuck_bar", "bar", "a pressure further from its set point than this ...",
                  above_to(0.0, 100.0)},
                 valves.stuck_bar);
  visitor.number(
      {"stuck_after_s", "s", "... for so long belongs to a stuck valve", above_to(0.0, 100.0)},
      valves.stuck_after_s);
  visitor.flag({"stuck_vents", "", "a stuck valve vents the arm; false: it is only reported"},
               valves.stuck_vents);
}

}  // namespace

void describe_valves(SchemaVisitor& visitor, ValveDriverSettings& valves, int chambers) {
  visitor.text({"backend", "", "what drives the valves: modbus, or the back end of another program",
                from_to(1, 63)},
               valves.backend);
  visitor.text({"device", "", "what a back end opens that is not on a network", from_to(0, 255)},
               valves.device);
  visitor.text({"host", "", "IPv4 address of the terminal", from_to(7, 15)}, valves.host);
  visitor.integer({"port", "", "of Modbus TCP", from_to(1, 65535)}, valves.port);
  visitor.integer({"unit_id", "", "of the terminal behind the port", from_to(0, 255)},
                  valves.unit_id);
  if (valves.order.empty()) {
    valves.order.resize(static_cast<std::size_t>(chambers));
    std::iota(valves.order.begin(), valves.order.end(), 0);
  }
  visitor.integers(
      {"order", "", "the valve of every chamber, from 0, segment by segment", from_to(0, 65535)},
      chambers, valves.order);
  visitor.choice(
      {"terminal", "",
       "whose registers are meant; none of them was tried on hardware; free: a plain map"},
      kTerminalNames, valves.terminal);
  if (visitor.reading()) valves.registers = register_preset(valves.terminal);
  visitor.section({"registers", "", "where they are; left out: those of the terminal"},
                  SectionKind::defaults_by_choice,
                  [&] { describe_registers(visitor, valves.registers); });
  visitor.number({"rate_hz", "Hz", "one block write and one block read each", from_to(1.0, 2000.0)},
                 valves.rate_hz);
  visitor.number(
      {"response_timeout_s", "s", "of one request, below one period", from_to(1e-4, 1.0)},
      valves.response_timeout_s);
  visitor.number({"connect_timeout_s", "s", "of one attempt to connect", from_to(1e-3, 0.5)},
                 valves.connect_timeout_s);
  visitor.integer({"tolerated_failures", "",
                   "cycles in a row without a good answer; one more vents", from_to(0, 100)},
                  valves.tolerated_failures);
  visitor.number({"backoff_s", "s", "before connecting again; doubles with every failure",
                  from_to(0.01, 60.0)},
                 valves.backoff_s);
  visitor.number({"longest_backoff_s", "s", "what it grows to", from_to(0.01, 600.0)},
                 valves.longest_backoff_s);
  visitor.number({"failsafe_timeout_s", "s",
                  "set in the terminal and read back: it vents when we fall silent for so long",
                  above_to(0.0, 10.0)},
                 valves.failsafe_timeout_s);
  describe_stuck_valves(visitor, valves);
}

}  // namespace softarm
