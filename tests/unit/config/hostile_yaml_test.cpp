// Whatever a file holds, load_experiment returns or throws ConfigError, within bounds.
#include <sys/stat.h>

#include <random>
#include <string>
#include <vector>

#include "config_files.hpp"
#include "softarm/config/load.hpp"

namespace softarm {
namespace {

/// The error's text, empty where the file was accepted; any other exception fails the test.
std::string refusal(const std::filesystem::path& file) {
  try {
    load_experiment(file);
  } catch (const ConfigError& error) {
    EXPECT_FALSE(error.expected.empty());
    EXPECT_FALSE(error.got.empty());
    return error.what();
  }
  return "";
}

std::string repeated(const std::string& text, int times) {
  std::string out;
  for (int i = 0; i < times; ++i) out += text;
  return out;
}

TEST(HostileYaml, DeepNestingIsRefused) {
  const TestFolder folder;
  EXPECT_NE(refusal(folder.write("a.yaml", "name: " + repeated("[", 100000))), "");
  EXPECT_NE(refusal(folder.write("b.yaml", repeated("{a: ", 100000))), "");
  EXPECT_NE(refusal(folder.write("c.yaml", repeated("- ", 100000))), "");
  EXPECT_NE(refusal(folder.write("d.yaml", repeated("? ", 100000))), "");
  std::string staircase;
  for (int i = 0; i < 1000; ++i)
    staircase += std::string(static_cast<std::size_t>(i), ' ') + "a:\n";
  EXPECT_NE(refusal(folder.write("e.yaml", staircase)).find("at most"), std::string::npos);
}

TEST(HostileYaml, AliasesAreRefusedBeforeTheyMultiply) {
  const TestFolder folder;
  std::string bomb = "a0: &a0 [x, x]\n";
  for (int i = 1; i < 40; ++i) {
    std::ostringstream line;
    line << "a" << i << ": &a" << i << " [*a" << i - 1 << ", *a" << i - 1 << "]\n";
    bomb += line.str();
  }
  EXPECT_NE(refusal(folder.write("bomb.yaml", bomb)).find("aliases of at most"), std::string::npos);
  EXPECT_NE(refusal(folder.write("merge.yaml", "<<: *x\n")), "");
}

TEST(HostileYaml, HugeFilesAreRefused) {
  const TestFolder folder;
  const std::string comment = repeated("# nothing to see here\n", 100000);
  EXPECT_NE(refusal(folder.write("huge.yaml", comment + kGoodExperiment)).find("bytes"),
            std::string::npos);
  std::string keys;
  for (int i = 0; i < 2000; ++i) keys.append("k").append(std::to_string(i)).append(": 1\n");
  EXPECT_NE(refusal(folder.write("keys.yaml", keys)), "");
}

TEST(HostileYaml, WhatIsNoFileIsRefused) {
  const TestFolder folder;
  EXPECT_NE(refusal(folder.path() / "missing.yaml").find("no such file"), std::string::npos);
  EXPECT_NE(refusal(folder.path()).find("a folder"), std::string::npos);
  const auto pipe = folder.path() / "pipe.yaml";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_NE(refusal(pipe).find("a pipe"), std::string::npos) << "nobody writes to it";
  EXPECT_NE(refusal("").find("no such file"), std::string::npos);
  EXPECT_NE(refusal("/dev/zero"), "");
  EXPECT_NE(refusal(folder.write("empty.yaml", "")).find("sections"), std::string::npos);
  EXPECT_NE(refusal(folder.write("comment.yaml", "# nothing\n")), "");
  EXPECT_NE(refusal(folder.write("word.yaml", "hello\n")), "");
  EXPECT_NE(refusal(folder.write("list.yaml", "- 1\n- 2\n")), "");
  EXPECT_NE(refusal(folder.write("two.yaml", std::string(kGoodExperiment) + "---\na: 1\n")), "");
  EXPECT_NE(refusal(folder.write("nul.yaml", std::string("name: a\0b\n", 10))), "");
  EXPECT_NE(
      refusal(folder.write("utf16.yaml", std::string("\xff\xfen\0a\0m\0e\0:\0 \0a\0\n\0", 18))),
      "");
}

TEST(HostileYaml, WindowsLineEndsAreFine) {
  const TestFolder folder;
  std::string text;
  for (const char c : std::string(kGoodExperiment)) {
    if (c == '\n') text += '\r';
    text += c;
  }
  EXPECT_EQ(refusal(folder.write("crlf.yaml", text)), "");
}

TEST(HostileYaml, IncludesAreBounded) {
  const TestFolder folder;
  EXPECT_NE(refusal(folder.write("self.yaml", "include: self.yaml\n")).find("circle"),
            std::string::npos);
  folder.write("ping.yaml", "include: pong.yaml\n");
  EXPECT_NE(refusal(folder.write("pong.yaml", "include: ping.yaml\n")).find("circle"),
            std::string::npos);
  EXPECT_NE(refusal(folder.write("gone.yaml", "a: 1\ninclude: nowhere.yaml\n")).find(":2: include"),
            std::string::npos);
  EXPECT_NE(refusal(folder.write("list.yaml", "include: [a, b]\n")).find("name of a file"),
            std::string::npos);
  EXPECT_NE(refusal(folder.write("folder.yaml", "include: .\n")).find("existing file"),
            std::string::npos);
}

/// Random damage to a good file: bytes replaced, deleted, inserted, runs doubled.
TEST(HostileYaml, RandomDamageNeverEscapes) {
  const TestFolder folder;
  std::mt19937 random(20240501);
  const std::string alphabet = ":-[]{}#&*!|>'\"%@`,?\n \t\r0123456789.eE+pi/~\x01\x7f\xff";
  const auto below = [&random](std::size_t n) { return static_cast<std::size_t>(random() % n); };
  int accepted = 0;
  for (int round = 0; round < 3000; ++round) {
    std::string text = kGoodExperiment;
    const std::size_t wounds = 1 + below(4);
    for (std::size_t i = 0; i < wounds; ++i) {
      const std::size_t at = below(text.size());
      const std::size_t kind = below(4);
      if (kind == 0) text[at] = alphabet[below(alphabet.size())];
      if (kind == 1) text.erase(at, 1 + below(10));
      if (kind == 2) text.insert(at, 1, alphabet[below(alphabet.size())]);
      if (kind == 3) text.insert(at, text.substr(below(text.size()), below(40)));
    }
    if (refusal(folder.write("damaged.yaml", text)).empty()) ++accepted;
  }
  EXPECT_LT(accepted, 1500);  // most damage is noticed; some only changes a number
}

}  // namespace
}  // namespace softarm
