// Files as others see them: whole under their name or not there, no input replaced, records kept.
#include "softarm/base/output_file.hpp"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <sstream>

namespace softarm {
namespace {

namespace fs = std::filesystem;

class Output : public ::testing::Test {
 protected:
  Output() { fs::create_directories(folder_); }
  ~Output() override { fs::remove_all(folder_); }

  fs::path path(const std::string& name) const { return folder_ / name; }
  void put(const std::string& name, const std::string& text) const {
    std::ofstream(path(name)) << text;
  }
  std::string text(const std::string& name) const {
    std::ostringstream text;
    text << std::ifstream(path(name)).rdbuf();
    return text.str();
  }
  std::size_t files() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), {}));
  }

  const fs::path folder_ =
      fs::temp_directory_path() / ("softarm_output_" + std::to_string(getpid()));
};

TEST_F(Output, AnInputIsRefusedUnderEveryName) {
  put("input", "the arm");
  put("other", "");
  fs::create_symlink("input", path("link"));
  fs::create_symlink("link", path("link_to_link"));
  fs::create_hard_link(path("input"), path("hard_link"));
  fs::create_directory_symlink(folder_, path("folder"));
  const Files inputs = {path("other"), path("input")};
  for (const char* name : {"input", "./input", "link", "link_to_link", "hard_link", "folder/input"})
    EXPECT_THROW(OutputFile(path(name), inputs), OutputIsInput) << name;
  fs::create_symlink("input", path("new.partial"));
  EXPECT_THROW(OutputFile(path("new"), inputs), OutputIsInput) << "the temporary is an input";
  EXPECT_EQ(text("input"), "the arm");
}

TEST_F(Output, ADocumentIsWholeOrAsItWas) {
  put("document", "before");
  {
    OutputFile file(path("document"), {});
    EXPECT_EQ(files(), 1u) << "nothing is made before the first text";
    file.write("after");
    file.flush();
    EXPECT_EQ(text("document"), "before");
  }
  EXPECT_EQ(text("document"), "before");
  EXPECT_EQ(files(), 1u);
  OutputFile file(path("document"), {});
  file.reserve(100'000);
  file.write("after");
  file.commit();
  EXPECT_EQ(text("document"), "after");
  EXPECT_EQ(files(), 1u);
}

TEST_F(Output, ALinkStaysALinkAndAFileKeepsItsPermissions) {
  put("real", "before");
  fs::permissions(path("real"), fs::perms::owner_read | fs::perms::owner_write);
  fs::create_symlink("real", path("link"));
  write_text(path("link"), "after", {});
  EXPECT_TRUE(fs::is_symlink(path("link")));
  EXPECT_EQ(text("real"), "after");
  EXPECT_EQ(fs::status(path("real")).permissions(), fs::perms::owner_read | fs::perms::owner_write);
  fs::create_symlink("nothing yet", path("dangling"));
  write_text(path("dangling"), "new", {});
  EXPECT_EQ(text("nothing yet"), "new");
}

TEST_F(Output, ARecordIsKeptWhereItEndsEarly) {
  put("record", "of an earlier run");
  {
    OutputFile file(path("record"), {}, OutputFile::Kind::record);
    file.write("one\n");
    EXPECT_EQ(text("record"), "of an earlier run");
  }
  EXPECT_EQ(text("record"), "one\n");
}

TEST_F(Output, TwoProgramsDoNotWriteOneRecord) {
  OutputFile first(path("record"), {}, OutputFile::Kind::record);
  EXPECT_THROW(OutputFile(path("record"), {}, OutputFile::Kind::record), OutputError);
  first.write("one\n");
  first.commit();
  EXPECT_EQ(text("record"), "one\n");
  put("left.partial", "by a program that was killed");
  write_text(path("left"), "new", {});
  EXPECT_EQ(text("left"), "new");
  EXPECT_FALSE(fs::exists(path("left.partial")));
}

TEST_F(Output, ADeviceIsWrittenAsItIs) {
  write_text("/dev/null", "text", {});
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  EXPECT_THROW(write_text("/dev/full", "text", {}), OutputError);
  const int memory = memfd_create("softarm_output", MFD_CLOEXEC);  // a link to no name
  const std::string name = "/proc/self/fd/" + std::to_string(memory);
  write_text(name, "text", {});
  std::string written(4, ' ');
  EXPECT_EQ(pread(memory, written.data(), 4, 0), 4);
  EXPECT_EQ(written, "text");
  close(memory);
  EXPECT_THROW(write_text(path("no folder/file"), "text", {}), OutputError);
}

// As on a full disk: the largest size of a file is reached within a record.
TEST_F(Output, WhereNothingMoreCanBeWrittenWholeRecordsAreKept) {
  const std::string record = std::string(999, 'x') + "\n";
  const auto outcome = [&](OutputFile::Kind kind) {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit small = {150'500, RLIM_INFINITY};
    rlimit before;
    getrlimit(RLIMIT_FSIZE, &before);
    setrlimit(RLIMIT_FSIZE, &small);
    int written = 0;
    {
      OutputFile file(path("file"), {}, kind);
      try {
        for (; written < 300; ++written) file.write(record);
        file.commit();
      } catch (const OutputError&) {
        EXPECT_LT(written, 300) << "the first write that fails reports it";
      }
      EXPECT_THROW(file.write(record), OutputError);
      EXPECT_THROW(file.commit(), OutputError);
    }
    setrlimit(RLIMIT_FSIZE, &before);
  };
  put("file", "before");
  outcome(OutputFile::Kind::document);
  EXPECT_EQ(text("file"), "before");
  outcome(OutputFile::Kind::record);
  EXPECT_EQ(text("file").size(), 150'000u);
  EXPECT_EQ(text("file").back(), '\n');
  EXPECT_EQ(files(), 1u);
}

}  // namespace
}  // namespace softarm
