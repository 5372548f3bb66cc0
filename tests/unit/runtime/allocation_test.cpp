// Ten thousand ticks through every mode without a call for memory, and without giving any back.
#include <gtest/gtest.h>

#include <memory>
#include <set>
#include <tuple>
#include <vector>

#include "counted_malloc.hpp"
#include "unit/runtime/pipeline_bench.hpp"

namespace softarm {
namespace {

using test::PipelineBench;

TEST(PipelineAllocation, TenThousandTicksThroughAllModes) {
  Experiment experiment = test::paper_arm();
  experiment.reference.phases.insert(experiment.reference.phases.begin(),
                                     {LiveReference{.timeout_s = 0.2}, 1.0});
  using enum ControlCoordinates;
  ActuatorInverseSettings everything;
  everything.hysteresis = 0.1;
  everything.learn_hysteresis = true;
  everything.fill_lag_s.assign(12, 0.04);
  everything.vent_lag_s.assign(12, 0.06);
  everything.stiffening_per_bar = 0.02;
  everything.slip_radius_rad = everything.slip_stiffness_nm_per_rad = {0.01, 0.05};
  for (const auto& [coordinates, observer, inverse] :
       {std::tuple(u, ObserverKind::kinematic, ActuatorInverseSettings{}),
        {polar, ObserverKind::kinematic, ActuatorInverseSettings{}},
        {u, ObserverKind::model, ActuatorInverseSettings{}},
        {u, ObserverKind::model, everything}}) {
    experiment.actuator_inverse = inverse;
    // At no cost where there is no model observer.
    experiment.control.repetition = {.lead_s = 0.1, .period_s = 1.0};
    experiment.control.coordinates = coordinates;
    experiment.estimation.observer = observer;
    const auto bench = std::make_unique<PipelineBench>(experiment);
    LiveReferenceInput live;
    live.u = live.velocity = live.acceleration = SegmentVector::Zero(6);
    bench->corrupt = [](MocapFrame& frame) {  // a corrupt frame must allocate nothing either
      if (frame.frame_number % 97 == 0) frame.body[1].position_m.x() = std::nan("");
      if (frame.frame_number % 101 == 0) frame.body[2].valid = false;
      return true;
    };
    std::array<int, 6> ticks_in{};

    const long allocated = test::thread_allocations, released = test::thread_releases;
    for (int k = 0; k < 10'000; ++k) {
      // Every 2000 ticks: a silence of 20 frames, long enough for HOLD and VENT.
      bench->publishing = k % 2000 < 1900;
      if (k % 7 == 0) bench->input.reference = &live;
      bench->input.requests.disarm = k == 6000;
      bench->input.requests.arm = k == 6100;
      bench->input.requests.shutdown = k >= 9900;
      ++ticks_in[static_cast<std::size_t>(bench->tick().mode)];
    }
    EXPECT_EQ(test::thread_allocations - allocated, 0);
    EXPECT_EQ(test::thread_releases - released, 0);
    for (const Mode mode : {Mode::wait_frames, Mode::active, Mode::hold, Mode::vent})
      EXPECT_GT(ticks_in[static_cast<std::size_t>(mode)], 30) << name(mode);
  }
}

TEST(PipelineAllocation, TheCountSeesAnAllocation) {
  if (SOFTARM_COUNTS_MALLOC == 0) GTEST_SKIP() << "a sanitizer owns malloc";
  const long allocated = test::thread_allocations, released = test::thread_releases;
  // Called by name: a new-expression could be optimised away.
  ::operator delete(::operator new(1000));
  ::operator delete (::operator new (1000, std::align_val_t{64}), std::align_val_t{64});
  EXPECT_EQ(test::thread_allocations - allocated, 2);
  EXPECT_EQ(test::thread_releases - released, 2);
}

}  // namespace
}  // namespace softarm
