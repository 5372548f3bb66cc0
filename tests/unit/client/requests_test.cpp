// What is asked of a daemon, again and again until its status shows it, and references to it.
#include <atomic>
#include <limits>
#include <thread>

#include "unit/client/client_test.hpp"

namespace softarm {
namespace {

using namespace softarm_messages;

/// A daemon that reports its state 200 times a second and loses requests.
class Daemon {
 public:
  Daemon(const LcmSettings& lcm, controller_status_t status, int deaf_to)
      : lcm_(lcm), node_(lcm.url), status_(std::move(status)), deaf_to_(deaf_to) {
    node_.subscribe(lcm.operator_channel, 1000, [this](const ReceivedMessage& packet) {
      operator_command_t request;
      if (!decode(packet.bytes, request)) return;
      requests_.push_back(request);
      if (static_cast<int>(requests_.size()) > deaf_to_) answer(request.request);
    });
    thread_ = std::thread([this] {
      while (!stop_) {
        status_.nonce = ++nonce_;
        node_.publish(lcm_.status_channel, status_);
        node_.wait_until(monotonic_now_ns() + 5'000'000);
      }
    });
  }
  ~Daemon() { end(); }
  void end() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
  }
  /// After `end`.
  /// The one that the client echoed first: it must echo this one all the time.
  std::int64_t first_nonce() const {
    for (const operator_command_t& each : requests_)
      if (each.nonce != 0) return each.nonce;
    return 0;
  }
  const std::vector<operator_command_t>& requests() const { return requests_; }

 private:
  void answer(std::int8_t request) {
    const bool faulty = status_.mode == static_cast<int>(Mode::fault);
    if (request == operator_command_t::ARM && !faulty) status_.flags = controller_status_t::ARMED;
    if (request == operator_command_t::DISARM) set(Mode::vent, Reason::disarmed);
    if (request == operator_command_t::EMERGENCY_STOP) set(Mode::fault, Reason::emergency_stop);
  }
  void set(Mode mode, Reason reason) {
    status_.mode = static_cast<std::int8_t>(mode);
    status_.reason = static_cast<std::int8_t>(reason);
    status_.flags = 0;
  }

