// A child process that never outlives its owner.
#pragma once

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace softarm {

class ChildProcess {
 public:
  /// Starts `program`: a path, or a name that PATH knows. What it prints goes to the file `output`.
  /// One that cannot be started prints why and ends with exit code 127. When this object, or the
  /// thread that made it, ends, it gets the signal `at_end` and its end is awaited; a terminal's
  /// Ctrl-C does not reach it.
  ChildProcess(const std::string& program, const std::vector<std::string>& arguments,
               std::string output, int at_end = SIGKILL)
      : output_(std::move(output)), at_end_(at_end) {
    std::vector<char*> argv{const_cast<char*>(program.c_str())};
    for (const std::string& argument : arguments)
      argv.push_back(const_cast<char*>(argument.c_str()));
    argv.push_back(nullptr);
    pid_ = fork();
    if (pid_ != 0) return;
    prctl(PR_SET_PDEATHSIG, at_end_);
    setpgid(0, 0);
    const int file = open(output_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    dup2(file, STDOUT_FILENO);
    dup2(file, STDERR_FILENO);
    close_range(STDERR_FILENO + 1, ~0U, CLOSE_RANGE_CLOEXEC);  // sockets are not inherited
    execvp(program.c_str(), argv.data());
    dprintf(STDERR_FILENO, "%s: %s\n", program.c_str(), std::strerror(errno));
    _exit(127);
  }
  ~ChildProcess() {
    if (pid_ <= 0) return;
    kill(pid_, at_end_);
    waitpid(pid_, nullptr, 0);
  }
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  bool runs() { return pid_ > 0 && wait(std::chrono::milliseconds(0)) < 0; }
  /// -1 once `wait` has seen its end.
  int pid() const { return pid_; }
  /// Nothing happens where it has ended.
  void signal(int number) const {
    if (pid_ > 0) kill(pid_, number);
  }

  /// Stops it, and returns once it does not run any more.
  void stop() const {
    if (pid_ <= 0) return;
    signal(SIGSTOP);
    siginfo_t stopped{};
    waitid(P_PID, static_cast<id_t>(pid_), &stopped, WSTOPPED | WEXITED | WNOWAIT);
  }

  /// Exit code (128 + signal where one ended it), or -1 if it still runs after `patience`.
  int wait(std::chrono::milliseconds patience) {
    const auto end = std::chrono::steady_clock::now() + patience;
    do {
      int status = 0;
      if (pid_ > 0 && waitpid(pid_, &status, WNOHANG) == pid_) {
        pid_ = -1;
        return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    } while (std::chrono::steady_clock::now() < end);
    return -1;
  }

  /// What it printed so far.
  std::string printed() const {
    std::ostringstream text;
    text << std::ifstream(output_).rdbuf();
    return text.str();
  }

 private:
  std::string output_;
  int at_end_;
  pid_t pid_ = -1;
};

/// The path of another program of this project: beside the one that runs.
inline std::string program_beside_this(const std::string& name) {
  return std::filesystem::read_symlink("/proc/self/exe").replace_filename(name).string();
}

}  // namespace softarm
