// examples/mocap_sender.cpp in front of a daemon: its frames are those of an arm, at any number of
// segments.
#include <gtest/gtest.h>

#include "integration/processes/station.hpp"

namespace softarm {
namespace {

class MocapSender : public ::testing::TestWithParam<const char*>, protected test::Station {
 protected:
  void SetUp() override {
    try {
      listen(GetParam());
    } catch (const TransportError& error) {
      GTEST_SKIP() << error.what();
    }
  }
};

TEST_P(MocapSender, MakesTheDaemonActive) {
  write_config(GetParam(), "");
  const auto daemon = start("softarmd", {"--shadow"});
  ASSERT_TRUE(wait_for([&] { return mode() == Mode::wait_frames; })) << daemon->printed();
  const auto sender = start("example_mocap_sender");
  ASSERT_TRUE(wait_for([&] { return mode() == Mode::active; }))
      << daemon->printed() << sender->printed() << seen_text();
  EXPECT_GT(status_.frames_accepted, 0);
  EXPECT_EQ(status_.messages_malformed, 0);
}

INSTANTIATE_TEST_SUITE_P(Experiments, MocapSender,
                         ::testing::Values("one_segment.yaml", "paper_arm.yaml"));

}  // namespace
}  // namespace softarm
