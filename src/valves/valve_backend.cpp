#include "softarm/valves/valve_backend.hpp"

#include <fmt/format.h>

#include <map>
#include <stdexcept>
#include <utility>

#include "softarm/valves/modbus_backend.hpp"

namespace softarm {
namespace {

/// Factories by name. Built on first use, because static registrations are initialised in any
/// order.
std::map<std::string, ValveBackendFactory>& factories() {
  static std::map<std::string, ValveBackendFactory> all = {
      {"modbus", [](const ValveDriverSettings& settings, double max_pressure_bar) {
         return std::make_unique<ModbusBackend>(settings, max_pressure_bar);
       }}};
  return all;
}

}  // namespace

void add_valve_backend(const std::string& name, ValveBackendFactory make) {
  if (!factories().emplace(name, std::move(make)).second)
    throw std::invalid_argument("two valve back ends with the name " + name);
}

std::vector<std::string> valve_backend_names() {
  std::vector<std::string> names;
  for (const auto& [name, make] : factories()) names.push_back(name);
  return names;
}

std::unique_ptr<ValveBackend> make_valve_backend(const ValveDriverSettings& settings,
                                                 double max_pressure_bar) {
  const auto found = factories().find(settings.backend);
  if (found == factories().end())
    throw std::invalid_argument(
        fmt::format("valves.backend: expected one that this program has ({}), got {}",
                    fmt::join(valve_backend_names(), ", "), settings.backend));
  return found->second(settings, max_pressure_bar);
}

}  // namespace softarm
