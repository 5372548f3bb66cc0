#include "program.hpp"

#include <fmt/format.h>
#include <softarm_commit.h>

#include <cstdio>
#include <exception>
#include <iostream>

#include "softarm/config/config_error.hpp"

namespace softarm {
namespace {

int parse_and_run(int argc, char** argv, CLI::App& app, const std::function<int()>& body) {
  try {
    app.parse(argc, argv);
    return body();
  } catch (const CLI::RuntimeError& error) {  // a sub-command's own exit code
    return error.get_exit_code();
  } catch (const CLI::ParseError& error) {  // --help and --version come this way too
    return app.exit(error) == 0 ? kExitOk : kExitUsage;
  } catch (const ConfigError& error) {
    print_error(app.get_name(), error.what());
    return kExitConfiguration;
  } catch (const std::exception& error) {
    print_error(app.get_name(), error.what());
    return kExitFailure;
  }
}

}  // namespace

const char* version_text() noexcept { return SOFTARM_VERSION; }
const char* commit_text() noexcept { return SOFTARM_COMMIT; }

void say(const std::string& text) noexcept { std::fputs(text.c_str(), stderr); }

void print_error(const std::string& program, const std::string& message) {
  say(fmt::format("{}: error: {}\n", program, message));
}

int run_program(int argc, char** argv, CLI::App& app, const std::function<int()>& body) {
  app.set_version_flag(
      "--version", fmt::format("{} {} (commit {})", app.get_name(), version_text(), commit_text()));
  const int code = parse_and_run(argc, argv, app, body);
  std::cout.flush();
  if ((std::fflush(stdout) != 0 || !std::cout) && code == kExitOk) {
    print_error(app.get_name(), "standard output could not be written");
    return kExitFailure;
  }
  return code;
}

}  // namespace softarm
