// softarmd and softarm-plant as processes of their own, talking LCM over UDP multicast on a port of
// the test's own.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <functional>

#include "integration/processes/process.hpp"
#include "softarm/config/load.hpp"
#include "softarm/daemon/realtime.hpp"
#include "softarm/daemon/safety_monitor.hpp"
#include "softarm/transport/lcm_node.hpp"
#include "softarm/transport/message_decoding.hpp"

namespace softarm {
namespace {

using namespace std::chrono_literals;
using test::Process;

constexpr std::int64_t kSecond = 1'000'000'000;

class Processes : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() /
              ("softarm_" + std::to_string(getpid()) + "_" +
               ::testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::create_directories(folder_);
    // A port of its own, so that tests may run side by side.
    url_ = "udpm://239.255.76.67:" + std::to_string(20000 + getpid() % 40000) + "?ttl=0";
    write_config("paper_arm.yaml", "");
    try {
      node_ = std::make_unique<LcmNode>(url_);
      node_->subscribe("SOFTARM_STATUS", 4096, [this](const ReceivedMessage& packet) {
        if (decode(packet.bytes, status_)) ++statuses_;
      });
      node_->subscribe("SOFTARM_PLANT", 4096, [this](const ReceivedMessage& packet) {
        if (decode(packet.bytes, plant_)) ++plant_states_;
      });
      node_->subscribe("SOFTARM_PRESSURE_COMMAND", 4096, [this](const ReceivedMessage& packet) {
        if (decode(packet.bytes, command_)) ++commands_;
      });
    } catch (const TransportError& error) {
      GTEST_SKIP() << error.what();
    }
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  /// `more` is indented YAML that belongs under `daemon:`.
  void write_config(const char* base, const std::string& more) {
    config_ = folder_ / "config.yaml";
    std::ofstream(config_) << "include: "
                           << std::filesystem::path(SOFTARM_SOURCE_DIR) / "config" / base
                           << "\nname: under_test\ndaemon:\n  lcm: {url: \"" << url_ << "\"}\n"
                           << more;
  }

  std::unique_ptr<Process> start(const char* program, std::vector<std::string> arguments = {}) {
    arguments.push_back(config_.string());
    return std::make_unique<Process>(
        program, arguments,
        (folder_ / (std::string(program) + std::to_string(started_++))).string());
  }

  /// Handles messages until `reached`, or `patience_s` have passed; says which.
  bool wait_for(const std::function<bool()>& reached, double patience_s = 10.0) {
    const std::int64_t end_ns = monotonic_now_ns() + static_cast<std::int64_t>(patience_s * 1e9);
    while (monotonic_now_ns() < end_ns) {
      if (reached()) return true;
      node_->wait_until(monotonic_now_ns() + kSecond / 100);
    }
    return reached();
  }

  Mode mode() const { return statuses_ > 0 ? static_cast<Mode>(status_.mode) : Mode::init; }
  Reason reason() const { return static_cast<Reason>(status_.reason); }
  float largest(const std::vector<float>& pressures) const {
    return pressures.empty() ? 0.0F : *std::max_element(pressures.begin(), pressures.end());
  }
  bool under_pressure() const {
    return mode() == Mode::active && largest(plant_.pressure_bar) > 0.1F;
  }

  std::filesystem::path folder_, config_;
  std::string url_;
  std::unique_ptr<LcmNode> node_;
  softarm_messages::controller_status_t status_{};
  softarm_messages::plant_state_t plant_{};
  softarm_messages::pressure_command_t command_{};
  int statuses_ = 0, plant_states_ = 0, commands_ = 0, started_ = 0;
};

TEST_F(Processes, CloseTheLoopAndEndInGoodOrder) {
  const auto plant = start("softarm-plant");
  const auto daemon = start("softarmd");
  ASSERT_TRUE(wait_for([&] { return under_pressure(); })) << daemon->printed() << plant->printed();
  EXPECT_EQ(status_.num_segments, 3);
  EXPECT_EQ(status_.num_chambers, 12);
  EXPECT_NE(status_.configuration_hash, 0);
  // Two seconds into (24) every segment is bent by 0.4 rad.
  ASSERT_TRUE(wait_for([&] {
    return mode() == Mode::active && plant_.num_segments == 3 &&
           std::abs(std::hypot(plant_.u_rad[2][0], plant_.u_rad[2][1]) - 0.4) < 0.05;
  })) << daemon->printed();

  daemon->signal(SIGTERM);
  EXPECT_EQ(daemon->wait(1000ms), 0) << daemon->printed();
  ASSERT_TRUE(wait_for([&] { return plant_.vented != 0 && largest(plant_.pressure_bar) < 1e-3F; }));
  EXPECT_EQ(largest(command_.pressure_bar), 0.0F) << "the last command is vent";
  plant->signal(SIGTERM);
  EXPECT_EQ(plant->wait(1000ms), 0) << plant->printed();
}

TEST_F(Processes, KillingTheDaemonLeavesThePlantVented) {
  const auto plant = start("softarm-plant");
  const auto daemon = start("softarmd");
  ASSERT_TRUE(wait_for([&] { return under_pressure(); })) << daemon->printed();
  daemon->signal(SIGKILL);
  EXPECT_EQ(daemon->wait(1000ms), 128 + SIGKILL);
  EXPECT_GT(largest(command_.pressure_bar), 0.0F) << "nobody told the plant to vent";
  EXPECT_TRUE(wait_for([&] { return plant_.vented != 0 && largest(plant_.pressure_bar) < 1e-3F; }))
      << plant->printed();
}

TEST_F(Processes, StoppingThePlantMakesTheDaemonVent) {
  const auto plant = start("softarm-plant");
  const auto daemon = start("softarmd");
  ASSERT_TRUE(wait_for([&] { return under_pressure(); })) << daemon->printed();
  plant->signal(SIGKILL);
  ASSERT_TRUE(wait_for([&] { return mode() == Mode::vent; })) << daemon->printed();
  EXPECT_EQ(reason(), Reason::frames_stale);
  EXPECT_TRUE(wait_for([&] { return largest(command_.pressure_bar) == 0.0F; }));
  // A new plant counts its frames anew; with automatic arming the daemon comes back once that one
  // has proven itself.
  const auto another = start("softarm-plant");
  EXPECT_TRUE(wait_for([&] { return mode() == Mode::active; })) << daemon->printed();
}

TEST_F(Processes, AStoppedAndContinuedDaemonVents) {
  const auto plant = start("softarm-plant");
  const auto daemon = start("softarmd");
  ASSERT_TRUE(wait_for([&] { return under_pressure(); })) << daemon->printed();
  daemon->signal(SIGSTOP);
  ASSERT_TRUE(wait_for([&] { return plant_.vented != 0; })) << "expired commands vent";
  daemon->signal(SIGCONT);
  EXPECT_TRUE(wait_for([&] { return mode() == Mode::vent && reason() == Reason::time_gap; }))
      << daemon->printed();
  EXPECT_TRUE(wait_for([&] { return mode() == Mode::active; })) << daemon->printed();
}

TEST_F(Processes, ExplicitArmingWaitsForArmAndObeysDisarm) {
  write_config("paper_arm.yaml", "  safety: {arming: explicit}\n");
  const auto plant = start("softarm-plant");
  const auto daemon = start("softarmd");
  ASSERT_TRUE(wait_for([&] { return reason() == Reason::waiting_for_arm; })) << daemon->printed();
  EXPECT_FALSE(wait_for([&] { return mode() == Mode::active; }, 0.5));
  EXPECT_EQ(start("softarm", {"arm"})->wait(5000ms), 0);
  ASSERT_TRUE(wait_for([&] { return under_pressure(); })) << daemon->printed();
  EXPECT_EQ(start("softarm", {"disarm"})->wait(5000ms), 0);
  EXPECT_TRUE(
      wait_for([&] { return mode() == Mode::vent && largest(command_.pressure_bar) == 0.0F; }));
  EXPECT_FALSE(wait_for([&] { return mode() == Mode::active; }, 0.5));
}

TEST_F(Processes, ASecondDaemonIsKeptOut) {
  const auto daemon = start("softarmd");
  ASSERT_TRUE(wait_for([&] { return statuses_ > 0; })) << daemon->printed();
  const auto second = start("softarmd");
  EXPECT_EQ(second->wait(5000ms), 75);
  EXPECT_NE(second->printed().find("another instance"), std::string::npos) << second->printed();
}

TEST_F(Processes, ShadowCommandsMoveNothing) {
  const auto plant = start("softarm-plant");
  const auto daemon = start("softarmd", {"--shadow"});
  ASSERT_TRUE(
      wait_for([&] { return mode() == Mode::active && largest(command_.pressure_bar) > 0.1F; }));
  EXPECT_NE(command_.shadow, 0);
  EXPECT_NE(plant_.vented, 0);
  EXPECT_EQ(largest(plant_.pressure_bar), 0.0F);
}

TEST_F(Processes, HostileBytesAreCountedAndHarmless) {
  const auto plant = start("softarm-plant");
  const auto daemon = start("softarmd");
  ASSERT_TRUE(wait_for([&] { return under_pressure(); })) << daemon->printed();
  const int before = status_.messages_malformed;
  // A raw LCM packet of our own making: magic, sequence number, channel, then whatever we like.
  struct Bytes {
    std::vector<unsigned char> bytes;
    int encode(void* buffer, int offset, int size) const {
      if (static_cast<int>(bytes.size()) > size - offset) return -1;
      std::copy(bytes.begin(), bytes.end(), static_cast<unsigned char*>(buffer) + offset);
      return static_cast<int>(bytes.size());
    }
  };
  unsigned char hash[8];
  for (int k = 0; k < 8; ++k)
    hash[k] = static_cast<unsigned char>(
        static_cast<std::uint64_t>(softarm_messages::mocap_frame_t::getHash()) >> (56 - 8 * k));
  std::vector<Bytes> hostile{{{}}, {{1, 2, 3}}, {std::vector<unsigned char>(1000, 0xff)}};
  for (const int length :
       {-1, 0x7fff, 1, 300}) {  // a frame with that many bodies and none of them there
    Bytes frame{{hash, hash + 8}};
    frame.bytes.resize(24, 0);
    frame.bytes.push_back(static_cast<unsigned char>(length >> 8));
    frame.bytes.push_back(static_cast<unsigned char>(length));
    hostile.push_back(frame);
  }
  for (int round = 0; round < 20; ++round)
    for (const char* channel :
         {"SOFTARM_MOCAP", "SOFTARM_REFERENCE", "SOFTARM_OPERATOR", "SOFTARM_PRESSURE_COMMAND"})
      for (const Bytes& bytes : hostile) node_->publish(channel, bytes);
  EXPECT_TRUE(wait_for([&] { return status_.messages_malformed > before + 20; }))
      << daemon->printed();
  EXPECT_TRUE(wait_for([&] { return under_pressure(); })) << daemon->printed();
  daemon->signal(SIGTERM);
  EXPECT_EQ(daemon->wait(1000ms), 0) << daemon->printed();
}

TEST_F(Processes, MessagesThatCannotBePrintedEndNothing) {
  const Process plant("softarm-plant", {config_.string()}, "/dev/full");
  Process daemon("softarmd", {config_.string()}, "/dev/full");
  ASSERT_TRUE(wait_for([&] { return under_pressure(); }));
  daemon.signal(SIGTERM);
  EXPECT_EQ(daemon.wait(1000ms), 0);
  EXPECT_TRUE(wait_for([&] { return plant_.vented != 0; }));
}

TEST_F(Processes, AStoppedAndContinuedPlantIsSimulatedOn) {
  const auto plant = start("softarm-plant");
  const auto daemon = start("softarmd");
  ASSERT_TRUE(wait_for([&] { return under_pressure(); })) << daemon->printed();
  plant->signal(SIGSTOP);
  ASSERT_TRUE(wait_for([&] { return mode() == Mode::vent; })) << daemon->printed();
  wait_for([] { return false; }, 1.0);
  plant->signal(SIGCONT);
  EXPECT_TRUE(wait_for([&] { return under_pressure(); })) << daemon->printed();
  EXPECT_NE(plant->printed().find("behind real time"), std::string::npos) << plant->printed();
  plant->signal(SIGTERM);
  EXPECT_EQ(plant->wait(1000ms), 0) << plant->printed();
}

TEST_F(Processes, WatchRecordsWhatRunWouldWrite) {
  const auto plant = start("softarm-plant");
  const auto daemon = start("softarmd");
  const auto out = folder_ / "record";
  const auto watch = start("softarm", {"watch", "--duration", "2", "--out", out.string()});
  ASSERT_EQ(watch->wait(20s), 0) << watch->printed() << daemon->printed();
  for (const char* name : {"log.csv", "summary.json", "timing.json"})
    EXPECT_TRUE(std::filesystem::exists(out / name));
  std::ifstream log(out / "log.csv");
  std::string provenance;
  std::getline(log, provenance);
  EXPECT_NE(provenance.find("configuration " + hash_text(load_experiment(config_).hash)),
            std::string::npos);
}

}  // namespace
}  // namespace softarm
