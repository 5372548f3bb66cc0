// Compares two messages of one type, field by field and bit for bit.
#pragma once

#include <cstdint>
#include <softarm_messages/controller_status_t.hpp>
#include <softarm_messages/pressure_command_t.hpp>
#include <softarm_messages/torque_command_t.hpp>
#include <string>
#include <vector>

namespace softarm {

/// A field whose bits differ, as text; numbers with enough digits to distinguish them.
struct FieldDifference {
  std::string field;  ///< "pressure_bar[3]"
  std::string unit;   ///< "bar", empty for counts
  std::string recorded, replayed;
};

/// All fields that differ; NaN and signed zeros are compared by their bits. Empty if none differ;
/// allocates nothing in that case.
std::vector<FieldDifference> differences(const softarm_messages::pressure_command_t& recorded,
                                         const softarm_messages::pressure_command_t& replayed);
/// The same of commands of torques.
std::vector<FieldDifference> differences(const softarm_messages::torque_command_t& recorded,
                                         const softarm_messages::torque_command_t& replayed);
/// The same of statuses, without the fields of the daemon (hash, seed, version, overruns,
/// malformed).
std::vector<FieldDifference> differences(const softarm_messages::controller_status_t& recorded,
                                         const softarm_messages::controller_status_t& replayed);
/// The same of commands before their conversion to float; `unit` is "bar" or "N m".
std::vector<FieldDifference> differences(const std::vector<double>& recorded,
                                         const std::vector<double>& replayed, const char* unit);

}  // namespace softarm
