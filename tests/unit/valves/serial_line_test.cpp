// Lines over a pseudo-terminal: the test is the device.
#include "softarm/valves/serial_line.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <unistd.h>

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <string>

#include "counted_malloc.hpp"

namespace softarm {
namespace {

class Line : public ::testing::Test {
 protected:
  Line() {
    char name[64];
    EXPECT_EQ(openpty(&device, &end, name, nullptr, nullptr), 0);
    line.emplace(name, 115200, 0.05);
  }
  ~Line() override {
    line.reset();
    close(device);
    close(end);
  }
  void arrives(const std::string& bytes) {
    ASSERT_EQ(write(device, bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
  }
  std::string sent() const {
    char bytes[100];
    const ssize_t count = read(device, bytes, sizeof bytes);
    return {bytes, static_cast<std::size_t>(std::max<ssize_t>(count, 0))};
  }
  std::string received(LinkResult expected = LinkResult::ok) {
    std::string_view text;
    EXPECT_EQ(line->receive(text), expected) << line->error();
    return std::string(text);
  }

  int device = -1, end = -1;
  std::optional<SerialLine> line;
};

TEST_F(Line, IsRawInBothDirections) {
  ASSERT_TRUE(line->open()) << line->error();
  EXPECT_EQ(line->send("S 1.5 \x03 \x13"), LinkResult::ok);
  EXPECT_EQ(sent(), "S 1.5 \x03 \x13\n");
  arrives("P 1.5 \x11\r\n");
  EXPECT_EQ(received(), "P 1.5 \x11");
}

TEST_F(Line, LinesComeInPiecesAndSeveralAtOnce) {
  ASSERT_TRUE(line->open());
  arrives("one\ntwo\nth");
  EXPECT_EQ(received(), "one");
  EXPECT_EQ(received(), "two");
  received(LinkResult::no_answer);
  arrives("ree\n\n");
  EXPECT_EQ(received(), "three");
  EXPECT_EQ(received(), "");
  received(LinkResult::no_answer);
  EXPECT_STREQ(line->error(), "Connection timed out");
}

TEST_F(Line, WhatArrivedBeforeAQuestionIsNotItsAnswer) {
  ASSERT_TRUE(line->open());
  arrives("late\nlater\n");
  EXPECT_EQ(received(), "late");
  EXPECT_EQ(line->send("question"), LinkResult::ok);
  arrives("answer\n");
  EXPECT_EQ(received(), "answer");
}

TEST_F(Line, AFloodWithoutALineEndIsNoAnswer) {
  ASSERT_TRUE(line->open());
  for (std::size_t arrived = 0; arrived <= SerialLine::kLongest; arrived += 4000) {
    arrives(std::string(4000, 'x'));
    received(LinkResult::no_answer);
  }
  EXPECT_STREQ(line->error(), "Message too long");
  EXPECT_EQ(line->send("again"), LinkResult::ok);
  arrives("answer\n");
  EXPECT_EQ(received(), "answer");
}

TEST_F(Line, ADeviceThatIsGoneIsABrokenConnection) {
  ASSERT_TRUE(line->open());
  close(device);
  received(LinkResult::broken);
  EXPECT_EQ(line->send("hello"), LinkResult::broken);
  line->close();
  EXPECT_FALSE(line->is_open());
  EXPECT_FALSE(line->open());
  EXPECT_FALSE(line->is_open());
  EXPECT_EQ(line->send("hello"), LinkResult::broken);
  received(LinkResult::broken);
  device = open("/dev/null", O_RDWR | O_CLOEXEC);
}

TEST(SerialLine, OpensOnlyWhatIsATerminal) {
  SerialLine nothing("/nonexistent", 9600, 0.01);
  EXPECT_FALSE(nothing.open());
  EXPECT_STREQ(nothing.error(), "No such file or directory");
  SerialLine file("/dev/null", 9600, 0.01);
  EXPECT_FALSE(file.open());
  EXPECT_STREQ(file.error(), "Inappropriate ioctl for device");
  EXPECT_THROW(SerialLine("/dev/null", 12345, 0.01), std::invalid_argument);
}

TEST_F(Line, AllocatesNothing) {
  ASSERT_TRUE(line->open());
  const long before = test::thread_allocations;
  std::string_view text;
  for (int k = 0; k < 100; ++k) {
    line->send("S 1.5");
    EXPECT_EQ(write(device, "P 1.5\n", 6), 6);
    line->receive(text);
  }
  EXPECT_EQ(test::thread_allocations - before, 0);
}

}  // namespace
}  // namespace softarm
