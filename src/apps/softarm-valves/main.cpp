// softarm-valves: pressure commands from LCM to a valve terminal on Modbus TCP, measured pressures
// back.
#include "softarm/apps/valve_driver.hpp"

int main(int argc, char** argv) { return softarm::run_valve_driver(argc, argv); }
