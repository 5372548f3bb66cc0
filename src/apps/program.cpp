#include "apps/program.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <iostream>
#include <sstream>
#include <string_view>

#include "softarm/base/form.hpp"
#include "softarm/base/instance_lock.hpp"
#include "softarm/base/output_file.hpp"
#include "softarm/base/version.hpp"
#include "softarm/config/config_error.hpp"

namespace softarm {
namespace {

/// Without what a terminal would obey: the text may quote a file or a message of somebody else.
std::string printable(std::string text) {
  for (std::size_t k = 0; k < text.size(); ++k) {
    const auto letter = static_cast<unsigned char>(text[k]);
    const auto next = static_cast<unsigned char>(k + 1 < text.size() ? text[k + 1] : ' ');
    const bool c0 = (letter < 0x20 && letter != '\n' && letter != '\t') || letter == 0x7f;
    const bool c1 = letter == 0xc2 && next >= 0x80 && next < 0xa0;  // in UTF-8
    if (c0 || c1) text[k] = '?';
    if (c1) text[k + 1] = '?';
  }
  return text;
}

int parse_and_run(int argc, char** argv, CLI::App& app, const std::function<int()>& body) {
  try {
    app.parse(argc, argv);
    return body();
  } catch (const CLI::RuntimeError& error) {  // a sub-command's own exit code
    return error.get_exit_code();
  } catch (const CLI::ParseError& error) {  // --help and --version come this way too
    // An unknown option is the likelier reason why something is missing.
    const bool missing = dynamic_cast<const CLI::RequiredError*>(&error) != nullptr ||
                         dynamic_cast<const CLI::RequiresError*>(&error) != nullptr;
    const std::vector<std::string> unknown =
        missing ? app.remaining(true) : std::vector<std::string>();
    if (unknown.empty()) return app.exit(error) == 0 ? kExitOk : kExitUsage;
    app.exit(CLI::ExtrasError(app.get_name(), unknown));
    return kExitUsage;
  } catch (const ConfigError& error) {
    std::istringstream lines(error.what());  // one for each error
    for (std::string line; std::getline(lines, line);) print_error(app.get_name(), line);
    return kExitConfiguration;
  } catch (const OutputIsInput& error) {
    print_error(app.get_name(), error.what());
    return kExitUsage;
  } catch (const OtherInstance& error) {
    print_error(app.get_name(), error.what());
    return kExitOtherInstance;
  } catch (const std::exception& error) {
    if (std::ferror(stdout) != 0) return kExitOk;  // which run_program reports
    print_error(app.get_name(), error.what());
    return kExitFailure;
  }
}

}  // namespace

std::string shared_file(const std::string& name, const std::string& source) {
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  const auto installed = program.parent_path().parent_path() / "share" / "softarm" / name;
  return std::filesystem::exists(installed, error) ? installed.string() : source;
}

void say(const std::string& text) noexcept { draw("", text); }

void draw(std::string_view control, const std::string& text) noexcept {
  constexpr int kPatience_ms = 200;
  constexpr std::size_t kAtOnce = 512;  // a pipe that takes any takes as much
  static std::atomic<bool> stuck{false};
  try {
    const std::string printed = std::string(control) + printable(text);
    std::string_view left = printed;
    while (!left.empty()) {
      pollfd where{.fd = STDERR_FILENO, .events = POLLOUT, .revents = 0};
      stuck = poll(&where, 1, stuck ? 0 : kPatience_ms) <= 0;
      if (stuck) return;
      const ssize_t written = write(STDERR_FILENO, left.data(), std::min(left.size(), kAtOnce));
      if (written < 0 && errno != EINTR) return;
      if (written > 0) left.remove_prefix(static_cast<std::size_t>(written));
    }
  } catch (...) {  // out of memory: lost
  }
}

CLI::Validator number_between(double low, double high) {
  const auto check = [low, high](std::string& text) -> std::string {
    double number = 0.0;
    return CLI::detail::lexical_cast(text, number) && number >= low && number <= high
               ? std::string()
               : fmt::format("expected {:g} to {:g}, got {}", low, high, text);
  };
  return {check, fmt::format("{:g} to {:g}", low, high)};
}

CLI::Validator seed_number() {
  static constexpr auto kLargest = static_cast<std::uint64_t>(kLargestWhole);
  const auto check = [](std::string& text) -> std::string {
    std::uint64_t seed = 0;
    const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), seed);
    return code == std::errc() && end == text.data() + text.size() && seed <= kLargest
               ? std::string()
               : fmt::format("expected a whole number in [0, {}], got {}", kLargest, text);
  };
  return {check, "SEED"};
}

CLI::Validator positive_seconds() {
  static constexpr double kLongest_s = 1e8;  // three years; their nanoseconds fit an int64
  const auto check = [](std::string& text) -> std::string {
    double seconds = 0.0;
    const bool number = CLI::detail::lexical_cast(text, seconds);
    return number && seconds > 0.0 && seconds <= kLongest_s
               ? std::string()
               : fmt::format("expected seconds above 0 and up to {:g}, got {}", kLongest_s, text);
  };
  return {check, "SECONDS"};
}

void print_error(const std::string& program, const std::string& message) {
  say(fmt::format("{}: error: {}\n", program, message));
}

int fail(const std::string& program, ExitCode code, const std::string& message) {
  print_error(program, message);
  return code;
}

void run_where_given(CLI::App& command, const std::function<int()>& body) {
  command.callback([body] {
    if (const int code = body(); code != kExitOk) throw CLI::RuntimeError(code);
  });
}

int run_program(int argc, char** argv, CLI::App& app, const std::function<int()>& body) {
  app.set_version_flag(
      "--version", fmt::format("{} {} (commit {})", app.get_name(), version_text(), commit_text()));
  std::signal(SIGXFSZ, SIG_IGN);  // a file at its largest size is an error of write()
  const int code = parse_and_run(argc, argv, app, body);
  std::cout.flush();
  const bool flushed = std::fflush(stdout) == 0;
  if ((!flushed || std::ferror(stdout) != 0 || !std::cout) && code == kExitOk) {
    print_error(app.get_name(), "standard output could not be written: is the disk full?");
    return kExitFailure;
  }
  return code;
}

}  // namespace softarm
