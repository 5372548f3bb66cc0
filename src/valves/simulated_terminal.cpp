#include "softarm/valves/simulated_terminal.hpp"

#include <array>
#include <cmath>
#include <utility>

#include "softarm/valves/register_map.hpp"

namespace softarm {
namespace {

bool within(int address, int count, int first, int size) noexcept {
  return address >= first && address + count <= first + size;
}

}  // namespace

SimulatedTerminal::SimulatedTerminal(const RegisterMap& map, std::vector<int> order)
    : map_(map),
      order_(std::move(order)),
      registers_(65536, 0),
      set_points_bar_(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(order_.size()))) {
  measure(set_points_bar_);
}

bool SimulatedTerminal::writable(int address, int count) const noexcept {
  return within(address, count, map_.write_address, write_size(map_, order_)) ||
         within(address, count, map_.timeout_address, map_.timeout_words);
}

bool SimulatedTerminal::readable(int address, int count) const noexcept {
  return writable(address, count) ||
         within(address, count, map_.read_address, read_size(map_, order_));
}

void SimulatedTerminal::served(int, int count) noexcept { written_ |= count > 0; }

bool SimulatedTerminal::take_written() noexcept { return std::exchange(written_, false); }

void SimulatedTerminal::measure(const Eigen::VectorXd& actual_bar) noexcept {
  for (std::size_t i = 0; i < order_.size(); ++i) {
    const int slot = order_[i] / map_.valves_per_slot;
    const int offset = order_[i] % map_.valves_per_slot;
    const int in = map_.read_address + slot * map_.read_words;
    const int out = map_.write_address + slot * map_.write_words;
    const double units = actual_bar[static_cast<Eigen::Index>(i)] * map_.units_per_bar;
    word(in + map_.actual_word + offset) =
        static_cast<std::uint16_t>(static_cast<std::int16_t>(std::lround(units)));
    if (map_.echo_word >= 0)
      word(in + map_.echo_word + offset) = word(out + map_.set_point_word + offset);
    if (map_.status_word >= 0) {
      const bool regulates =
          map_.control_word < 0 || word(out + map_.control_word) == map_.control_value;
      word(in + map_.status_word) = static_cast<std::uint16_t>(regulates ? map_.status_ready : 0);
    }
  }
}

const Eigen::VectorXd& SimulatedTerminal::set_points_bar() noexcept {
  for (std::size_t i = 0; i < order_.size(); ++i) {
    const int out = map_.write_address + order_[i] / map_.valves_per_slot * map_.write_words;
    const auto set = static_cast<std::int16_t>(
        word(out + map_.set_point_word + order_[i] % map_.valves_per_slot));
    const bool regulates =
        map_.control_word < 0 || word(out + map_.control_word) == map_.control_value;
    double& bar = set_points_bar_[static_cast<Eigen::Index>(i)];
    bar = set < 0 ? kWideOpen_bar : static_cast<double>(set) / map_.units_per_bar;
    if (!regulates) bar = 0.0;
  }
  return set_points_bar_;
}

double SimulatedTerminal::timeout_s() const noexcept {
  const auto at = static_cast<std::size_t>(map_.timeout_address);
  const std::array<std::uint16_t, 2> words = {
      registers_[at], map_.timeout_words == 2 ? registers_[at + 1] : std::uint16_t{0}};
  return timeout_s_of(map_, words);
}

void SimulatedTerminal::reset_outputs() noexcept {
  for (int i = 0; i < write_size(map_, order_); ++i) word(map_.write_address + i) = 0;
}

}  // namespace softarm
