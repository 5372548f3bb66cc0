// A program of the build as a child process.
#pragma once

#include <chrono>
#include <regex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "apps/child_process.hpp"

namespace softarm::test {

class Process : public ChildProcess {
 public:
  /// Starts a program of the build, or one of the machine's if the name begins with a slash (its
  /// folder is looked up); what it prints goes to `output`, a file.
  Process(const std::string& program, const std::vector<std::string>& arguments, std::string output)
      : ChildProcess(program.starts_with('/') ? program.substr(1)
                                              : std::string(SOFTARM_BINARY_DIR) + "/bin/" + program,
                     arguments, std::move(output)) {}

  /// The port that a valve terminal has printed, waited for; 0 if there is none after 20 s.
  int port() const {
    using namespace std::chrono_literals;
    std::smatch match;
    for (const auto end = std::chrono::steady_clock::now() + 20s;
         std::chrono::steady_clock::now() < end; std::this_thread::sleep_for(10ms))
      if (const std::string text = printed();
          std::regex_search(text, match, std::regex("port ([0-9]+)")))
        return std::stoi(match[1]);
    return 0;
  }
};

}  // namespace softarm::test
