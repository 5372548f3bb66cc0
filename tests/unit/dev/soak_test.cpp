// What a soak counts can fail: each bound is crossed here once.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "dev/fault/fault_injector.hpp"
#include "dev/soak/process_use.hpp"
#include "dev/soak/soak_arm.hpp"
#include "dev/soak/soak_faults.hpp"
#include "dev/soak/soak_report.hpp"

namespace softarm {
namespace {

SoakCounters healthy() {
  SoakCounters counters;
  counters.ticks = 1'800'000;
  counters.faults = {
      {.name = "stop", .injected = 3, .answered = 3, .recovered = 3, .disturbed = 0}};
  const ProcessUse use{.resident_kib = 9000, .anonymous_kib = 2000, .descriptors = 10};
  counters.processes = {{.name = "softarmd",
                         .at_start = use,
                         .after_warm_up = use,
                         .at_end = use,
                         .instances = 1,
                         .measured = true}};
  return counters;
}

TEST(SoakReport, AHealthyRunIsNoFailure) {
  EXPECT_TRUE(failures(healthy()).empty());
  EXPECT_NE(report_text(healthy()).find("all faults recovered"), std::string::npos);
  EXPECT_TRUE(nlohmann::json::parse(report_json(healthy()))["failures"].empty());
}

TEST(SoakReport, EveryBoundThatIsCrossedIsAFailureThatSaysWhy) {
  struct Row {
    const char* says;
    std::function<void(SoakCounters&)> corrupt;
  };
  for (const Row& row : {
           Row{"memory grew by 513 KiB",
               [](SoakCounters& c) { c.processes[0].at_end.anonymous_kib += 513; }},
           Row{"11 file descriptors, after the warm-up 10",
               [](SoakCounters& c) { ++c.processes[0].at_end.descriptors; }},
           Row{"could not be measured", [](SoakCounters& c) { c.processes[0].measured = false; }},
           Row{"stop: 1 of 3 times not recovered",
               [](SoakCounters& c) { --c.faults[0].recovered; }},
           Row{"stop: 1 of 3 times without", [](SoakCounters& c) { --c.faults[0].answered; }},
           Row{"2 commands outside", [](SoakCounters& c) { c.commands_outside_limits = 2; }},
           Row{"did not tick", [](SoakCounters& c) { c.ticks = 0; }},
           Row{"no fault was injected", [](SoakCounters& c) { c.faults[0] = {.name = "stop"}; }},
           Row{"ended by itself",
               [](SoakCounters& c) { c.troubles.emplace_back("softarmd ended by itself"); }},
       }) {
    SoakCounters counters = healthy();
    row.corrupt(counters);
    ASSERT_FALSE(failures(counters).empty()) << row.says;
    EXPECT_NE(failures(counters)[0].find(row.says), std::string::npos) << failures(counters)[0];
    EXPECT_NE(report_text(counters).find(std::string("FAILED: ") + failures(counters)[0]),
              std::string::npos);
  }
  SoakCounters at_the_bound = healthy();
  at_the_bound.processes[0].at_end.anonymous_kib += kMostGrowth_kib;
  EXPECT_TRUE(failures(at_the_bound).empty());
}

TEST(ProcessUse, SeesMemoryAndDescriptors) {
  const auto before = process_use(getpid());
  ASSERT_TRUE(before);
  EXPECT_GT(before->resident_kib, 0);
  EXPECT_GE(before->descriptors, 3);
  constexpr std::size_t kBytes = 8 << 20;
  const std::unique_ptr<volatile char[]> memory(new volatile char[kBytes]);
  for (std::size_t k = 0; k < kBytes; k += 1024) memory[k] = 1;
  const int file = open("/dev/null", O_RDONLY | O_CLOEXEC);
  ASSERT_GE(file, 0);
  const auto after = process_use(getpid());
  close(file);
  ASSERT_TRUE(after);
  EXPECT_GE(after->anonymous_kib - before->anonymous_kib, 8000);
  EXPECT_GE(after->resident_kib - before->resident_kib, 8000);
  EXPECT_EQ(after->descriptors, before->descriptors + 1);
  EXPECT_FALSE(process_use(-1));
}

TEST(RandomReference, GoesThroughTheStraightPoseWithinItsBounds) {
  ControllerSettings control;
  control.max_theta_rad = 1.0;
  Reference reference(random_reference(3, 0.8, 100, 7), control, 3);
  const SegmentVector zero = SegmentVector::Zero(6);
  reference.start(0.0, zero, zero);
  ReferenceSample sample;
  double largest = 0.0;
  int crossings[3] = {0, 0, 0};
  SegmentVector before = zero;
  for (int k = 0; k < 12000; ++k) {
    reference.sample(0.01 * k, sample);
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector2d u = sample.u.segment<2>(2 * i);
      largest = std::max(largest, u.norm());
      if (u.dot(before.segment<2>(2 * i)) < 0.0) ++crossings[i];
    }
    before = sample.u;
  }
  EXPECT_LE(largest, 0.8 + 1e-9);
  EXPECT_GT(largest, 0.6);
  for (const int count : crossings) EXPECT_GT(count, 20);
}

TEST(SoakFaults, HaveDistinctNamesAndFaultsThatExist) {
  std::set<std::string> names;
  for (const SoakFault& fault : soak_faults()) {
    EXPECT_TRUE(names.insert(fault.name).second) << fault.name;
    if (fault.action == SoakAction::relay) {
      EXPECT_TRUE(find_fault(fault.relay_fault)) << fault.name;
    }
  }
}

}  // namespace
}  // namespace softarm
