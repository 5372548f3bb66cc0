// Control laws: one that the library does not know, added by one line and named in YAML, run in
// lock step; and those that are built in, against what they are made of.
#include <gtest/gtest.h>

#include <memory>

#include "softarm/base/keys.hpp"
#include "softarm/config/load.hpp"
#include "softarm/control/control_laws.hpp"
#include "softarm/control/settings.hpp"
#include "softarm/model/statics.hpp"
#include "softarm/simulation/lock_step.hpp"
#include "unit/config/config_files.hpp"

namespace softarm {
namespace {

/// What holds the reference at rest, and a spring towards it.
class Softness final : public ControlLaw {
 public:
  Softness(const LawSetup& setup, double gain) : arm_(setup.arm), workspace_(arm_), gain_(gain) {}
  void compute(const LawState& state, const ReferenceWindow& reference,
               ControlOutput& out) noexcept override {
    static_moments(arm_, workspace_, reference.now.u, out.tau_u_nm);
    out.tau_u_nm += gain_ * (reference.now.u - state.u_rad);
  }
  void reset() noexcept override { ++resets; }
  static inline int resets = 0;

 private:
  ArmParameters arm_;
  DynamicsWorkspace workspace_;
  double gain_;
};

struct SoftnessSettings {
  double gain_nm_per_rad = 1.0;
  const char* name() const noexcept { return "softness"; }
  void describe(Keys& key) {
    key("gain_nm_per_rad", gain_nm_per_rad, from(0, 100), "of u_ref - u");
  }
  std::unique_ptr<ControlLaw> make(const LawSetup& setup) const {
    return std::make_unique<Softness>(setup, gain_nm_per_rad);
  }
};
const LawRegistration kSoftness(SoftnessSettings{});

Experiment with_law(const TestFolder& folder, const std::string& control,
                    const std::string& base = "paper_arm.yaml") {
  return load_experiment(folder.write(
      "law.yaml", "include: " + (kConfigFolder / base).string() + "\ncontrol: " + control + "\n"));
}

TEST(ControlLaws, OneLineAddsOneWithItsOwnKeys) {
  const TestFolder folder;
  const Experiment experiment =
      with_law(folder, "{law: softness, softness: {gain_nm_per_rad: 0.5}}");
  const auto* softness = experiment.control.law.get_if<SoftnessSettings>();
  ASSERT_NE(softness, nullptr);
  EXPECT_EQ(softness->gain_nm_per_rad, 0.5);
  EXPECT_NE(resolved_text(experiment).find("gain_nm_per_rad: 0.5"), std::string::npos);

  LockStep steps(experiment, experiment.plant);
  LogRow row;
  const int before = Softness::resets;
  double largest = 0.0;
  for (int k = 0; k < 2000; ++k) {
    steps.step(row, k > 1000);
    if (k > 1000) largest = std::max(largest, (row.truth - row.reference).cwiseAbs().maxCoeff());
  }
  EXPECT_EQ(Softness::resets, before + 1) << "once it became ACTIVE";
  EXPECT_EQ(row.mode, Mode::active);
  EXPECT_GT(largest, 0.01) << "without inertia, damping and the valves' lag it stays behind";
  EXPECT_LT(largest, 0.2);
}

TEST(ControlLaws, AnUnknownNameListsThoseThereAre) {
  const TestFolder folder;
  try {
    with_law(folder, "{law: softly}");
    FAIL();
  } catch (const ConfigError& error) {
    for (const char* name : {"curvature", "statics_pi", "external", "softness"})
      EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
  }
}

/// Two runs, bit for bit.
void expect_same_runs(const Experiment& a, const Experiment& b) {
  LockStep first(a, a.plant), second(b, b.plant);
  LogRow row_a, row_b;
  for (int k = 0; k < 1000; ++k) {
    first.step(row_a, k % 10 == 0);
    second.step(row_b, k % 10 == 0);
    ASSERT_EQ(first.pipeline().output().pressure_bar, second.pipeline().output().pressure_bar) << k;
  }
  EXPECT_EQ(row_a.mode, Mode::active);
}

TEST(ControlLaws, StaticsPiIsWhatTheClaimsComparedWith) {
  const TestFolder folder;
  const char* gains = "kp_nm_per_rad: 1.3, kd_nms_per_rad: 0.02, ki_nm_per_rad_s: 4";
  expect_same_runs(
      with_law(folder, std::string("{law: statics_pi, ") + gains + "}"),
      with_law(folder, std::string("{terms: {inertia: false, coriolis: false, damping: "
                                   "false}, valve_lag_s: 0, ") +
                           gains + "}"));
}

// A law that another process computes is a tick late, and knows no look-ahead: else it is the same.
TEST(ControlLaws, TheSameLawOutsideOfThePipelineIsATickLate) {
  const TestFolder folder;
  const Experiment inside = with_law(folder, "{law: softness, softness: {gain_nm_per_rad: 0.5}}");
  Experiment outside = inside;
  outside.control.law = ExternalLaw{};
  LockStep here(inside, inside.plant), there(outside, outside.plant);
  const LawSetup setup{outside.arm, outside.control, 12};
  Softness law(setup, 0.5);
  ReferenceWindow window;
  ControlOutput asked;
  asked.tau_u_nm.setZero(6);
  int asked_times = 0;
  there.set_law([&](const TickOutput& output, LawInput& answer) {
    window.now = output.law->reference;
    law.compute({output.law->u_rad, output.law->velocity_radps}, window, asked);
    answer.answer = LawAnswer::force;
    answer.validity_ns = 50'000'000;
    answer.values = asked.tau_u_nm;
    ++asked_times;
    return true;
  });
  LogRow row_here, row_there;
  double apart = 0.0;
  for (int k = 0; k < 2000; ++k) {
    here.step(row_here);
    there.step(row_there);
    if (k > 500) apart = std::max(apart, (row_here.truth - row_there.truth).cwiseAbs().maxCoeff());
  }
  EXPECT_EQ(row_there.mode, Mode::active);
  EXPECT_GT(apart, 0.0);
  EXPECT_LT(apart, 0.01) << "rad, of a motion of 0.4 rad at 0.8 rad/s";
  EXPECT_EQ(there.pipeline().law_counts()[0], asked_times - 1)
      << "the last comes with the next tick";
}

}  // namespace
}  // namespace softarm
