// The program softarm-valves as a function, for a program with a valve back end of your own.
#pragma once

namespace softarm {

/// Reads the command line (`CONFIG`, --help, --version), drives the valves with the back end that
/// `valves.backend` names (ValveBackendRegistration) until SIGTERM, SIGINT or SIGHUP, and vents.
/// Prints on stderr, under the name of argv[0]. Returns the exit code: 0 zero was confirmed, or
/// nothing was ever pressurised; 1 it was not confirmed, or an error; 64 command line; 75 another
/// driver runs; 78 configuration. Throws nothing.
int run_valve_driver(int argc, char** argv);

}  // namespace softarm
