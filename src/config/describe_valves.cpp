// The declarations of the valve terminal.
#include "config/describe.hpp"
#include "softarm/valves/register_map.hpp"

namespace softarm {

static void describe(Keys& key, RegisterMap& it) {
  const Form address = from(0, 65535), bits = from(0, 65535);
  const Form words = from(1, 125), place = from(0, 124);
  const Form place_or_none = place.or_word("none", -1);
  KEY(write_address, address, "of the first slot's set points, as the protocol counts");
  KEY(write_words, words, "of a slot");
  KEY(set_point_word, place, "in the slot, of its first valve");
  KEY(valves_per_slot, from(1, 64), "number of valves, their words adjacent");
  KEY(control_word, place_or_none, "in the slot, or none");
  KEY(control_value, bits, "written there in every cycle: regulate pressure");
  KEY(read_address, address, "of the first slot's measured pressures");
  KEY(read_words, words, "of a slot");
  KEY(actual_word, place, "in the slot, of its first valve");
  KEY(echo_word, place_or_none, "in the slot, set points as the terminal has them, or none");
  KEY(diagnosis_word, place_or_none, "in the slot, or none");
  KEY(diagnosis_mask, bits, "bits of the diagnosis that vent");
  KEY(status_word, place_or_none, "in the slot, or none");
  KEY(status_mask, bits, "bits of the status that count");
  KEY(status_ready, bits, "these bits of a slot that regulates");
  KEY(units_per_bar, above(0, 32767), "of set points and measured pressures");
  KEY(timeout_address, address.or_word("none", -1), "of the terminal's own fail-safe time-out");
  KEY(timeout_words, from(1, 2), "of it, low word first");
  KEY(timeout_unit_s, above(0, 60), "what it counts");
  KEY(timeout_least_s, from(0, 60), "the terminal takes no less");
}

void describe(Keys& key, ValveDriverSettings& it) {
  KEY(backend, from(1, 63), "what drives the valves: modbus, or the back end of another program");
  KEY(device, from(0, 255), "what a back end opens that is not on a network");
  KEY(host, from(7, 15), "IPv4 address of the terminal");
  KEY(port, from(1, 65535), "of Modbus TCP");
  KEY(unit_id, from(0, 255), "of the terminal behind the port");
  KEY(order, from(0, 65535).each(), "valve of every chamber, from 0; left out: 0, 1, 2, ...");
  KEY(terminal, one_of(kTerminalNames),
      "preset of the registers, none tested on hardware; free: a plain map");
  if (key.reading()) it.registers = register_preset(it.terminal);
  KEY(registers, "left out: those of the terminal", SectionKind::hint);
  KEY(rate_hz, from(1, 2000), "one block write and one block read each");
  KEY(response_timeout_s, from(1e-4, 1), "of one request, below one period");
  KEY(connect_timeout_s, from(1e-3, 0.5), "of one attempt to connect");
  KEY(tolerated_failures, from(0, 100), "cycles in a row without a good answer; one more vents");
  KEY(backoff_s, from(0.01, 60),
      "before connecting again, at least 1.5 failsafe_timeout_s; doubles with every failure");
  KEY(longest_backoff_s, from(0.01, 600), "what it grows to");
  KEY(failsafe_timeout_s, above(0, 1), "silence of ours after which the terminal itself vents");
  KEY(vented_bar, above(0, 0.3), "measured pressures up to this count as vented");
  KEY(stuck_bar, above(0, 100), "a pressure further from its set point than this ...");
  KEY(stuck_after_s, above(0, 5), "... for so long belongs to a stuck valve");
  KEY(stuck_vents, "a stuck valve vents the arm; false: it is only reported");
}

}  // namespace softarm
