// Faults of the frames, made by the injector between the plant and a running softarmd.
#include "faults/softarmd/fault_test.hpp"

namespace softarm {
namespace {

using test::FaultTest;
using test::Process;

class FrameFaults : public FaultTest {
 protected:
  void SetUp() override {
    FaultTest::SetUp();
    if (IsSkipped()) return;
    configure(*this);
    relay_ = start_relay(*this);
    plant_process_ = start_plant(*this, kSensorSuffix);
    daemon_ = start("softarmd");
    arm_when_asked();
    ASSERT_TRUE(wait_for([&] { return under_pressure(); }))
        << daemon_->printed() << plant_process_->printed();
  }

  void inject(const std::string& name, double amount = 0.0, int body = 2) {
    Fault fault = *find_fault(name);
    if (amount != 0.0) fault.amount = amount;
    fault.body = body;
    forget();
    relay_->set(fault);
  }
  /// All is well again, and the daemon ACTIVE.
  void recovers() {
    relay_->set({});
    EXPECT_TRUE(stays_active(*this, 10)) << seen_text() << daemon_->printed();
  }

  std::unique_ptr<FaultRelay> relay_;
  std::unique_ptr<Process> plant_process_, daemon_;
};

// Frames that stay away, for whatever reason: the pressures are frozen, then vented.
TEST_P(FrameFaults, WithoutGoodFramesTheDaemonHoldsThenVents) {
  struct Row {
    const char* fault;
    double amount;
    bool rejected;              ///< the frames came and are counted as refused
    FrameVerdict refusal = {};  ///< that names itself; accepted: none
  };
  for (const Row& row :
       {Row{"stop", 0.0, false}, Row{"occlude", 0.0, false},
        Row{"nan", 0.0, true, FrameVerdict::not_finite},
        Row{"inf", 0.0, true, FrameVerdict::not_finite},
        Row{"quaternion", 0.0, true, FrameVerdict::bad_quaternion},
        Row{"length", 0.0, true, FrameVerdict::bad_length},
        Row{"turn", 1.5708, true, FrameVerdict::bad_torsion},
        Row{"turn", 2.0944, true, FrameVerdict::bad_torsion},
        Row{"swap", 0.0, true, FrameVerdict::bad_length}, Row{"delay", 0.3, true}}) {
    SCOPED_TRACE(row.fault);
    const std::int64_t rejected = status_.frames_rejected;
    inject(row.fault, row.amount);
    const bool named = row.refusal != FrameVerdict::accepted;
    EXPECT_TRUE(becomes(*this, Mode::vent, named ? Reason::frames_refused : Reason::frames_stale))
        << seen_text() << daemon_->printed();
    EXPECT_TRUE(saw(Mode::hold, named ? Reason::frames_refused : Reason::frames_late))
        << seen_text();
    EXPECT_TRUE(wait_for([&] { return largest(command_.pressure_bar) == 0.0F; })) << seen_text();
    if (named) {
      EXPECT_EQ(status_.refusal, row.refusal) << name(status_.refusal);
      EXPECT_TRUE(wait_for([&] {
        const std::string printed = daemon_->printed();
        return printed.find(std::string("VENT (frames_refused: ") + name(row.refusal)) !=
                   std::string::npos &&
               printed.find(std::string(" ") + name(row.refusal)) != std::string::npos;
      })) << daemon_->printed();
    }
    if (row.rejected) {
      EXPECT_TRUE(wait_for([&] { return status_.frames_rejected > rejected + 5; }));
    } else {
      const std::int64_t before = status_.frames_rejected;
      const int statuses = statuses_;
      EXPECT_TRUE(wait_for([&] { return statuses_ > statuses + 50; }));  // 20 frames
      EXPECT_LT(status_.frames_rejected, before + 5);
    }
    recovers();
  }
  expect_limits(*this);
}

// A sender that has lost one body, and sends its last pose for valid.
TEST_P(FrameFaults, OneFrozenBodyHoldsThenVents) {
  for (const int body : {1, 2, 3}) {
    SCOPED_TRACE(body);
    inject("stale", 0.0, body);
    EXPECT_TRUE(wait_for([&] { return mode() == Mode::vent; })) << seen_text();
    EXPECT_TRUE(saw(Mode::hold, Reason::frames_late)) << seen_text();
    EXPECT_TRUE(wait_for([&] {
      return daemon_->printed().find("in which a body repeats an old pose") != std::string::npos;
    })) << daemon_->printed();
    recovers();
  }
  expect_limits(*this);
}

// A second sender on the frames' channel, with other numbers.
TEST_P(FrameFaults, ASecondSenderIsReportedOnce) {
  const auto second = start("softarm-plant");
  EXPECT_TRUE(wait_for([&] {
    return daemon_->printed().find("two senders on SOFTARM_MOCAP?") != std::string::npos;
  })) << daemon_->printed();
  const int statuses = statuses_;
  EXPECT_TRUE(wait_for([&] { return statuses_ > statuses + 1500; }));  // three more seconds
  const std::string printed = daemon_->printed();
  EXPECT_EQ(printed.find("two senders"), printed.rfind("two senders")) << printed;
}

TEST_P(FrameFaults, WhatIsDroppedOrCompensatedDisturbsNothing) {
  struct Row {
    const char* fault;
    double amount;
    std::int64_t ArmStatus::*counter;
  };
  for (const Row& row : {Row{"duplicate", 0.0, &ArmStatus::frames_repeated},
                         Row{"reorder", 0.0, &ArmStatus::frames_rejected},
                         Row{"jump", 0.0, &ArmStatus::frames_rejected}}) {
    SCOPED_TRACE(row.fault);
    const std::int64_t before = status_.*row.counter;
    // Every other frame is refused, so a HOLD for another reason (a busy machine) would not end.
    bool undisturbed = false;
    for (int k = 0; k < 5 && !undisturbed; ++k) {
      inject(row.fault, row.amount);
      EXPECT_TRUE(wait_for([&] { return status_.*row.counter > before + 10; })) << seen_text();
      active_in_row_ = 0;
      undisturbed = wait_for([&] { return active_in_row_ >= 100; }, 1.0);
      recovers();
    }
    EXPECT_TRUE(undisturbed) << seen_text() << daemon_->printed();
  }

  // Late frames, within the bound: the age is known, u is predicted over it.
  const double age_s = status_.frame_age_s;
  inject("delay", 0.03);
  EXPECT_TRUE(wait_for([&] { return status_.frame_age_s > age_s + 0.02; })) << seen_text();
  EXPECT_TRUE(stays_active(*this)) << seen_text() << daemon_->printed();
  recovers();

  // The sender's clock is set forward, and with the end of the fault back.
  inject("clock", 3600.0);
  const std::int64_t accepted = status_.frames_accepted;
  EXPECT_TRUE(stays_active(*this)) << seen_text() << daemon_->printed();
  EXPECT_TRUE(wait_for([&] { return status_.frames_accepted > accepted + 40; }));
  recovers();
  EXPECT_TRUE(stays_active(*this)) << seen_text() << daemon_->printed();
  expect_limits(*this);
}

TEST_P(FrameFaults, FrozenPosesHoldAndARestartedSenderVents) {
  inject("freeze");
  EXPECT_TRUE(becomes(*this, Mode::hold, Reason::poses_frozen))
      << seen_text() << daemon_->printed();
  const PressureVector held = command_.pressure_bar;
  const int commands = commands_;
  ASSERT_TRUE(wait_for([&] { return commands_ > commands + 50; }));
  EXPECT_EQ(command_.pressure_bar, held);
  EXPECT_EQ(mode(), Mode::hold) << seen_text();
  recovers();

  inject("restart");
  EXPECT_TRUE(wait_for([&] { return saw(Mode::vent, Reason::sender_restarted); })) << seen_text();
  recovers();

  // The same by a real restart, after a silence.
  forget();
  plant_process_.reset();
  EXPECT_TRUE(becomes(*this, Mode::vent, Reason::frames_stale)) << seen_text();
  // New valves report that they hold nothing, and commands then begin at zero at once.
  ASSERT_TRUE(wait_for([&] { return largest(command_.pressure_bar) == 0.0F; }));
  plant_process_ = start_plant(*this, kSensorSuffix);
  recovers();
  expect_limits(*this);
}

TEST_P(FrameFaults, WithExplicitArmingARestartedSenderMustBeArmedAgain) {
  ASSERT_EQ(end(*daemon_), 0);
  configure(*this, ", arming: explicit");
  meanwhile_ = {};
  statuses_ = 0;
  daemon_ = start("softarmd");
  ASSERT_TRUE(becomes(*this, Mode::wait_frames, Reason::waiting_for_arm)) << daemon_->printed();
  ask_until_done(*this, OperatorRequest::arm);
  ASSERT_TRUE(wait_for([&] { return under_pressure(); })) << seen_text();
  inject("restart");
  EXPECT_TRUE(becomes(*this, Mode::vent, Reason::waiting_for_arm)) << seen_text();
  EXPECT_TRUE(saw(Mode::vent, Reason::sender_restarted)) << seen_text();
  EXPECT_EQ(largest(command_.pressure_bar), 0.0F);
  ask_until_done(*this, OperatorRequest::arm);
  EXPECT_TRUE(wait_for([&] { return mode() == Mode::active; })) << seen_text();
}

SOFTARM_ON_BOTH_MACHINES(FrameFaults);

}  // namespace
}  // namespace softarm
