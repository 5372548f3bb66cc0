// Disturbances from outside: the wall clock of the daemon's machine is set, a person leans on the
// arm.
#include "dev/clock/preloaded_clocks.hpp"
#include "faults/softarmd/fault_test.hpp"

namespace softarm {
namespace {

using test::FaultTest;
using test::Station;

class Surroundings : public FaultTest {};

TEST_P(Surroundings, AWallClockThatIsSetDisturbsNothing) {
#ifdef SOFTARM_SANITIZED
  GTEST_SKIP() << "a sanitizer's runtime must be loaded first";
#endif
  // Thresholds that no machine reaches by being busy, and every step of the clock does.
  validity_s_ = 0.5;
  write_config(
      "paper_arm.yaml",
      "  safety: {hold_after_s: 1, vent_after_s: 2, max_latency_s: 0.5, good_frames: 20}\n" +
          realtime());
  PreloadedClocks clock((folder_ / "wall_clock").string());
  ASSERT_TRUE(clock.made());
  const auto plant = start_plant(*this);
  std::vector<std::string> arguments = clock.preload();
  arguments.push_back(std::string(SOFTARM_BINARY_DIR) + "/bin/softarmd");
  const auto daemon = start("/env", arguments);
  arm_when_asked();
  ASSERT_TRUE(wait_for([&] { return under_pressure(); })) << seen_text() << daemon->printed();
  for (const std::int64_t offset_s : {3600, -86400, -86397, 0}) {
    SCOPED_TRACE(offset_s);
    forget();
    clock.set_offset_s(offset_s);
    const std::int64_t reads = clock.reads();
    const std::int64_t accepted = status_.frames_accepted;
    EXPECT_TRUE(wait_for([&] { return status_.frames_accepted > accepted + 40; })) << seen_text();
    EXPECT_GT(clock.reads(), reads) << "arrivals are stamped with the wall clock";
    EXPECT_EQ(seen_.size(), 1u) << seen_text() << daemon->printed();
    EXPECT_TRUE(saw(Mode::active, Reason::none)) << seen_text() << daemon->printed();
  }
  expect_limits(*this);
}

TEST_P(Surroundings, CurvatureThatDoesNotFollowIsALatchedFault) {
  constexpr const char* kWatch = ", curvature_residual_nm: 0.15";
  Station leant_on;
  configure(*this, kWatch);
  configure(leant_on, kWatch, "", "plant: {tip_force_n: [1, 0, 0]}\n");
  leant_on.listen();
  const auto plant = start_plant(*this);
  const auto daemon = start("softarmd");
  const auto other_plant = start_plant(leant_on);
  const auto other = leant_on.start("softarmd");
  EXPECT_TRUE(leant_on.wait_for([&] { return leant_on.mode() == Mode::fault; }))
      << leant_on.seen_text() << other->printed();
  EXPECT_EQ(leant_on.reason(), Reason::curvature_mismatch) << leant_on.seen_text();
  EXPECT_TRUE(leant_on.wait_for([&] { return largest(leant_on.command_.pressure_bar) == 0.0F; }));
  const std::int64_t tick = leant_on.status_.tick;
  ASSERT_TRUE(leant_on.wait_for([&] { return leant_on.status_.tick > tick + 200; }));
  EXPECT_EQ(leant_on.mode(), Mode::fault) << "it is latched";
  // The same check, without a person who leans on the arm.
  EXPECT_TRUE(wait_for([&] { return under_pressure(); })) << seen_text() << daemon->printed();
  EXPECT_TRUE(stays_active(*this)) << seen_text() << daemon->printed();
  EXPECT_FALSE(saw(Mode::fault, Reason::curvature_mismatch)) << seen_text();
  expect_limits(*this);
  expect_limits(leant_on);
}

SOFTARM_ON_BOTH_MACHINES(Surroundings);

}  // namespace
}  // namespace softarm
