// softarmd and softarm-plant as separate processes, connected by LCM over UDP multicast on a port
// of the test. What happens when something goes wrong is in tests/faults.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "integration/processes/station.hpp"
#include "softarm/config/load.hpp"

namespace softarm {
namespace {

class Processes : public ::testing::Test, protected test::Station {
 protected:
  void SetUp() override {
    try {
      listen();
    } catch (const TransportError& error) {
      GTEST_SKIP() << error.what();
    }
    arm_when_asked();
  }
};

TEST_F(Processes, CloseTheLoop) {
  const auto plant = start("softarm-plant");
  const auto daemon = start("softarmd");
  ASSERT_TRUE(wait_for([&] { return under_pressure(); })) << daemon->printed() << plant->printed();
  EXPECT_EQ(status_.segments(), 3);
  EXPECT_EQ(status_.pressure_bar.size(), 12);
  EXPECT_NE(status_.configuration_hash, 0U);
  // Two seconds into (24) every segment is bent by 0.4 rad.
  ASSERT_TRUE(wait_for([&] {
    return mode() == Mode::active && plant_.segments() == 3 &&
           std::abs(plant_.u_rad.segment<2>(4).norm() - 0.4) < 0.05;
  })) << daemon->printed();

  EXPECT_EQ(end(*plant), 0) << plant->printed();
}

TEST_F(Processes, ShadowCommandsMoveNothing) {
  const auto plant = start("softarm-plant");
  const auto daemon = start("softarmd", {"--shadow"});
  ASSERT_TRUE(
      wait_for([&] { return mode() == Mode::active && largest(command_.pressure_bar) > 0.1F; }));
  EXPECT_TRUE(command_.shadow);
  EXPECT_TRUE(plant_.vented);
  EXPECT_EQ(largest(plant_.pressure_bar), 0.0F);
}

TEST_F(Processes, AStoppedAndContinuedPlantIsSimulatedOn) {
  const auto plant = start("softarm-plant");
  const auto daemon = start("softarmd");
  ASSERT_TRUE(wait_for([&] { return under_pressure(); })) << daemon->printed();
  plant->signal(SIGSTOP);
  ASSERT_TRUE(wait_for([&] { return mode() == Mode::vent; })) << daemon->printed();
  go_on(1.0);
  plant->signal(SIGCONT);
  EXPECT_TRUE(wait_for([&] { return under_pressure(); })) << daemon->printed();
  EXPECT_NE(plant->printed().find("behind real time"), std::string::npos) << plant->printed();
  EXPECT_EQ(end(*plant), 0) << plant->printed();
}

TEST_F(Processes, WatchRecordsWhatRunWouldWrite) {
  const auto plant = start("softarm-plant");
  const auto daemon = start("softarmd");
  const auto out = folder_ / "record";
  const auto watch = start("softarm", {"watch", "--duration", "2", "--out", out.string()});
  ASSERT_EQ(end_of(*watch), 0) << watch->printed() << daemon->printed();
  for (const char* name : {"log.csv", "summary.json", "timing.json"})
    EXPECT_TRUE(std::filesystem::exists(out / name));
  std::ifstream log(out / "log.csv");
  std::string provenance;
  std::getline(log, provenance);
  EXPECT_NE(provenance.find("configuration " + hash_text(load_experiment(config_).hash)),
            std::string::npos);
}

}  // namespace
}  // namespace softarm
