// Runs one of our programs as a user would and keeps what it prints.
#pragma once

#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <string>

namespace softarm::test {

struct Outcome {
  int code = -1;
  std::string text;  ///< standard output and standard error
};

inline Outcome run(const std::string& arguments, const std::string& program = "softarm") {
  const std::string command = SOFTARM_BINARY_DIR "/bin/" + program + " " + arguments + " 2>&1";
  Outcome outcome;
  FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return outcome;
  std::array<char, 4096> buffer;
  while (std::size_t count = fread(buffer.data(), 1, buffer.size(), pipe)) {
    outcome.text.append(buffer.data(), count);
  }
  const int status = pclose(pipe);
  outcome.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return outcome;
}

}  // namespace softarm::test
