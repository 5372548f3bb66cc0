// The program softarm-valves as a function, for a program with a valve back end of your own.
#pragma once

namespace softarm {

/// Reads the command line (`CONFIG`, --help, --version), drives the valves with the back end that
/// `valves.backend` names (ValveBackendRegistration) until SIGTERM, SIGINT or SIGHUP, and vents.
/// Prints on stderr. Returns the exit code: docs/how-to/connect_valves.md. Throws nothing.
/// @param program its name in what it prints
int run_valve_driver(const char* program, int argc, char** argv);

}  // namespace softarm
