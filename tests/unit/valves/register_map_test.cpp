// Words on the wire, checked against addresses and values counted by hand from the documents.
#include "softarm/valves/register_map.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

namespace softarm {
namespace {

std::vector<int> first(int count) {
  std::vector<int> order(static_cast<std::size_t>(count));
  std::iota(order.begin(), order.end(), 0);
  return order;
}

TEST(SetPointRegister, IsNeverNegativeForAnyPressureAtAll) {
  const RegisterMap map = register_preset(TerminalKind::cpx_vppm);
  const double limit = 2.5;
  const double odd[] = {std::nan(""),
                        -std::nan(""),
                        std::numeric_limits<double>::infinity(),
                        -std::numeric_limits<double>::infinity(),
                        -0.0,
                        -1e-300,
                        std::numeric_limits<double>::denorm_min(),
                        std::numeric_limits<double>::max(),
                        std::numeric_limits<double>::lowest()};
  for (const double bar : odd) {
    EXPECT_LE(set_point_register(map, bar, limit), 2500) << bar;
  }
  for (int k = -400000; k <= 400000; ++k) {
    const double bar = 1e-4 * k;
    const auto word = set_point_register(map, bar, limit);
    ASSERT_GE(static_cast<std::int16_t>(word), 0) << bar;
    ASSERT_EQ(word, std::clamp(std::lround(1000.0 * bar), 0L, 2500L)) << bar;
  }
}

TEST(SetPointRegister, NotANumberAndNegativeVentAndTooMuchSaturates) {
  const RegisterMap map = register_preset(TerminalKind::cpx_e);
  EXPECT_EQ(set_point_register(map, std::nan(""), 2.0), 0);
  EXPECT_EQ(set_point_register(map, -0.5, 2.0), 0);
  EXPECT_EQ(set_point_register(map, std::numeric_limits<double>::infinity(), 2.0), 2000);
  EXPECT_EQ(set_point_register(map, 1.0, std::nan("")), 0) << "no limit known, no pressure";
  EXPECT_EQ(set_point_register(map, 1.0, -2.0), 0);
  EXPECT_EQ(set_point_register(map, 100.0, 100.0), 32767) << "still positive as a signed word";
}

TEST(RegisterPressure, ReadsBelowAmbientToo) {
  const RegisterMap map = register_preset(TerminalKind::cpx_vppm);
  for (int word = 0; word < 65536; ++word) {
    const double bar = register_pressure_bar(map, static_cast<std::uint16_t>(word));
    ASSERT_EQ(std::lround(1000.0 * bar), word < 32768 ? word : word - 65536);
  }
}

TEST(Presets, StandWhereTheDocumentsSay) {
  const RegisterMap vppm = register_preset(TerminalKind::cpx_vppm);
  EXPECT_EQ(vppm.write_address, 40003);  // 40001 + 2 .. + 17: sixteen valves
  EXPECT_EQ(write_size(vppm, first(16)), 16);
  EXPECT_EQ(vppm.read_address, 45395);
  EXPECT_EQ(read_size(vppm, first(16)), 48);
  const RegisterMap vtem = register_preset(TerminalKind::cpx_vtem);
  EXPECT_EQ(write_size(vtem, first(16)), 24) << "eight slots of control, p1, p2";
  EXPECT_EQ(vtem.control_value & 0x3f, 3) << "motion app 3: pressure regulation";
  const RegisterMap cpx_e = register_preset(TerminalKind::cpx_e);
  EXPECT_EQ(cpx_e.write_address, 40001);
  EXPECT_EQ(cpx_e.read_address, 45392);
  EXPECT_EQ(cpx_e.timeout_address, 46100);
  EXPECT_EQ(cpx_e.timeout_least_s, 0.1);
  const RegisterMap ap = register_preset(TerminalKind::cpx_ap);
  EXPECT_EQ(ap.write_address, 0);
  EXPECT_EQ(ap.read_address, 5000);
  EXPECT_EQ(ap.timeout_address, 14000);
  EXPECT_EQ(ap.timeout_words, 2);
}

TEST(Presets, FitTogether) {
  for (const auto kind : {TerminalKind::cpx_vppm, TerminalKind::cpx_vtem, TerminalKind::cpx_e,
                          TerminalKind::cpx_ap}) {
    EXPECT_EQ(register_map_fault(register_preset(kind), first(16), 10.0), "");
  }
  EXPECT_NE(register_map_fault(register_preset(TerminalKind::free), first(4), 2.0), "")
      << "a free map has no time-out until it is given";
}

TEST(RegisterMapFault, FindsWhatDoesNotFit) {
  const RegisterMap good = register_preset(TerminalKind::cpx_vtem);
  const auto faulty = [&](auto change, double max_bar = 2.0) {
    RegisterMap map = good;
    change(map);
    return !register_map_fault(map, first(16), max_bar).empty();
  };
  EXPECT_FALSE(faulty([](RegisterMap&) {}));
  EXPECT_TRUE(faulty([](RegisterMap& m) { m.write_words = 2; }));
  EXPECT_TRUE(faulty([](RegisterMap& m) { m.control_word = 1; }));
  EXPECT_TRUE(faulty([](RegisterMap& m) { m.control_word = 3; }));
  EXPECT_TRUE(faulty([](RegisterMap& m) { m.read_words = 2; }));
  EXPECT_TRUE(faulty([](RegisterMap& m) { m.echo_word = 2; }));
  EXPECT_TRUE(faulty([](RegisterMap& m) { m.diagnosis_word = 3; }));
  EXPECT_TRUE(faulty([](RegisterMap& m) { m.read_address = m.write_address + 23; }));
  EXPECT_TRUE(faulty([](RegisterMap& m) { m.timeout_address = m.write_address + 1; }));
  EXPECT_TRUE(faulty([](RegisterMap& m) { m.timeout_address = -1; }));
  EXPECT_TRUE(faulty([](RegisterMap& m) { m.read_address = 65520; }));
  EXPECT_TRUE(faulty([](RegisterMap&) {}, 33.0));
}

TEST(SetPoints, GoToTheirValvesAndNoOther) {
  RegisterMap map = register_preset(TerminalKind::cpx_vtem);
  const std::vector<int> order = {5, 0, 2};
  Eigen::VectorXd bar(3);
  bar << 0.5, 1.25, -3.0;
  std::vector<std::uint16_t> words(static_cast<std::size_t>(write_size(map, order)), 0xdead);
  put_set_points(map, order, bar, 2.0, words);
  // Slots: (0, 1), (2, 3), (4, 5).
  EXPECT_EQ(words, (std::vector<std::uint16_t>{195, 1250, 0, 195, 0, 0, 195, 0, 500}));
}

TEST(ReadBackTest, TakesTheBlockApart) {
  const RegisterMap map = register_preset(TerminalKind::cpx_vppm);
  const std::vector<int> order = {1, 0};
  ReadBack read_back(2);
  take_read_back(map, order, std::vector<std::uint16_t>{100, 200, 0, 0xfffd, 1500, 0x8001},
                 read_back);
  EXPECT_DOUBLE_EQ(read_back.actual_bar[0], -0.003);
  EXPECT_DOUBLE_EQ(read_back.actual_bar[1], 0.1);
  ASSERT_TRUE(read_back.has_echo);
  EXPECT_DOUBLE_EQ(read_back.echo_bar[0], 1.5);
  EXPECT_DOUBLE_EQ(read_back.echo_bar[1], 0.2);
  EXPECT_EQ(read_back.diagnosis, (std::vector<std::uint16_t>{0x8001, 0}));
  RegisterMap masked = map;
  masked.diagnosis_mask = 0x7ffe;
  take_read_back(masked, order, std::vector<std::uint16_t>{100, 200, 0, 0, 1500, 0x8001},
                 read_back);
  EXPECT_EQ(read_back.diagnosis[0], 0);
}

TEST(ReadBackTest, ASlotThatDoesNotRegulateIsNotReady) {
  const RegisterMap map = register_preset(TerminalKind::cpx_vtem);
  const std::vector<int> order = {0, 3};
  ReadBack read_back(2);
  std::vector<std::uint16_t> words = {131, 10, 11, 0x0500 | 131, 12, 13};
  take_read_back(map, order, words, read_back);
  EXPECT_TRUE(read_back.ready);
  EXPECT_DOUBLE_EQ(read_back.actual_bar[1], 0.013);
  words[3] = 61 | 1 << 6;  // the app that is off
  take_read_back(map, order, words, read_back);
  EXPECT_FALSE(read_back.ready);
}

TEST(Timeout, GoesThereAndBack) {
  std::array<std::uint16_t, 2> words{};
  RegisterMap map = register_preset(TerminalKind::cpx_ap);
  put_timeout(map, 0.2, words);
  EXPECT_EQ(words, (std::array<std::uint16_t, 2>{200, 0}));
  put_timeout(map, 100.0, words);
  EXPECT_EQ(words, (std::array<std::uint16_t, 2>{100000 - 65536, 1})) << "low word first";
  EXPECT_DOUBLE_EQ(timeout_s_of(map, words), 100.0);
  map = register_preset(TerminalKind::cpx_e);
  put_timeout(map, 100.0, words);
  EXPECT_EQ(words[0], 65535) << "the longest that fits";
  words[1] = 7;  // not ours
  EXPECT_DOUBLE_EQ(timeout_s_of(map, words), 65.535);
}

}  // namespace
}  // namespace softarm
