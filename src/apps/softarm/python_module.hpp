// The Python package for commands that it does: a Python, and where it finds the package.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace softarm {

/// Replaces this process by `python -m module words...`; returns, with errno, only where that fails.
/// @return the Python that could not be started
std::string run_python_module(const std::string& module, const std::vector<std::string>& words);

/// Accepts MODULE:CLASS or FILE.py:CLASS.
CLI::Validator law_name();

}  // namespace softarm
