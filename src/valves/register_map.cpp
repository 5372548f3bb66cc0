#include "softarm/valves/register_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace softarm {
namespace {

constexpr double kLargestWord = 32767.0;  // a terminal may take words as signed
constexpr int kAddresses = 65536;

std::size_t word_of(int slot, int words, int word) {
  return static_cast<std::size_t>(slot * words + word);
}

struct Place {
  int slot;
  int offset;
};
Place place_of(const RegisterMap& map, int valve) {
  return {valve / map.valves_per_slot, valve % map.valves_per_slot};
}

RegisterMap cpx() {
  RegisterMap map;
  map.timeout_address = 46100;
  map.timeout_least_s = 0.1;
  return map;
}

}  // namespace

RegisterMap register_preset(TerminalKind kind) {
  RegisterMap map = cpx();
  switch (kind) {
    case TerminalKind::cpx_vppm:  // two words of the node itself come before its outputs, three
                                  // before its inputs
      map.write_address = 40001 + 2;
      map.read_address = 45392 + 3;
      map.read_words = 3;
      map.echo_word = 1;
      map.diagnosis_word = 2;
      return map;
    case TerminalKind::cpx_vtem:
      map.write_address = 40001 + 2;
      map.write_words = 3;
      map.set_point_word = 1;
      map.valves_per_slot = 2;
      map.control_word = 0;
      map.control_value = 3 | 3 << 6;  // motion app 3, both valves active
      map.read_address = 45392 + 3;
      map.read_words = 3;
      map.actual_word = 1;
      map.status_word = 0;
      map.status_ready = 3 | 2 << 6;  // motion app 3, running
      return map;
    case TerminalKind::cpx_e:
      map.write_address = 40001;
      map.read_address = 45392;
      return map;
    case TerminalKind::cpx_ap:
      map.write_address = 0;
      map.read_address = 5000;
      map.timeout_address = 14000;
      map.timeout_words = 2;
      return map;
    case TerminalKind::free:
      break;
  }
  RegisterMap plain;
  plain.read_address = 1000;
  return plain;
}

int slot_count(const RegisterMap& map, std::span<const int> order) noexcept {
  int last = -1;
  for (const int valve : order) last = std::max(last, valve);
  return last < 0 ? 0 : last / map.valves_per_slot + 1;
}
int write_size(const RegisterMap& map, std::span<const int> order) noexcept {
  return map.write_words * slot_count(map, order);
}
int read_size(const RegisterMap& map, std::span<const int> order) noexcept {
  return map.read_words * slot_count(map, order);
}

std::string register_map_fault(const RegisterMap& map, std::span<const int> order, double max_bar) {
  const int n = map.valves_per_slot;
  if (map.set_point_word + n > map.write_words || map.control_word >= map.write_words)
    return fmt::format("a slot of {} written words, too few for what it is to hold",
                       map.write_words);
  if (map.control_word >= map.set_point_word && map.control_word < map.set_point_word + n)
    return "a control word where set points are";
  if (map.actual_word + n > map.read_words ||
      (map.echo_word >= 0 && map.echo_word + n > map.read_words) ||
      map.diagnosis_word >= map.read_words || map.status_word >= map.read_words)
    return fmt::format("a slot of {} read words, too few for what it is to hold", map.read_words);
  struct Block {
    int first, size;
  };
  const Block blocks[] = {{map.write_address, write_size(map, order)},
                          {map.read_address, read_size(map, order)},
                          {map.timeout_address, map.timeout_words}};
  if (map.timeout_address < 0)
    return "no timeout_address: without the terminal's own time-out the arm would keep its "
           "pressure when the driver dies";
  for (const Block& block : blocks) {
    if (block.first + block.size > kAddresses)
      return fmt::format("registers up to {}, beyond 65535", block.first + block.size - 1);
    for (const Block& other : blocks) {
      if (&other != &block && block.first < other.first + other.size &&
          other.first < block.first + block.size)
        return fmt::format("blocks that overlap at {}", std::max(block.first, other.first));
    }
  }
  if (max_bar * map.units_per_bar > kLargestWord)
    return fmt::format("{} units/bar: {} bar does not fit a word (32767)", map.units_per_bar,
                       max_bar);
  return "";
}

std::uint16_t set_point_register(const RegisterMap& map, double bar, double max_bar) noexcept {
  if (!(bar > 0.0)) return 0;  // NaN, too
  if (!(max_bar > 0.0)) return 0;
  const double units = std::round(std::min(bar, max_bar) * map.units_per_bar);
  return static_cast<std::uint16_t>(std::min(units, kLargestWord));
}

double register_pressure_bar(const RegisterMap& map, std::uint16_t word) noexcept {
  return static_cast<double>(static_cast<std::int16_t>(word)) / map.units_per_bar;
}

void put_set_points(const RegisterMap& map, std::span<const int> order,
                    const Eigen::VectorXd& set_points_bar, double max_bar,
                    std::span<std::uint16_t> words) noexcept {
  std::fill(words.begin(), words.end(), std::uint16_t{0});
  const int slots = slot_count(map, order);
  for (int slot = 0; slot < slots && map.control_word >= 0; ++slot)
    words[word_of(slot, map.write_words, map.control_word)] =
        static_cast<std::uint16_t>(map.control_value);
  for (std::size_t i = 0; i < order.size(); ++i) {
    const Place place = place_of(map, order[i]);
    words[word_of(place.slot, map.write_words, map.set_point_word + place.offset)] =
        set_point_register(map, set_points_bar[static_cast<Eigen::Index>(i)], max_bar);
  }
}

void take_read_back(const RegisterMap& map, std::span<const int> order,
                    std::span<const std::uint16_t> words, ReadBack& read_back) noexcept {
  read_back.ready = true;
  read_back.has_echo = map.echo_word >= 0;
  read_back.resolution_bar = 1.0 / map.units_per_bar;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const Place place = place_of(map, order[i]);
    const auto word = [&](int k) { return words[word_of(place.slot, map.read_words, k)]; };
    const auto at = static_cast<Eigen::Index>(i);
    read_back.actual_bar[at] = register_pressure_bar(map, word(map.actual_word + place.offset));
    if (read_back.has_echo)
      read_back.echo_bar[at] = register_pressure_bar(map, word(map.echo_word + place.offset));
    if (map.diagnosis_word >= 0)
      read_back.diagnosis[i] =
          static_cast<std::uint16_t>(word(map.diagnosis_word) & map.diagnosis_mask);
    if (map.status_word >= 0 && (word(map.status_word) & map.status_mask) != map.status_ready)
      read_back.ready = false;
  }
}

void put_timeout(const RegisterMap& map, double timeout_s,
                 std::span<std::uint16_t, 2> words) noexcept {
  const double largest = map.timeout_words == 2 ? 4294967295.0 : 65535.0;
  const auto units = static_cast<std::uint32_t>(
      std::clamp(std::round(timeout_s / map.timeout_unit_s), 0.0, largest));
  words[0] = static_cast<std::uint16_t>(units & 0xffff);
  words[1] = static_cast<std::uint16_t>(units >> 16);
}

double timeout_s_of(const RegisterMap& map, std::span<const std::uint16_t, 2> words) noexcept {
  const std::uint32_t high = map.timeout_words == 2 ? words[1] : 0U;
  return map.timeout_unit_s * static_cast<double>(high << 16 | words[0]);
}

}  // namespace softarm
