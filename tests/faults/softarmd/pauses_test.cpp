// The machine of the daemon is suspended: CLOCK_MONOTONIC stands still, CLOCK_BOOTTIME goes on.
#include "dev/clock/preloaded_clocks.hpp"
#include "faults/softarmd/fault_test.hpp"

namespace softarm {
namespace {

using test::FaultTest;

class Pauses : public FaultTest {};

TEST_P(Pauses, ASuspendedDaemonVentsAndWithExplicitArmingWaitsForAPerson) {
#ifdef SOFTARM_SANITIZED
  GTEST_SKIP() << "a sanitizer's runtime must be loaded first";
#endif
  configure(*this, ", arming: explicit");
  PreloadedClocks clocks((folder_ / "clocks").string());
  ASSERT_TRUE(clocks.made());
  const auto plant = start_plant(*this);
  std::vector<std::string> arguments = clocks.preload();
  arguments.push_back(std::string(SOFTARM_BINARY_DIR) + "/bin/softarmd");
  const auto daemon = start("/env", arguments);
  ASSERT_TRUE(wait_for([&] { return reason() == Reason::waiting_for_arm; })) << daemon->printed();
  EXPECT_EQ(client_->request(OperatorRequest::arm), RequestOutcome::done) << daemon->printed();
  ASSERT_TRUE(wait_for([&] { return under_pressure(); })) << seen_text() << daemon->printed();

  forget();
  clocks.suspend(30 * test::kSecond);
  EXPECT_TRUE(wait_for([&] { return saw(Mode::vent, Reason::time_gap); })) << seen_text();
  EXPECT_TRUE(becomes(*this, Mode::vent, Reason::waiting_for_arm))
      << seen_text() << daemon->printed();
  EXPECT_EQ(largest(command_.pressure_bar), 0.0);
  EXPECT_FALSE(saw(Mode::fault, Reason::valves_silent)) << seen_text();
  EXPECT_EQ(client_->request(OperatorRequest::arm), RequestOutcome::done) << daemon->printed();
  EXPECT_TRUE(wait_for([&] { return under_pressure(); })) << seen_text();
}

SOFTARM_ON_BOTH_MACHINES(Pauses);

}  // namespace
}  // namespace softarm
