// The program softarm-valves as a function, for programs with their own valve back end.
#pragma once

namespace softarm {

/// Reads the command line (`CONFIG`, --help, --version), drives the valves with the back end that
/// `valves.backend` names (ValveBackendRegistration) until SIGTERM, SIGINT or SIGHUP, and vents.
/// Prints on stderr, under the name of argv[0]. Returns the exit code: 0 set points of zero were
/// confirmed, or nothing was ever pressurised; 1 they were not confirmed, or another error; 64
/// command line; 75 another driver is running; 78 configuration. Throws nothing.
int run_valve_driver(int argc, char** argv);

}  // namespace softarm