  LcmSettings lcm_;
  LcmNode node_;
  controller_status_t status_;
  int deaf_to_;
  std::int64_t nonce_ = 1000;
  std::vector<operator_command_t> requests_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

class Requests : public test::ClientTest {
 protected:
  /// What a daemon answers that is heard at all: a busy machine may not let it speak in time.
  RequestOutcome answer(OperatorRequest what) {
    for (int k = 0; k < 50; ++k)
      if (const RequestOutcome outcome = client->request(what, 0.3);
          outcome != RequestOutcome::unheard)
        return outcome;
    return RequestOutcome::unheard;
  }
};

TEST_F(Requests, AreRepeatedUntilTheStatusShowsThem) {
  struct Row {
    OperatorRequest what;
    std::int8_t on_the_wire;
    std::int16_t flags;
  };
  for (const Row& row :
       {Row{OperatorRequest::arm, operator_command_t::ARM, 0},
        Row{OperatorRequest::disarm, operator_command_t::DISARM, controller_status_t::ARMED},
        Row{OperatorRequest::emergency_stop, operator_command_t::EMERGENCY_STOP,
            controller_status_t::ARMED}}) {
    SCOPED_TRACE(int{row.on_the_wire});
    Daemon daemon(lcm, status(Mode::active, Reason::none, row.flags), 2);
    EXPECT_EQ(client->request(row.what, test::kPatience_s), RequestOutcome::done);
    daemon.end();
    ASSERT_GE(daemon.requests().size(), 3u) << "the daemon missed two";
    EXPECT_EQ(daemon.requests().back().nonce, daemon.first_nonce());
    for (std::size_t k = 0; k < daemon.requests().size(); ++k) {
      EXPECT_EQ(daemon.requests()[k].request, row.on_the_wire);
      if (k == 0) continue;
      EXPECT_EQ(daemon.requests()[k].sequence, daemon.requests()[k - 1].sequence);
    }
  }
}

TEST_F(Requests, AnArmDuringAFaultIsRefused) {
  Daemon daemon(lcm, status(Mode::fault, Reason::valves_silent), 0);
  EXPECT_EQ(answer(OperatorRequest::arm), RequestOutcome::refused);
  ASSERT_TRUE(client->status());
  EXPECT_EQ(client->daemon_text(), "FAULT (valves_silent)");
}

TEST_F(Requests, AFaultForAnotherReasonIsNoEmergencyStop) {
  Daemon daemon(lcm, status(Mode::fault, Reason::valves_silent), 1'000'000);
  EXPECT_EQ(answer(OperatorRequest::emergency_stop), RequestOutcome::refused);
  EXPECT_EQ(answer(OperatorRequest::disarm), RequestOutcome::refused)
      << "a FAULT that stays is not acknowledged";
}

TEST_F(Requests, WithoutADaemonNobodyIsHeard) {
  // A status from before the request is not an answer, nor is a shadow's.
  publish_status(Mode::active, Reason::none, controller_status_t::ARMED);
  std::thread shadow([this] {
    for (int k = 0; k < 20; ++k) {
      publish_status(Mode::active, Reason::none,
                     controller_status_t::ARMED | controller_status_t::SHADOW);
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  });
  ASSERT_TRUE(client->wait_for_status(test::kPatience_s));
  EXPECT_EQ(client->request(OperatorRequest::arm, 0.3), RequestOutcome::unheard);
  shadow.join();
}

TEST_F(Requests, GoesCountUpAndAreTakenBack) {
  const auto goes = peer_hears<deadman_t>(lcm.deadman_channel);
  publish_status(Mode::active, Reason::none);
  ASSERT_TRUE(client->wait_for_status(test::kPatience_s));
  for (const bool go : {true, true, false}) client->send_go(go);
  ASSERT_TRUE(wait_for([&] { return goes->size() == 3; }));
  EXPECT_EQ((*goes)[0].go, 1);
  EXPECT_EQ((*goes)[2].go, 0);
  EXPECT_EQ((*goes)[0].nonce, client->status()->nonce);
  EXPECT_LT((*goes)[0].sequence, (*goes)[1].sequence);
  EXPECT_LT((*goes)[1].sequence, (*goes)[2].sequence);
  LcmSettings without = lcm;
  without.deadman_channel.clear();
  OperatorClient other(without);
  EXPECT_THROW(other.send_go(true), std::logic_error);
}

TEST_F(Requests, TheNamesOfTheChannelsAreEnough) {
  OperatorClient other(lcm);
  Daemon daemon(lcm, test::example<controller_status_t>(7, 4), 0);
  EXPECT_EQ(other.request(OperatorRequest::emergency_stop, test::kPatience_s),
            RequestOutcome::done);
  EXPECT_EQ(other.status()->segments(), 7);
}

TEST_F(Requests, AReferenceIsTwoFiniteNumbersASegmentThreeTimes) {
  const auto heard = peer_hears<curvature_reference_t>(lcm.reference_channel);
  const Eigen::Vector2d u(0.1, -0.2), velocity(0.3, 0.4), acceleration(5.0, 6.0);
  Eigen::Vector2d broken = velocity;
  broken[1] = std::numeric_limits<double>::quiet_NaN();
  const Eigen::Vector3d three = Eigen::Vector3d::Zero();
  EXPECT_THROW(client->send_reference(three, velocity, acceleration), std::invalid_argument);
  EXPECT_THROW(client->send_reference(u, three, acceleration), std::invalid_argument);
  EXPECT_THROW(client->send_reference(u, velocity, Eigen::VectorXd()), std::invalid_argument);
  EXPECT_THROW(client->send_reference(u, broken, acceleration), std::invalid_argument);
  client->send_reference(u, velocity, acceleration);
  client->send_reference(u, velocity, acceleration);
  ASSERT_TRUE(wait_for([&] { return heard->size() == 2; }));
  EXPECT_EQ((*heard)[0].u_rad, (std::vector<double>{0.1, -0.2}));
  EXPECT_EQ((*heard)[0].velocity_radps, (std::vector<double>{0.3, 0.4}));
  EXPECT_EQ((*heard)[0].acceleration_radps2, (std::vector<double>{5.0, 6.0}));
  EXPECT_GT((*heard)[1].sequence, (*heard)[0].sequence);
}

}  // namespace
}  // namespace softarm
