// One arm, one lock, however its LCM network is written.
#include <gtest/gtest.h>

#include "softarm/transport/lcm_node.hpp"

namespace softarm {
namespace {

TEST(LockName, EverySpellingOfANetworkIsOneName) {
  const std::string name = lock_name("C", "udpm://239.255.76.67:7667?ttl=0");
  EXPECT_EQ(name, "C on udpm://239.255.76.67:7667");
  for (const char* url :
       {"udpm://", "udpm://?ttl=1", "udpm://239.255.76.67:7667?ttl=1&recv_buf_size=9",
        "udpm://239.255.0114.67:016763", "udpm://0xef.255.19523:0x1df3"})
    EXPECT_EQ(lock_name("C", url), name) << url;
  for (const char* url : {"udpm://239.255.76.68:7667", "udpm://239.255.76.67:7668", "memq://"})
    EXPECT_NE(lock_name("C", url), name) << url;
  EXPECT_NE(lock_name("D", "udpm://"), name);
}

}  // namespace
}  // namespace softarm
