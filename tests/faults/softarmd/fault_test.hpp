// What the tests of the fault table share: a machine that is idle or loaded, and a fault injector
// between sensors and daemon.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "dev/fault/fault_relay.hpp"
#include "integration/processes/station.hpp"
#include "softarm/base/realtime.hpp"
#include "softarm/config/load.hpp"

namespace softarm::test {

/// SCHED_FIFO priorities under load: the daemon's must be the highest but that of what stands for
/// the hardware.
inline constexpr int kDaemonPriority = 50, kPlantPriority = 60;

inline bool fifo_is_permitted() {
  bool permitted = false;
  std::thread([&] {
    permitted = apply_realtime_settings({.fifo = true, .priority = kPlantPriority}).empty();
  }).join();
  return permitted;
}

/// Idle: scheduled as everything else is. Loaded: everything under SCHED_FIFO, while three other
/// processes keep both cores busy.
enum class Machine { idle, loaded };

class FaultTest : public ::testing::TestWithParam<Machine>, protected Station {
 protected:
  void SetUp() override {
    if (loaded() && !fifo_is_permitted())
      GTEST_SKIP()
          << "SCHED_FIFO is not permitted here: run as root or raise the limit (ulimit -r)";
    try {
      listen();
    } catch (const TransportError& error) {
      GTEST_SKIP() << error.what();
    }
    for (int k = 0; loaded() && k < 3; ++k)
      load_.push_back(std::make_unique<Process>(
          "/sh", std::vector<std::string>{"-c", "while :; do :; done"}, "/dev/null"));
  }

  static bool loaded() { return GetParam() == Machine::loaded; }

  /// Patient thresholds. `more` is further YAML under `daemon:`, `safety` further keys of
  /// daemon.safety.
  void configure(Station& station, const std::string& safety = "", const std::string& more = "",
                 const std::string& rest = "") const {
    station.write_config("paper_arm.yaml",
                         std::string("  safety: {") + kPatientSafety +
                             ", frozen_frames: 40, most_activations: 20" + safety + "}\n" +
                             realtime() + more,
                         rest);
  }
  static std::string realtime() {
    return loaded()
               ? "  realtime: {fifo: true, priority: " + std::to_string(kDaemonPriority) + "}\n"
               : "";
  }

  /// The arm; its sensors speak to the injector where `suffix` is one.
  std::unique_ptr<Process> start_plant(Station& station, const std::string& suffix = "") const {
    std::vector<std::string> arguments;
    if (loaded())
      arguments = {"-f", std::to_string(kPlantPriority),
                   std::string(SOFTARM_BINARY_DIR) + "/bin/softarm-plant"};
    if (!suffix.empty()) arguments.insert(arguments.end(), {"--sensor-suffix", suffix});
    return station.start(loaded() ? "/chrt" : "softarm-plant", arguments);
  }
  std::unique_ptr<FaultRelay> start_relay(Station& station) const {
    return std::make_unique<FaultRelay>(load_experiment(station.config_.string()).transport.lcm,
                                        kSensorSuffix, loaded() ? kPlantPriority : 0);
  }

  /// ACTIVE in so many statuses in a row from now on.
  bool stays_active(Station& station, int statuses = 100) const {
    station.active_in_row_ = 0;
    return station.wait_for([&] { return station.active_in_row_ >= statuses; });
  }
  /// What a person does: presses the key again until it works.
  static void ask_until_done(Station& station, OperatorRequest what) {
    RequestOutcome outcome = RequestOutcome::unheard;
    for (int k = 0; k < 10 && outcome != RequestOutcome::done; ++k)
      outcome = station.client_->request(what);
    EXPECT_EQ(outcome, RequestOutcome::done) << station.seen_text();
  }
  bool becomes(Station& station, Mode mode, Reason reason) const {
    return station.wait_for([&] { return station.mode() == mode && station.reason() == reason; });
  }

  /// What must hold of every command that was seen, whatever happened.
  static void expect_limits(const Station& station) {
    const Experiment experiment = load_experiment(station.config_.string());
    const ActuationSettings& actuation = experiment.actuation;
    const double step =
        std::max(actuation.slew_bar_per_s, actuation.vent_bar_per_s) / experiment.rate_hz;
    EXPECT_TRUE(station.all_finite_);
    EXPECT_GE(station.lowest_bar_, 0.0);
    EXPECT_LE(station.highest_bar_, actuation.max_pressure_bar);
    EXPECT_LE(station.largest_step_bar_, step * 1.00001) << "1.00001 for rounding on the wire";
  }

 private:
  std::vector<std::unique_ptr<Process>> load_;
};

/// Every test of a fixture on both machines; those that begin with UnderLoad are slow.
#define SOFTARM_ON_BOTH_MACHINES(Fixture)                                            \
  INSTANTIATE_TEST_SUITE_P(AsItIs, Fixture, ::testing::Values(test::Machine::idle)); \
  INSTANTIATE_TEST_SUITE_P(UnderLoad, Fixture, ::testing::Values(test::Machine::loaded))

}  // namespace softarm::test
