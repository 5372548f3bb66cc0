// What happens to processes: signals, stops, a second instance, a full disk, a core that is busy.
#include <chrono>

#include "faults/softarmd/fault_test.hpp"

namespace softarm {
namespace {

using namespace std::chrono_literals;
using test::FaultTest;
using test::Process;
using test::Station;

class ProcessFaults : public FaultTest {
 protected:
  /// Stops a process for a while.
  static void pause(const Process& process, std::chrono::milliseconds time) {
    process.signal(SIGSTOP);
    std::this_thread::sleep_for(time);
    process.signal(SIGCONT);
  }
};

TEST_P(ProcessFaults, SignalsEndItVentedAndAKilledOneLeavesTheArmVented) {
  Station interrupted, killed;
  struct Each {
    Station& station;
    int signal;
    std::unique_ptr<Process> plant, daemon;
  };
  Each all[] = {{*this, SIGTERM, nullptr, nullptr},
                {interrupted, SIGINT, nullptr, nullptr},
                {killed, SIGKILL, nullptr, nullptr}};
  for (Each& each : all) {
    configure(each.station);
    if (&each.station != this) each.station.listen();
    each.station.arm_when_asked();
    each.plant = start_plant(each.station);
    each.daemon = each.station.start("softarmd");
  }
  for (Each& each : all) {
    SCOPED_TRACE(each.signal);
    Station& station = each.station;
    ASSERT_TRUE(station.wait_for([&] { return station.under_pressure(); }))
        << each.daemon->printed() << each.plant->printed();
    station.forget();
    const bool is_kill = each.signal == SIGKILL;
    EXPECT_EQ(station.end(*each.daemon, each.signal), is_kill ? 128 + SIGKILL : 0)
        << each.daemon->printed();
    EXPECT_LT(station.shutdown_statuses_, 500) << "a second of its ticks";
    ASSERT_TRUE(station.wait_for([&] {
      return station.plant_.vented && station.largest(station.plant_.pressure_bar) < 1e-3F;
    })) << each.plant->printed();
    if (is_kill) {
      EXPECT_GT(station.largest(station.command_.pressure_bar), 0.0F)
          << "nothing commanded it to vent";
    } else {
      EXPECT_EQ(station.largest(station.command_.pressure_bar), 0.0F) << "the last one is vent";
      EXPECT_TRUE(station.saw(Mode::vent, Reason::shutdown)) << station.seen_text();
    }
    expect_limits(station);
  }
}

TEST_P(ProcessFaults, AStoppedDaemonThrowsItsQueueAwayAndVents) {
  // The valves' read-back queues up as well; that it was not heard is no silence of theirs.
  configure(*this, ", valve_readback: true");
  const auto plant = start_plant(*this);
  arm_when_asked();
  // Neither its own messages nor a logger beside it can be written: the disk is full.
  Process daemon("softarmd", {config_.string()}, "/dev/full");
  Process logger("/lcm-logger", {"--lcm-url=" + url_, "--force", "/dev/full"}, "/dev/null");
  ASSERT_TRUE(wait_for([&] { return under_pressure(); })) << seen_text();

  forget();
  daemon.signal(SIGSTOP);
  ASSERT_TRUE(wait_for([&] { return plant_.vented; })) << "expired commands vent";
  go_on(0.3);  // longer than vent_after_s
  daemon.signal(SIGCONT);
  // Where the stop lasted long enough to fill the socket, a request may have been lost.
  EXPECT_TRUE(wait_for([&] {
    return saw(Mode::vent, Reason::time_gap) || saw(Mode::vent, Reason::requests_lost);
  })) << seen_text();
  EXPECT_FALSE(saw(Mode::fault, Reason::valves_silent)) << seen_text();
  std::int64_t armed = 0;
  EXPECT_TRUE(wait_for([&] {
    if (reason() == Reason::waiting_for_arm && armed++ % 100 == 0)
      client_->send(OperatorRequest::arm);
    return under_pressure();
  })) << seen_text();

  // Meanwhile no other daemon may serve the same channel: a second one ends before it publishes.
  const auto second = start("softarmd");
  EXPECT_EQ(end_of(*second), 75);
  EXPECT_NE(second->printed().find("another instance"), std::string::npos) << second->printed();
  EXPECT_TRUE(stays_active(*this)) << seen_text();

  EXPECT_EQ(end(daemon), 0);
  EXPECT_TRUE(wait_for([&] { return plant_.vented; }));
  expect_limits(*this);
}

// At 100 Hz, so that a stop of some tens of milliseconds is some ticks.
TEST_P(ProcessFaults, MissedTicksAreCountedAndUnderFifoHoldThenVent) {
  const std::string slow =
      "  rate_hz: 100\n  safety: {hold_after_s: 0.5, vent_after_s: 1, good_frames: 20}\n";
  Station without;
  without.listen();
  without.write_config("paper_arm.yaml", slow);
  write_config("paper_arm.yaml", slow + "  realtime: {fifo: true, priority: 50}\n");
  const bool fifo = test::fifo_is_permitted();
  const auto plant = start_plant(*this);
  const auto other_plant = start_plant(without);
  const auto daemon = start("softarmd");
  const auto other = without.start("softarmd");
  arm_when_asked();
  without.arm_when_asked();
  ASSERT_TRUE(wait_for([&] { return mode() == Mode::active; })) << daemon->printed();
  ASSERT_TRUE(without.wait_for([&] { return without.mode() == Mode::active; })) << other->printed();

  std::int64_t before = without.status_.overruns;
  pause(*other, 150ms);
  EXPECT_TRUE(without.wait_for([&] { return without.status_.overruns > before + 5; }));
  without.forget();
  before = without.commands_;
  EXPECT_TRUE(without.wait_for([&] { return without.commands_ > before + 5; }));
  EXPECT_FALSE(without.saw(Mode::vent, Reason::many_overruns)) << without.seen_text();
  EXPECT_FALSE(without.saw(Mode::hold, Reason::overruns)) << without.seen_text();
  if (!fifo) GTEST_SKIP() << "SCHED_FIFO is not permitted here: missed ticks are only counted";

  forget();
  before = status_.overruns;
  for (int k = 0; k < 5 && !saw(Mode::hold, Reason::overruns);
       ++k) {  // a busy machine stops longer
    pause(*daemon, 60ms);
    wait_for([&] { return saw(Mode::hold, Reason::overruns); }, 1.0);
    EXPECT_TRUE(wait_for([&] { return mode() == Mode::active; })) << seen_text();
  }
  EXPECT_TRUE(saw(Mode::hold, Reason::overruns)) << seen_text();

  EXPECT_GE(status_.overruns, before + 3);
  EXPECT_TRUE(wait_for([&] { return mode() == Mode::active; })) << seen_text();
  pause(*daemon, 250ms);
  EXPECT_TRUE(wait_for([&] { return saw(Mode::vent, Reason::many_overruns); })) << seen_text();
  EXPECT_TRUE(wait_for([&] { return mode() == Mode::active; })) << seen_text();
  expect_limits(*this);
}

SOFTARM_ON_BOTH_MACHINES(ProcessFaults);

// Wrong configurations: each is refused with exit code 78, file, line, key and what was expected,
// before anything is published.
TEST(BadConfiguration, IsRefusedAndNothingPublished) {
  struct Row {
    const char *daemon, *rest, *key, *line, *expected;
  };
  const Row rows[] = {
      {"  rate_hertz: 500\n", "", "daemon.rate_hertz", ":5:", "an unknown key"},
      {"  rate_hz: .nan\n", "", "daemon.rate_hz", ":5:", "number"},
      {"  rate_hz: 0\n", "", "daemon.rate_hz", ":5:", "[1, 20000]"},
      {"  bodies: {segment_ids: [1, 2]}\n", "", "daemon.bodies.segment_ids", ":5:", "3"},
      {"", "control: {kp_nm_per_rad: [1, 2]}\n", "control.kp_nm_per_rad", ":3:", "3"},
      {"  safety: {valve_readback: perhaps}\n", "", "daemon.safety.valve_readback",
       ":5:", "true or false"},
      {"", "include: missing.yaml\n", "include", ":3:", ""},
  };
  std::vector<std::unique_ptr<Station>> stations;
  std::vector<std::unique_ptr<Process>> daemons;
  for (const Row& row : rows) {
    stations.push_back(std::make_unique<Station>());
    Station& station = *stations.back();
    try {
      station.listen();
    } catch (const TransportError& error) {
      GTEST_SKIP() << error.what();
    }
    station.write_config("paper_arm.yaml", row.daemon, row.rest);
    daemons.push_back(station.start("softarmd"));
  }
  for (std::size_t k = 0; k < std::size(rows); ++k) {
    const Row& row = rows[k];
    SCOPED_TRACE(std::string(row.daemon) + row.rest);
    EXPECT_EQ(stations[k]->end_of(*daemons[k]), 78);
    const std::string printed = daemons[k]->printed();
    for (const std::string& part :
         {std::string("config.yaml") + row.line, std::string(row.key), std::string(row.expected)})
      EXPECT_NE(printed.find(part), std::string::npos) << part << " not in " << printed;
    stations[k]->client_->update(stations[k]->client_->now_ns());
    EXPECT_EQ(stations[k]->statuses_ + stations[k]->commands_, 0);
  }
}

}  // namespace
}  // namespace softarm
