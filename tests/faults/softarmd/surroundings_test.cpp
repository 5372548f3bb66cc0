// What happens around the daemon: its machine's wall clock is set, somebody leans on the arm.
#include "faults/preloaded_clocks.hpp"
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
  configure(*this);
  test::PreloadedClocks clock((folder_ / "wall_clock").string());
  ASSERT_TRUE(clock.made());
  const auto plant = start_plant(*this);
  std::vector<std::string> arguments = clock.preload();
  arguments.push_back(std::string(SOFTARM_BINARY_DIR) + "/bin/softarmd");
  const auto daemon = start("/env", arguments);
  ASSERT_TRUE(wait_for([&] { return under_pressure(); })) << told() << daemon->printed();
  for (const std::int64_t offset_s : {3600, -86400, 0}) {
    SCOPED_TRACE(offset_s);
    // A busy machine holds the arm by itself now and then, so undisturbed once is enough.
    bool undisturbed = false;
    for (int k = 0; k < 5 && !undisturbed; ++k) {
      clock.set_offset_s(k % 2 == 0 ? offset_s : offset_s + 7200);
      const std::int64_t reads = clock.reads();
      const std::int64_t accepted = status_.frames_accepted;
      active_in_row_ = 0;
      undisturbed = wait_for([&] { return active_in_row_ >= 100; }, 2.0);
      EXPECT_TRUE(wait_for([&] { return status_.frames_accepted > accepted + 20; })) << told();
      EXPECT_GT(clock.reads(), reads) << "arrivals are stamped with the wall clock";
      EXPECT_TRUE(stays_active(*this, 10)) << told() << daemon->printed();
    }
    EXPECT_TRUE(undisturbed) << told() << daemon->printed();
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
      << leant_on.told() << other->printed();
  EXPECT_EQ(leant_on.reason(), Reason::curvature_mismatch) << leant_on.told();
  EXPECT_TRUE(leant_on.wait_for([&] { return largest(leant_on.command_.pressure_bar) == 0.0F; }));
  const std::int64_t tick = leant_on.status_.tick;
  ASSERT_TRUE(leant_on.wait_for([&] { return leant_on.status_.tick > tick + 200; }));
  EXPECT_EQ(leant_on.mode(), Mode::fault) << "it is latched";
  // The same watch, and nobody leans on the arm.
  EXPECT_TRUE(wait_for([&] { return under_pressure(); })) << told() << daemon->printed();
  EXPECT_TRUE(stays_active(*this)) << told() << daemon->printed();
  EXPECT_FALSE(saw(Mode::fault, Reason::curvature_mismatch)) << told();
  expect_limits(*this);
  expect_limits(leant_on);
}

SOFTARM_ON_BOTH_MACHINES(Surroundings);

}  // namespace
}  // namespace softarm
