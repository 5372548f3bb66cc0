// The network of files that load_experiment refuses.
#include "softarm/config/network_search.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <string>

#include "test_folder.hpp"

namespace softarm {
namespace {

class NetworkSearch : public ::testing::Test {
 protected:
  std::filesystem::path write(const std::string& name, const std::string& text) const {
    return folder_.write(name, text);
  }
  TestFolder folder_;
};

TEST_F(NetworkSearch, ReadsWhatStandsInBrokenYaml) {
  const LcmSettings lcm = find_network(write("broken.yaml",
                                             "name: [never closed\n"
                                             "daemon:\n"
                                             "  lcm: {url: \"udpm://239.1.2.3:4567?ttl=0\", "
                                             "operator_channel: STOP}\n"
                                             "#  lcm: {status_channel: COMMENTED}\n"
                                             "  curl: other\n"
                                             "  my_url: other\n"));
  EXPECT_EQ(lcm.url, "udpm://239.1.2.3:4567?ttl=0");
  EXPECT_EQ(lcm.operator_channel, "STOP");
  EXPECT_EQ(lcm.status_channel, LcmSettings().status_channel);
}

TEST_F(NetworkSearch, FollowsIncludesAndWhatComesLaterCounts) {
  write("base.yaml", "daemon:\n  lcm:\n    url: 'udpm://239.1.1.1:1'\n    status_channel: HERE\n");
  const LcmSettings lcm = find_network(
      write("top.yaml", "include: base.yaml\ntypo: 1\ndaemon: {lcm: {url: udpm://239.1.1.2:2}}\n"));
  EXPECT_EQ(lcm.url, "udpm://239.1.1.2:2");
  EXPECT_EQ(lcm.status_channel, "HERE");
}

TEST_F(NetworkSearch, FollowsIncludesBesideTheFileBehindALink) {
  std::filesystem::create_directories(folder_ / "real");
  write("real/base.yaml", "daemon: {lcm: {url: \"udpm://239.1.1.5:5\"}}\n");
  write("real/arm.yaml", "include: base.yaml\n");
  std::filesystem::create_symlink("real/arm.yaml", folder_ / "link.yaml");
  EXPECT_EQ(find_network(folder_ / "link.yaml").url, "udpm://239.1.1.5:5");
}

TEST_F(NetworkSearch, EndsWhereFilesIncludeOneAnotherOrAreNotThere) {
  const LcmSettings lcm =
      find_network(write("round.yaml", "include: round.yaml\nurl: udpm://239.1.1.3:3\n"));
  EXPECT_EQ(lcm.url, "udpm://239.1.1.3:3");
  EXPECT_EQ(find_network(folder_ / "missing.yaml").url, LcmSettings().url);
  // So many readings as would last for hours.
  std::string often;
  for (int k = 0; k < 12; ++k) often += "include: often.yaml\n";
  EXPECT_EQ(find_network(write("often.yaml", often + "url: udpm://239.1.1.4:4\n")).url,
            "udpm://239.1.1.4:4");
  const std::filesystem::path pipe = folder_ / "pipe.yaml";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(find_network(pipe).url, LcmSettings().url);
}

}  // namespace
}  // namespace softarm
