// Shared by all executables: exit codes, --help and --version, error messages.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <map>
#include <string>
#include <string_view>

namespace softarm {

/// Exit codes, after sysexits.h.
enum ExitCode : int {
  kExitOk = 0,
  kExitFailure = 1,         ///< anything not listed here
  kExitDifferent = 2,       ///< softarm replay: a command or status is not what was recorded
  kExitNotChecked = 3,      ///< softarm check --live: nothing failed, but not all was checked
  kExitUsage = 64,          ///< the command line is wrong
  kExitData = 65,           ///< a log is damaged, or lacks what it was read for
  kExitOtherInstance = 75,  ///< another instance holds the command channel
  kExitConfiguration = 78,  ///< the configuration is wrong (ConfigError)
};

/// A file installed with the programs: `name` in PREFIX/share/softarm of the running installed
/// program, otherwise `source` in the source tree.
std::string shared_file(const std::string& name, const std::string& source);

/// Prints on stderr, without characters that a terminal would obey. Text that cannot be written (a
/// full disk, a closed pipe, a pipe that nobody reads) is lost: a program that moves an arm must
/// neither end nor wait for that.
void say(const std::string& text) noexcept;

/// The same, behind characters that the terminal shall obey.
void draw(std::string_view control, const std::string& text) noexcept;

/// Accepts a finite time above zero, in s.
CLI::Validator positive_seconds();

/// Accepts a number from `low` to `high`; "nan" is refused.
CLI::Validator number_between(double low, double high);

/// Accepts one of these words, for an option of the type E.
template <class E>
CLI::Validator one_word_of(const std::map<std::string, E>& words) {
  std::string names;
  for (const auto& [word, value] : words) names += (names.empty() ? "" : ", ") + word;
  const auto read = [words, names](std::string& text) -> std::string {
    const auto found = words.find(text);
    if (found == words.end()) return "expected one of " + names + ", got " + text;
    text = std::to_string(static_cast<int>(found->second));
    return {};
  };
  return {read, names};
}

/// Accepts a seed: a whole number from 0 to 2^53, as in an experiment.
CLI::Validator seed_number();

/// Prints "NAME: error: MESSAGE" on stderr.
void print_error(const std::string& program, const std::string& message);
/// The same, for who ends with it. @return code
int fail(const std::string& program, ExitCode code, const std::string& message);

/// Runs `body` where the sub-command is given; what it returns is the program's exit code.
void run_where_given(CLI::App& command, const std::function<int()>& body);

/// Adds --version, parses, then runs `body` and returns its exit code; errors become a message and
/// the code above. The callback of a sub-command runs while parsing, before `body`; it may throw
/// CLI::RuntimeError(code) to end the program with that code. Returns kExitFailure where standard
/// output could not be written. Throws nothing.
int run_program(int argc, char** argv, CLI::App& app, const std::function<int()>& body);

}  // namespace softarm
