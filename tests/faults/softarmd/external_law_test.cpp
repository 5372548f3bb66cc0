// A control law in a separate process: softarmd moves the arm by its answers, holds and vents when
// they stop, and takes none that was recorded.
#include "faults/softarmd/fault_test.hpp"
#include "softarm/base/clock.hpp"
#include "softarm/transport/lcm_node.hpp"

namespace softarm {
namespace {

using test::FaultTest;
using test::Process;

class ExternalLawFaults : public FaultTest {
 protected:
  void configure_law() {
    // Patience for a busy machine: the answers of a law that is held up for a moment still count.
    configure(*this, ", law_validity_s: 0.3, law_vent_after_s: 0.3", "",
              "control: {law: external}\n");
  }
  /// Answers for ten minutes; each is valid for `validity_s`.
  std::unique_ptr<Process> start_law() {
    return start_as_is("example_external_law", {config_.string(), "600", "0.3"});
  }
};

TEST_P(ExternalLawFaults, ItMovesTheArmAndItsSilenceHoldsAndVents) {
  configure_law();
  const auto plant = start_plant(*this);
  const auto daemon = start("softarmd");
  ASSERT_TRUE(wait_for([&] {
    return mode() == Mode::wait_frames && reason() == Reason::law_silent;
  })) << seen_text()
      << daemon->printed();
  const auto law = start_law();
  ASSERT_TRUE(wait_for([&] { return under_pressure(); })) << seen_text() << law->printed();
  EXPECT_TRUE(stays_active(*this));
  EXPECT_GT(status_.law_answers[0], 20);
  EXPECT_GT(status_.law_round_trip_s, 0.0);

  forget();
  law->signal(SIGSTOP);
  EXPECT_TRUE(wait_for([&] { return saw(Mode::hold, Reason::law_late); })) << seen_text();
  EXPECT_TRUE(becomes(*this, Mode::vent, Reason::law_silent)) << seen_text();
  EXPECT_TRUE(wait_for([&] { return largest(plant_.pressure_bar) < 0.01; }));

  law->signal(SIGCONT);  // with what it has not answered yet in its queue
  EXPECT_TRUE(wait_for([&] { return under_pressure(); })) << seen_text();
  law->signal(SIGKILL);
  EXPECT_TRUE(becomes(*this, Mode::vent, Reason::law_silent)) << seen_text();
  EXPECT_TRUE(all_finite_);
  EXPECT_GE(lowest_bar_, 0.0);
  EXPECT_LE(highest_bar_, load_experiment(config_.string()).actuation.max_pressure_bar);
}

TEST_P(ExternalLawFaults, ARecordThatIsPlayedMovesNothing) {
  configure_law();
  const auto plant = start_plant(*this);
  const auto daemon = start("softarmd");
  const auto law = start_law();
  // Answers as they were on the wire, to be played later.
  std::vector<std::vector<std::byte>> record;
  LcmNode player(url_);
  player.subscribe("SOFTARM_LAW", 64, [&](const ReceivedMessage& packet) {
    if (record.size() < 200) record.emplace_back(packet.bytes.begin(), packet.bytes.end());
  });
  ASSERT_TRUE(wait_for([&] {
    player.wait_until(monotonic_now_ns());
    return under_pressure() && record.size() == 200;
  })) << seen_text()
      << law->printed();
  law->signal(SIGKILL);
  ASSERT_TRUE(becomes(*this, Mode::vent, Reason::law_silent)) << seen_text();
  go_on(1.2);  // longer than a nonce counts
  const auto refused = static_cast<std::size_t>(LawVerdict::not_recent);
  const std::int64_t before = status_.law_answers[refused], accepted = status_.law_answers[0];
  for (const auto& bytes : record) {
    player.publish_encoded("SOFTARM_LAW", bytes);
    go_on(0.005);
  }
  EXPECT_TRUE(wait_for([&] { return status_.law_answers[refused] > before + 100; })) << seen_text();
  EXPECT_EQ(status_.law_answers[0], accepted);
  EXPECT_EQ(mode(), Mode::vent);
  EXPECT_EQ(largest(command_.pressure_bar), 0.0);
}

SOFTARM_ON_BOTH_MACHINES(ExternalLawFaults);

}  // namespace
}  // namespace softarm
