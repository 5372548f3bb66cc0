// Pressures <-> words of a terminal's registers. Pure functions that neither allocate nor throw
// unless stated.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>

#include "softarm/valves/settings.hpp"
#include "softarm/valves/valve_backend.hpp"

namespace softarm {

/// The registers of a known terminal (not tested on hardware); `free` starts from a plain map
/// without a time-out register, which must be configured.
RegisterMap register_preset(TerminalKind kind);

/// Number of slots that hold the valves named in `order`.
int slot_count(const RegisterMap& map, std::span<const int> order) noexcept;
/// Number of words in the block of set points.
int write_size(const RegisterMap& map, std::span<const int> order) noexcept;
/// Number of words in the block of measured pressures.
int read_size(const RegisterMap& map, std::span<const int> order) noexcept;

/// "" or the fault of the map: words outside their slots, blocks that leave the address space or
/// overlap, pressures up to `max_bar` that do not fit a signed word, no time-out register.
/// Allocates.
std::string register_map_fault(const RegisterMap& map, std::span<const int> order, double max_bar);

/// The word for a pressure: rounded to the nearest unit, within [0, max_bar] and never above 32767;
/// NaN counts as 0. Never negative, even if the terminal takes words as signed.
std::uint16_t set_point_register(const RegisterMap& map, double bar, double max_bar) noexcept;

/// The pressure (bar) of a word in two's complement, as sensors may read below ambient.
double register_pressure_bar(const RegisterMap& map, std::uint16_t word) noexcept;

/// The whole block of set points: `set_points_bar[i]` goes to valve `order[i]`, every other valve
/// gets 0, control words request pressure regulation. `words` has `write_size`.
void put_set_points(const RegisterMap& map, std::span<const int> order,
                    const Eigen::VectorXd& set_points_bar, double max_bar,
                    std::span<std::uint16_t> words) noexcept;

/// Decodes the block of measured pressures (`read_size` words).
void take_read_back(const RegisterMap& map, std::span<const int> order,
                    std::span<const std::uint16_t> words, ReadBack& read_back) noexcept;

/// The words of a time-out (s), `timeout_words` of them in use. A time-out that cannot be
/// represented becomes the nearest one that can.
void put_timeout(const RegisterMap& map, double timeout_s,
                 std::span<std::uint16_t, 2> words) noexcept;
/// The time-out (s) of these words.
double timeout_s_of(const RegisterMap& map, std::span<const std::uint16_t, 2> words) noexcept;

}  // namespace softarm
