// What Python does for our programs: a Python, and where it finds the package.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace softarm {

/// Replaces this process by `python words...`; where that fails, prints why and returns
/// kExitFailure. @param program  which this is
int become_python(const std::string& program, std::vector<std::string> words);

/// Accepts MODULE:CLASS or FILE.py:CLASS.
CLI::Validator law_name();

}  // namespace softarm
