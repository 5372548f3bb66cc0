#include "softarm/config/load.hpp"

#include <fmt/format.h>

#include <exception>

#include "config/checks.hpp"
#include "config/describe.hpp"
#include "config/printers.hpp"
#include "softarm/base/hash.hpp"
#include "softarm/valves/register_map.hpp"

namespace softarm {
namespace {

/// One description reads and writes: what is printed is a copy.
Entry entries_of(Experiment experiment, ConfigKeys::Purpose purpose) {
  ConfigKeys keys(purpose);
  return keys.visit([&] { describe(keys, experiment); });
}

/// The values of keys without a default in the template: a short arm with every kind of reference.
Experiment example_experiment() {
  Experiment example;
  example.name = "my experiment";
  example.arm.segments.resize(2);
  const std::vector<Chamber> chambers = {{0.0, 0.839}, {2.0, 0.839}, {4.0, 0.839}};
  example.actuation.segments.assign(2, chambers);
  example.control.kp.assign(4, 1.0);
  example.control.kd.assign(4, 0.0);
  example.plant.arm = example.arm;
  example.plant.actuation = example.actuation;
  example.plant.initial_u_rad.setZero(4);
  example.plant.loads.resize(1);
  example.valves.registers = register_preset(example.valves.terminal);
  const std::vector<WayPoint> points = {
      {0.0, {0.0, 0.0, 0.0, 0.0}}, {2.0, {0.3, 0.0, 0.5, 0.0}}, {4.0, {0.0, 0.0, 0.0, 0.0}}};
  TipPathReference tip;
  tip.centre_m = {0.0, 0.0, -0.21};
  tip.first_axis_m = {0.03, 0.0, 0.0};
  tip.second_axis_m = {0.0, 0.02, 0.0};
  example.reference.phases = {{LiveReference{}, 5.0},
                              {LiveTipReference{}, 5.0},
                              {SetPointReference{{0.2, 0.0, 0.2, 0.0}}, 5.0},
                              {WayPointReference{points, true}, 20.0},
                              {tip, 10.0},
                              {PaperReference{}, 0.0}};
  return example;
}

Experiment read(const std::filesystem::path& file) {
  ConfigKeys keys(file);
  Experiment experiment;
  keys.visit([&] { describe(keys, experiment); });
  experiment.estimation.base_is_fixed = experiment.transport.bodies.base_id < 0;
  experiment.safety.deadman = !experiment.transport.lcm.deadman_channel.empty();
  // Nobody is to be surprised by an arm that moves: where valves may be real, an operator arms.
  if (!keys.given("daemon.safety.arming") && drives_real_valves(experiment))
    experiment.safety.arming = Arming::explicit_;
  check_consistency(experiment, keys);
  experiment.files = keys.files();
  experiment.hash = fnv1a(resolved_text(experiment));
  return experiment;
}

}  // namespace

Experiment load_experiment(const std::filesystem::path& file) {
  try {
    return read(file);
  } catch (const ConfigError&) {
    throw;
  } catch (const std::exception& error) {  // out of memory, a faulty file system
    throw ConfigError(file.string(), 0, "", "a file that can be read", error.what());
  }
}

Experiment write_experiment(OutputFile& file, const std::string& text) {
  file.write(text);
  file.flush();
  Experiment written = load_experiment(file.partial());
  file.commit();
  return written;
}

std::string resolved_text(const Experiment& experiment) {
  return yaml_text(entries_of(experiment, ConfigKeys::Purpose::print), false);
}

std::string template_text() {
  constexpr const char* kHeader = R"(# yaml-language-server: $schema=experiment.schema.json
# Every key of an experiment, with its meaning, type, range and unit. Printed by `softarm check --template`.
#
# A key that is not marked as required may be left out and then has the value shown here, or that of its text. Unknown
# and repeated keys, wrong types and values out of range are refused. Angles are radians and may be written as multiples
# of pi: pi/2, -pi, 3*pi/4, 0.2*pi/180; any number as a fraction: 1/120. `include: FILE` (relative to this file) takes over the keys of FILE; those
# of this file win, key by key. Editors with a YAML language server complete and check a file whose first line names the
# schema, as in this file: `softarm check --schema > experiment.schema.json`.

)";
  return kHeader + yaml_text(entries_of(example_experiment(), ConfigKeys::Purpose::document), true);
}

std::string schema_text() {
  Experiment example = example_experiment();
  example.reference.phases.clear();
  for (const ReferenceKind& kind : reference_kinds().all())
    example.reference.phases.emplace_back().kind = kind;
  return json_schema_text(entries_of(example, ConfigKeys::Purpose::schema));
}

std::string hash_text(std::uint64_t hash) { return fmt::format("{:016x}", hash); }

}  // namespace softarm
