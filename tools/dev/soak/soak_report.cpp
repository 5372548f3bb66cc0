#include "dev/soak/soak_report.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace softarm {
namespace {

using Json = nlohmann::ordered_json;

Json json_of(const ProcessUse& use) {
  return {{"resident_kib", use.resident_kib},
          {"anonymous_kib", use.anonymous_kib},
          {"descriptors", use.descriptors}};
}

Json json_of(const FaultCount& fault) {
  return {{"name", fault.name},
          {"injected", fault.injected},
          {"answered", fault.answered},
          {"recovered", fault.recovered},
          {"disturbed", fault.disturbed},
          {"longest_answer_s", fault.longest_answer_s},
          {"longest_recovery_s", fault.longest_recovery_s}};
}

Json json_of(const ProcessRecord& process) {
  return {{"name", process.name},
          {"instances", process.instances},
          {"at_start", json_of(process.at_start)},
          {"after_warm_up", json_of(process.after_warm_up)},
          {"at_end", json_of(process.at_end)}};
}

}  // namespace

int SoakCounters::injected() const {
  int sum = 0;
  for (const FaultCount& fault : faults) sum += fault.injected;
  return sum;
}

int SoakCounters::recovered() const {
  int sum = 0;
  for (const FaultCount& fault : faults) sum += fault.recovered;
  return sum;
}

std::vector<std::string> failures(const SoakCounters& counters) {
  std::vector<std::string> found = counters.troubles;
  if (counters.ticks == 0) found.emplace_back("the daemon did not tick");
  if (counters.injected() == 0) found.emplace_back("no fault was injected: the run was too short");
  for (const FaultCount& fault : counters.faults) {
    if (fault.answered < fault.injected)
      found.push_back(fmt::format("{}: {} of {} times without the demanded reaction", fault.name,
                                  fault.injected - fault.answered, fault.injected));
    if (fault.recovered < fault.injected)
      found.push_back(fmt::format("{}: {} of {} times not recovered", fault.name,
                                  fault.injected - fault.recovered, fault.injected));
  }
  if (counters.commands_outside_limits > 0)
    found.push_back(fmt::format("{} commands outside the limits of pressure or slew",
                                counters.commands_outside_limits));
  for (const ProcessRecord& process : counters.processes) {
    if (!process.measured) {
      found.push_back(fmt::format("{}: its memory could not be measured", process.name));
      continue;
    }
    const std::int64_t grown = process.at_end.anonymous_kib - process.after_warm_up.anonymous_kib;
    if (grown > kMostGrowth_kib)
      found.push_back(fmt::format("{}: memory grew by {} KiB after the warm-up, bound {} KiB",
                                  process.name, grown, kMostGrowth_kib));
    if (process.at_end.descriptors > process.after_warm_up.descriptors)
      found.push_back(fmt::format("{}: {} file descriptors, after the warm-up {}", process.name,
                                  process.at_end.descriptors, process.after_warm_up.descriptors));
  }
  return found;
}

std::string report_text(const SoakCounters& counters) {
  std::string text = fmt::format(
      "{:.0f} s at {:g} Hz: {} ticks, {} missed and {} more while stopped; {} commands seen, {} "
      "outside their limits\n"
      "references through theta = 0: {}; ACTIVE left without a fault: {}\n\n"
      "{:<18} {:>8} {:>8} {:>9} {:>9} {:>11} {:>13}\n",
      counters.duration_s, counters.rate_hz, counters.ticks,
      counters.overruns - counters.overruns_while_stopped, counters.overruns_while_stopped,
      counters.commands, counters.commands_outside_limits, counters.straight_poses,
      counters.unprovoked, "fault", "injected", "answered", "recovered", "disturbed", "answer (s)",
      "recovery (s)");
  for (const FaultCount& fault : counters.faults)
    text += fmt::format("{:<18} {:>8} {:>8} {:>9} {:>9} {:>11.3f} {:>13.3f}\n", fault.name,
                        fault.injected, fault.answered, fault.recovered, fault.disturbed,
                        fault.longest_answer_s, fault.longest_recovery_s);
  text += fmt::format("{:<18} {:>8} {:>8} {:>9}    (times are the longest)\n\n", "all",
                      counters.injected(), "", counters.recovered());
  text += fmt::format("{:<14} {:>30} {:>30} {:>26} {:>6}\n", "process",
                      fmt::format("RSS (KiB): start, {:.0f} s, end", counters.warm_up_s),
                      "without files (KiB)", "descriptors", "starts");
  for (const ProcessRecord& process : counters.processes) {
    const auto three = [&](auto ProcessUse::*what) {
      return fmt::format("{} {} {}", process.at_start.*what, process.after_warm_up.*what,
                         process.at_end.*what);
    };
    text += fmt::format("{:<14} {:>30} {:>30} {:>26} {:>6}\n", process.name,
                        three(&ProcessUse::resident_kib), three(&ProcessUse::anonymous_kib),
                        three(&ProcessUse::descriptors), process.instances);
  }
  const std::vector<std::string> why = failures(counters);
  for (const std::string& line : why) text += "\nFAILED: " + line;
  return text + (why.empty() ? "\nall faults recovered, memory and descriptors constant\n" : "\n");
}

std::string report_json(const SoakCounters& counters) {
  Json json{{"duration_s", counters.duration_s},
            {"warm_up_s", counters.warm_up_s},
            {"rate_hz", counters.rate_hz},
            {"ticks", counters.ticks},
            {"overruns", counters.overruns},
            {"overruns_while_stopped", counters.overruns_while_stopped},
            {"commands", counters.commands},
            {"commands_outside_limits", counters.commands_outside_limits},
            {"straight_poses", counters.straight_poses},
            {"unprovoked", counters.unprovoked},
            {"injected", counters.injected()},
            {"recovered", counters.recovered()},
            {"faults", Json::array()},
            {"processes", Json::array()},
            {"failures", failures(counters)}};
  for (const FaultCount& fault : counters.faults) json["faults"].push_back(json_of(fault));
  for (const ProcessRecord& process : counters.processes)
    json["processes"].push_back(json_of(process));
  return json.dump() + "\n";
}

}  // namespace softarm
