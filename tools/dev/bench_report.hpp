// What the sub-commands of `softarm-dev bench` share.
#pragma once

#include <cstdio>
#include <string>

#include "apps/program.hpp"
#include "apps/progress.hpp"

namespace softarm {

/// An experiment that comes with softarm.
inline std::string shipped_config(const std::string& name) {
  return shared_file("config/" + name, SOFTARM_CONFIG_FOLDER "/" + name);
}

/// Gives `measure` a function that shows what is being measured, and prints the report that it
/// returns, by json() or table().
template <class Measure>
void print_report(bool as_json, const Measure& measure) {
  std::string text;
  {
    Progress progress(true);
    const auto report = measure([&progress](const std::string& what) { progress.update(what); });
    text = as_json ? json(report) : table(report);
  }
  std::fwrite(text.data(), 1, text.size(), stdout);
}

}  // namespace softarm
