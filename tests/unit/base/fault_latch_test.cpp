#include "softarm/base/fault_latch.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <string>
#include <thread>

namespace softarm {
namespace {

namespace fs = std::filesystem;

class FaultLatchFile : public ::testing::Test {
 protected:
  FaultLatchFile()
      : folder_(fs::temp_directory_path() / ("softarm_latch_" + std::to_string(getpid()))) {}
  ~FaultLatchFile() override { fs::remove_all(folder_); }

  std::string found() const {
    const FaultLatch latch(folder_ / "state", "CHANNEL on udpm://1");
    EXPECT_EQ(latch.problem(), "");
    return latch.found();
  }
  fs::path file() const { return FaultLatch(folder_ / "state", "CHANNEL on udpm://1").file(); }

  fs::path folder_;
};

TEST_F(FaultLatchFile, KeepsWhatWasSetLast) {
  EXPECT_EQ(found(), "");
  EXPECT_EQ(found(), "");
  {
    FaultLatch latch(folder_ / "state", "CHANNEL on udpm://1");
    EXPECT_TRUE(latch.kept());
    latch.set("valves_silent");
    latch.set("emergency_stop");
    while (!latch.kept()) std::this_thread::yield();
    std::ifstream kept(latch.file());
    std::string text(14, ' ');
    kept.seekg(6).read(text.data(), 14);
    EXPECT_EQ(text, "emergency_stop");
  }
  EXPECT_EQ(found(), "emergency_stop");
  EXPECT_EQ(found(), "emergency_stop") << "looking is no acknowledgement";
  EXPECT_EQ(FaultLatch(folder_ / "state", "OTHER on udpm://1").found(), "");
  {
    FaultLatch latch(folder_ / "state", "CHANNEL on udpm://1");
    latch.set("emergency_stop");
    latch.clear();
  }
  EXPECT_EQ(found(), "");
  EXPECT_EQ(fs::file_size(file()), 64u) << "it never grows";
}

TEST_F(FaultLatchFile, WhatCannotBeUnderstoodIsAFault) {
  EXPECT_EQ(found(), "");
  const fs::path path = file();
  for (const std::string& text : {std::string(), std::string(64, '\0'), std::string("no FAULT"),
                                  std::string(64, 'x'), std::string(65, ' ')}) {
    std::ofstream(path, std::ios::trunc) << text;
    EXPECT_EQ(found(), "unknown") << text;
    EXPECT_EQ(found(), "unknown") << "still";
  }
}

TEST_F(FaultLatchFile, SurvivesThatItsFolderIsCleared) {
  {
    FaultLatch latch(folder_ / "state", "CHANNEL on udpm://1");
    fs::remove_all(folder_);
    latch.set("emergency_stop");
  }
  EXPECT_EQ(found(), "emergency_stop");
  {
    FaultLatch latch(folder_ / "state", "CHANNEL on udpm://1");
    fs::rename(latch.file(), folder_ / "restored");
    fs::copy_file(folder_ / "restored", latch.file());
    latch.clear();
  }
  EXPECT_EQ(found(), "");
}

TEST_F(FaultLatchFile, ReportsWhatItCannotKeep) {
  fs::create_directories(folder_);
  std::ofstream(folder_ / "taken") << "a file";
  FaultLatch latch(folder_ / "taken", "CHANNEL");
  EXPECT_NE(latch.problem(), "");
  EXPECT_EQ(latch.found(), "");
  latch.set("emergency_stop");  // harmless
  EXPECT_TRUE(latch.kept()) << "nobody waits for what never comes";
  const FaultLatch full("/dev/full", "CHANNEL");
  EXPECT_NE(full.problem(), "");
}

TEST(StateDirectory, IsTheFirstThatIsSet) {
  const auto with = [](const char* service, const char* state, const char* home) {
    const auto set = [](const char* name, const char* value) {
      value != nullptr ? setenv(name, value, 1) : unsetenv(name);
    };
    set("STATE_DIRECTORY", service);
    set("XDG_STATE_HOME", state);
    set("HOME", home);
    return state_directory().string();
  };
  EXPECT_EQ(with("/var/lib/softarm:/other", "/state", "/home/me"), "/var/lib/softarm");
  EXPECT_EQ(with(nullptr, "/state", "/home/me"), "/state/softarm");
  EXPECT_EQ(with(nullptr, "relative", "/home/me"), "/home/me/.local/state/softarm");
  EXPECT_EQ(with(nullptr, nullptr, nullptr), "/var/tmp/softarm-" + std::to_string(geteuid()));
}

}  // namespace
}  // namespace softarm
