// A client on a port of the test, and its peer on the other side of the wire.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "own_url.hpp"
#include "softarm/client/arm_client.hpp"
#include "softarm/config/load.hpp"
#include "softarm/transport/message_decoding.hpp"
#include "unit/transport/messages.hpp"

namespace softarm::test {

inline constexpr double kPatience_s = 20.0;  ///< for what comes at once, on a machine that is busy

class ClientTest : public ::testing::Test {
 protected:
  ClientTest() {
    experiment.transport.lcm.url = own_url();
    experiment.transport.lcm.deadman_channel = "SOFTARM_GO";
    experiment.actuation.max_pressure_bar = 1.5;
    experiment.actuation.slew_bar_per_s = 4.0;
  }
  void SetUp() override {
    try {
      peer = std::make_unique<LcmNode>(lcm.url);
      client = make_client();
    } catch (const TransportError& error) {
      GTEST_SKIP() << error.what();
    }
  }
  virtual std::unique_ptr<ArmClient> make_client() {
    return std::make_unique<ArmClient>(experiment);
  }

  /// Handles messages until `reached`; on the client's side and on the other.
  bool wait_for(const std::function<bool()>& reached) {
    return client->wait_for(
        [&] {
          peer->drain(1000);
          return reached();
        },
        kPatience_s);
  }

  softarm_messages::controller_status_t status(Mode mode, Reason reason,
                                               std::int16_t flags = 0) const {
    auto message = example<softarm_messages::controller_status_t>(1, 3);
    message.mode = static_cast<std::int8_t>(mode);
    message.reason = static_cast<std::int8_t>(reason);
    message.flags = flags;
    return message;
  }
  void publish_status(Mode mode, Reason reason, std::int16_t flags = 0) {
    peer->publish(lcm.status_channel, status(mode, reason, flags));
  }
  template <class Message>
  std::shared_ptr<std::vector<Message>> peer_hears(const std::string& channel) {
    auto heard = std::make_shared<std::vector<Message>>();
    peer->subscribe(channel, 4096, [heard](const ReceivedMessage& packet) {
      if (Message message; decode(packet.bytes, message)) heard->push_back(message);
    });
    return heard;
  }

  Experiment experiment = load_experiment(SOFTARM_SOURCE_DIR "/config/one_segment.yaml");
  const LcmSettings& lcm = experiment.transport.lcm;
  std::unique_ptr<LcmNode> peer;
  std::unique_ptr<ArmClient> client;
};

}  // namespace softarm::test
