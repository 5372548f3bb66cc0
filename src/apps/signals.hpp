// SIGTERM, SIGINT and SIGHUP request an orderly end of a program.
#pragma once

#include <csignal>

namespace softarm {

inline volatile std::sig_atomic_t stop_requested = 0;

/// From now on SIGTERM, SIGINT and SIGHUP (a terminal that closes) set `stop_requested` instead of
/// ending the process.
inline void catch_stop_signals() noexcept {
  struct sigaction action {};
  action.sa_handler = [](int) { stop_requested = 1; };
  sigaction(SIGTERM, &action, nullptr);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGHUP, &action, nullptr);
}

/// From now on they end the process again.
inline void release_stop_signals() noexcept {
  for (const int number : {SIGTERM, SIGINT, SIGHUP}) std::signal(number, SIG_DFL);
}

/// A closed pipe must not end the process: ignores SIGPIPE.
inline void ignore_broken_pipes() noexcept { std::signal(SIGPIPE, SIG_IGN); }

}  // namespace softarm
