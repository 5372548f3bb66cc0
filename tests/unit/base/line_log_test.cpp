#include "softarm/base/line_log.hpp"

#include <gtest/gtest.h>

#include <latch>
#include <semaphore>
#include <string>
#include <vector>

namespace softarm {
namespace {

/// A terminal that takes the first line and then nothing more until it is let go on.
struct SlowTerminal {
  std::vector<std::string> lines;
  std::latch first_came{1};
  std::binary_semaphore go_on{0};

  auto print() {
    return [this](const std::string& line) {
      lines.push_back(line);
      if (lines.size() > 1) return;
      first_came.count_down();
      go_on.acquire();
    };
  }
};

TEST(LineLog, PrintsLinesInOrderAndDrainsAtTheEnd) {
  std::vector<std::string> lines;
  LineLog log("program", [&](const std::string& line) { lines.push_back(line); });
  for (int k = 0; k < 40; ++k) log.add("{:.3f} s: {}", 0.5 * k, "HOLD");
  log.finish();
  ASSERT_EQ(lines.size(), 40U);
  EXPECT_EQ(lines.front(), "program: 0.000 s: HOLD\n");
  EXPECT_EQ(lines.back(), "program: 19.500 s: HOLD\n");
}

TEST(LineLog, CountsWhatDoesNotFit) {
  SlowTerminal terminal;
  LineLog log("program", terminal.print());
  log.add("line {}", 0);
  terminal.first_came.wait();
  // The line that is being printed keeps its place.
  const int fit = static_cast<int>(LineLog::kCapacity) - 1;
  for (int k = 1; k <= fit + 7; ++k) log.add("line {}", k);
  terminal.go_on.release();
  log.finish();
  ASSERT_EQ(terminal.lines.size(), LineLog::kCapacity + 1);
  for (int k = 0; k <= fit; ++k)
    EXPECT_EQ(terminal.lines[static_cast<std::size_t>(k)],
              "program: line " + std::to_string(k) + "\n");
  EXPECT_EQ(terminal.lines.back(), "program: 7 lines came too fast to be printed\n");
}

TEST(LineLog, TakesLinesAgainOnceSomeWerePrinted) {
  constexpr int kLines = static_cast<int>(LineLog::kCapacity);
  std::vector<std::string> lines;
  std::latch printed{kLines};
  LineLog log("program", [&](const std::string& line) {
    lines.push_back(line);
    if (lines.size() <= LineLog::kCapacity) printed.count_down();
  });
  for (int k = 0; k < kLines; ++k) log.add("line {}", k);
  printed.wait();
  // All but the one whose place may not be free yet.
  for (int k = 1; k < kLines; ++k) log.add("again {}", k);
  log.finish();
  EXPECT_EQ(lines.size(), 2 * LineLog::kCapacity - 1);
  EXPECT_EQ(lines.back(), "program: again " + std::to_string(kLines - 1) + "\n");
}

TEST(LineLog, CutsALongLine) {
  std::vector<std::string> lines;
  LineLog log("program", [&](const std::string& line) { lines.push_back(line); });
  log.add("{}", std::string(1000, 'x'));
  log.add("{}", "next");
  log.finish();
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_EQ(lines[0], "program: " + std::string(LineLog::kLongestLine, 'x') + "\n");
  EXPECT_EQ(lines[1], "program: next\n");
}

}  // namespace
}  // namespace softarm
