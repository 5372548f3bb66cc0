// A program of the build as a child process.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "child_process.hpp"

namespace softarm::test {

class Process : public ChildProcess {
 public:
  /// Starts a program of the build, or one of the machine's if the name begins with a slash (its
  /// folder is looked up); what it prints goes to `output`, a file.
  Process(const std::string& program, const std::vector<std::string>& arguments, std::string output)
      : ChildProcess(program.starts_with('/') ? program.substr(1)
                                              : std::string(SOFTARM_BINARY_DIR) + "/bin/" + program,
                     arguments, std::move(output)) {}
};

}  // namespace softarm::test
