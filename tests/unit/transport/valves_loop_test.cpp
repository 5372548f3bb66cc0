// The valve driver's loop without its process, over real UDP multicast, with hardware in memory.
#include "softarm/transport/valves_loop.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "counted_malloc.hpp"
#include "own_url.hpp"
#include "softarm/base/clock.hpp"
#include "softarm/transport/message_decoding.hpp"

namespace softarm {
namespace {

/// Valves that follow at once.
class Mirror : public ValveBackend {
 public:
  explicit Mirror(Eigen::VectorXd& bar) : bar_(bar) {}
  bool connect() noexcept override { return open_ = true; }
  void close() noexcept override { open_ = false; }
  bool is_open() const noexcept override { return open_; }
  Secured secure() noexcept override { return {LinkResult::ok, true}; }
  LinkResult write(const Eigen::VectorXd& set_points_bar) noexcept override {
    bar_ = set_points_bar;
    return LinkResult::ok;
  }
  LinkResult read(ReadBack& read_back) noexcept override {
    read_back.actual_bar = bar_;
    return LinkResult::ok;
  }
  const char* error() const noexcept override { return ""; }
  std::string address() const override { return "memory"; }

 private:
  Eigen::VectorXd& bar_;
  bool open_ = false;
};

class ValvesLoopOverUdp : public ::testing::Test {
 protected:
  void SetUp() override {
    settings.chambers = 3;
    settings.driver.order = {0, 1, 2};
    settings.driver.rate_hz = 200.0;
    // A machine that is busy with other things must not look like a fault of the hardware.
    settings.driver.failsafe_timeout_s = 5.0;
    settings.longest_validity_s = 5.0;
    lcm.url = test::own_url();
    bar = Eigen::VectorXd::Zero(3);
    command.num_chambers = 3;
    command.validity_us = 5'000'000;
    command.pressure_bar = {0.1F, 0.2F, 0.3F};
    try {
      node = std::make_unique<LcmNode>(lcm.url);
      node->subscribe(lcm.measurement_channel, 4096, [this](const ReceivedMessage& each) {
        if (decode(each.bytes, measured)) ++measurements;
      });
      node->subscribe(lcm.valves_channel, 4096, [this](const ReceivedMessage& each) {
        if (decode(each.bytes, status)) ++statuses;
      });
      driver = std::make_unique<ValveDriver>(settings, std::make_unique<Mirror>(bar));
      loop = std::make_unique<ValvesLoop>(lcm, settings.driver.rate_hz, *driver);
    } catch (const TransportError& error) {
      GTEST_SKIP() << error.what();
    }
  }

  /// Runs the loop and, beside it, commands `command` until `reached`; then stops it.
  template <class Condition>
  bool run_until(const Condition& reached,
                 const std::function<void(const ValvesLoop::Report&)>& after_cycle) {
    std::atomic<bool> stop = false;
    bool confirmed = false;
    std::thread thread([&] { confirmed = loop->run([&] { return stop.load(); }, after_cycle); });
    bool came = false;
    for (const std::int64_t end_ns = monotonic_now_ns() + 20'000'000'000;
         !came && monotonic_now_ns() < end_ns; came = reached()) {
      ++command.sequence;
      node->publish(lcm.command_channel, command);
      node->wait_until(monotonic_now_ns() + 5'000'000);
      node->drain(1000);
    }
    stop = true;
    thread.join();
    EXPECT_TRUE(confirmed);
    EXPECT_TRUE(bar.isZero());
    return came;
  }
  bool run_until(const std::function<bool()>& reached) {
    return run_until(reached, [](const ValvesLoop::Report&) {});
  }

  ValveGuardSettings settings;
  LcmSettings lcm;
  Eigen::VectorXd bar;
  std::unique_ptr<LcmNode> node;
  std::unique_ptr<ValveDriver> driver;
  std::unique_ptr<ValvesLoop> loop;
  softarm_messages::pressure_command_t command{};
  softarm_messages::pressure_measurement_t measured{};
  softarm_messages::valves_status_t status{};
  int measurements = 0, statuses = 0;
};

TEST_F(ValvesLoopOverUdp, CommandsReachTheHardwareAndWhatItMeasuresComesBack) {
  EXPECT_TRUE(run_until([this] {
    return measurements > 0 && measured.pressure_bar[2] == 0.3F && measured.sequence > 0 &&
           status.state == static_cast<std::int8_t>(ValveState::running) &&
           status.set_point_bar[1] == 0.2F && status.actual_bar[0] == 0.1F;
  }));
  EXPECT_EQ(loop->refused(), 0);
}

TEST_F(ValvesLoopOverUdp, CommandsOfAnotherArmAreCountedAndMoveNothing) {
  command.num_chambers = 4;
  command.pressure_bar.push_back(0.4F);
  EXPECT_TRUE(run_until([this] { return status.commands_refused > 10 && measurements > 10; }));
  EXPECT_EQ(measured.sequence, -1);
  EXPECT_EQ(measured.pressure_bar[0], 0.0F);
}

TEST_F(ValvesLoopOverUdp, CyclesAllocateNothing) {
  long before = 0, allocated = -1;
  std::atomic<int> running = 0;
  EXPECT_TRUE(run_until([&] { return running > 200; },
                        [&](const ValvesLoop::Report&) {
                          if (driver->guard().state() != ValveState::running) return;
                          // With its first message LCM makes itself a lock; that is start-up.
                          if (++running == 50) before = test::thread_allocations;
                          if (running == 200) allocated = test::thread_allocations - before;
                        }));
  EXPECT_EQ(allocated, 0);
}

}  // namespace
}  // namespace softarm
