#include "softarm/valves/simulated_terminal.hpp"

#include <gtest/gtest.h>

#include "softarm/valves/register_map.hpp"

namespace softarm {
namespace {

/// What the driver puts into a block arrives at the valves, whichever the map.
class EveryTerminal : public ::testing::TestWithParam<TerminalKind> {};

TEST_P(EveryTerminal, TakesWhatTheDriverWritesAndShowsWhatItMeasures) {
  const RegisterMap map = register_preset(GetParam());
  const std::vector<int> order = {3, 0, 2};
  SimulatedTerminal terminal(map, order);
  Eigen::VectorXd bar(3);
  bar << 0.25, 1.5, 0.0;
  const auto write = std::span(terminal.registers())
                         .subspan(static_cast<std::size_t>(map.write_address),
                                  static_cast<std::size_t>(write_size(map, order)));
  put_set_points(map, order, bar, 2.0, write);
  EXPECT_EQ(terminal.set_points_bar(), bar);
  Eigen::VectorXd actual(3);
  actual << 0.2, 1.4, -0.01;
  terminal.measure(actual);
  ReadBack read_back(3);
  const auto read = std::span(terminal.registers())
                        .subspan(static_cast<std::size_t>(map.read_address),
                                 static_cast<std::size_t>(read_size(map, order)));
  take_read_back(map, order, read, read_back);
  EXPECT_TRUE(read_back.actual_bar.isApprox(actual, 1e-12));
  EXPECT_TRUE(read_back.ready);
  if (read_back.has_echo) {
    EXPECT_EQ(read_back.echo_bar, bar);
  }
  terminal.reset_outputs();
  EXPECT_TRUE(terminal.set_points_bar().isZero());
}
INSTANTIATE_TEST_SUITE_P(Presets, EveryTerminal,
                         ::testing::Values(TerminalKind::cpx_vppm, TerminalKind::cpx_vtem,
                                           TerminalKind::cpx_e, TerminalKind::cpx_ap),
                         [](const auto& test) {
                           return std::string(kTerminalNames[static_cast<std::size_t>(test.param)]);
                         });

TEST(Terminal, MisbehavesOnANegativeSetPointAsTheRealOneDoes) {
  const RegisterMap map = register_preset(TerminalKind::cpx_e);
  SimulatedTerminal terminal(map, {0, 1});
  terminal.registers()[40002] = 0xffff;
  EXPECT_EQ(terminal.set_points_bar()[0], 0.0);
  EXPECT_GT(terminal.set_points_bar()[1], 10.0);
}

TEST(Terminal, ASlotWithoutItsMotionAppGivesNoPressure) {
  const RegisterMap map = register_preset(TerminalKind::cpx_vtem);
  SimulatedTerminal terminal(map, {0, 1});
  terminal.registers()[40004] = 500;
  EXPECT_EQ(terminal.set_points_bar()[0], 0.0);
  terminal.registers()[40003] = 195;
  EXPECT_EQ(terminal.set_points_bar()[0], 0.5);
}

TEST(Terminal, OffersItsBlocksAndNothingElse) {
  const RegisterMap map = register_preset(TerminalKind::cpx_vppm);
  SimulatedTerminal terminal(map, {0, 1, 2});
  EXPECT_TRUE(terminal.writable(40003, 3));
  EXPECT_FALSE(terminal.writable(40003, 4));
  EXPECT_FALSE(terminal.writable(40002, 1));
  EXPECT_TRUE(terminal.writable(46100, 1));
  EXPECT_FALSE(terminal.writable(45395, 1)) << "measured pressures";
  EXPECT_TRUE(terminal.readable(45395, 9));
  EXPECT_FALSE(terminal.readable(45395, 10));
  EXPECT_TRUE(terminal.readable(40003, 1));
  EXPECT_EQ(terminal.timeout_s(), 0.0);
  terminal.registers()[46100] = 250;
  EXPECT_DOUBLE_EQ(terminal.timeout_s(), 0.25);
  EXPECT_FALSE(terminal.take_written());
  terminal.served(45395, 0);
  EXPECT_FALSE(terminal.take_written()) << "read only";
  terminal.served(40003, 3);
  EXPECT_TRUE(terminal.take_written());
  EXPECT_FALSE(terminal.take_written());
}

}  // namespace
}  // namespace softarm
