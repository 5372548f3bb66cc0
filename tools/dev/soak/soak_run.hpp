// A daemon and a simulated arm as processes, random faults one after the other, and what became of
// them.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "apps/child_process.hpp"
#include "dev/clock/preloaded_clocks.hpp"
#include "dev/fault/bad_terminal.hpp"
#include "dev/fault/fault_relay.hpp"
#include "dev/fault/raw_packets.hpp"
#include "dev/soak/soak_arm.hpp"
#include "dev/soak/soak_faults.hpp"
#include "dev/soak/soak_report.hpp"

namespace softarm {

struct SoakOptions {
  std::string config;  ///< the experiment whose arm and controller are meant
  double duration_s = 60.0;
  double between_s = 1.0;  ///< mean of the random time between two faults
  std::uint64_t seed = 1;
  std::filesystem::path folder;  ///< for the configuration and what the processes print
};

/// The plant and the valve driver listen to this channel, to which commands are passed on.
inline constexpr const char* kSoakValvesChannel = "SOFTARM_SOAK_VALVES";

/// Writes the soak's own configuration into the folder and returns its path: the experiment with
/// tick and motion capture at 500 Hz, live references, explicit arming, read-back, a dead-man
/// input, thresholds that a busy machine does not reach by itself, and a separate port. The plant's
/// and the valve driver's, soak_plant.yaml and soak_valves.yaml, are the same with other channels:
/// the daemon hears the pressures that the driver reads from the terminal.
std::filesystem::path write_soak_config(const SoakOptions& options);

class SoakRun {
 public:
  /// @throws ConfigError, TransportError
  explicit SoakRun(const SoakOptions& options);

  /// Returns after the duration, or when a stop is requested, with both processes ended.
  SoakCounters run();

 private:
  static constexpr double kPatience_s = 15.0;

  struct Program {
    std::string name;
    std::vector<std::string> arguments;
    std::unique_ptr<ChildProcess> process;
    ProcessRecord record;
  };
  void start(Program& program);
  void end(Program& program);
  void soak();
  void look_after_processes();
  void measure_after_warm_up(double passed_s);
  bool operate_until_active(double patience_s);
  void wait_between_faults();
  const SoakFault& next_fault(double passed_s);
  void cause(const SoakFault& fault);
  bool answered(const SoakFault& fault, std::int64_t counter_before);
  void clear(const SoakFault& fault);
  void make(const SoakFault& fault, FaultCount& count);
  void pause_daemon(const std::function<void()>& meanwhile);
  void insist_on_stop();
  void send_foreign_command();
  bool terminal_vented() const { return terminal_.pressure_bar() <= 0.1; }
  void make_pressure();
  void send_hostile_bytes();
  void flood(
      const std::string& channel, const std::function<void()>& meanwhile = [] {});
  double passed_s() const;

  SoakOptions options_;
  std::filesystem::path config_;
  Experiment experiment_;
  std::mt19937_64 random_;
  SoakArm arm_;
  FaultRelay relay_;
  RawSender sender_;
  BadTerminal terminal_;
  /// Of the daemon and of the valve driver, where their library was built.
  std::optional<PreloadedClocks> clocks_, valves_clocks_;
  Program daemon_, plant_, valves_;
  std::vector<std::size_t> cycle_;  ///< faults still to come before all have been there once more
  std::int64_t start_ns_ = 0;
  double replace_until_s_, warm_up_s_;
  bool stop_ = false;
  SoakCounters counters_;
};

}  // namespace softarm
