#include "apps/child_process.hpp"

#include <gtest/gtest.h>

#include "test_folder.hpp"

namespace softarm {
namespace {

using namespace std::chrono_literals;

TEST(ChildProcess, SaysWhyItsProgramCannotBeStarted) {
  const TestFolder folder;
  const std::string missing = (folder / "missing").string();
  ChildProcess child(missing, {}, (folder / "printed.txt").string());
  EXPECT_EQ(child.wait(60s), 127);
  EXPECT_EQ(child.printed(), missing + ": No such file or directory\n");
  EXPECT_FALSE(child.runs());
}

}  // namespace
}  // namespace softarm
