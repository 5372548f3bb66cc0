// Two messages of one type, field by field and bit for bit.
#pragma once

#include <cstdint>
#include <softarm_messages/controller_status_t.hpp>
#include <softarm_messages/pressure_command_t.hpp>
#include <softarm_messages/torque_command_t.hpp>
#include <string>
#include <vector>

namespace softarm {

/// A field whose bits differ, as text; numbers with enough digits to tell them apart.
struct FieldDifference {
  std::string field;  ///< "pressure_bar[3]"
  std::string unit;   ///< "bar", empty for counts
  std::string recorded, replayed;
};

/// All fields that differ, NaN and signed zeros by their bits. Empty if none does; allocates
/// nothing then.
std::vector<FieldDifference> differences(const softarm_messages::pressure_command_t& recorded,
                                         const softarm_messages::pressure_command_t& replayed);
std::vector<FieldDifference> differences(const softarm_messages::torque_command_t& recorded,
                                         const softarm_messages::torque_command_t& replayed);
std::vector<FieldDifference> differences(const softarm_messages::controller_status_t& recorded,
                                         const softarm_messages::controller_status_t& replayed);
/// Commands as they were before they became floats; `unit` is bar or N m.
std::vector<FieldDifference> differences(const std::vector<double>& recorded,
                                         const std::vector<double>& replayed, const char* unit);

}  // namespace softarm
