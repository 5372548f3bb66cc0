// A plant, a reference kind and a motion-capture source that the library does not know, named in
// YAML with their own keys.
#include <gtest/gtest.h>

#include <cmath>

#include "softarm/base/keys.hpp"
#include "softarm/config/load.hpp"
#include "softarm/simulation/plant_kinds.hpp"
#include "unit/config/config_files.hpp"

namespace softarm {
namespace {

/// A constant-curvature arm of another stiffness.
struct Softer {
  double share = 0.5;

  const char* name() const noexcept { return "softer"; }
  void describe(Keys& key) { key("share", share, above(0, 1), "of every segment's stiffness"); }
  std::unique_ptr<PlantSystem> make(PlantSettings settings) const {
    for (auto& segment : settings.arm.segments) segment.stiffness_nm_per_rad *= share;
    return PccSettings{}.make(settings);
  }
};
const PlantRegistration kSofter(Softer{});

/// All segments bend alike, the more the later.
struct Curl {
  double rate_radps = 0.1;
  double until_s = 1.0;

  const char* name() const noexcept { return "curl"; }
  void describe(Keys& key) {
    key("rate_radps", rate_radps, from(0, 10), "of theta", Presence::required);
    key("until_s", until_s, above(0, 100), "then it rests");
  }
  void check(const ReferencePlace&, const ControllerSettings&, int) const {}
  double largest_theta_rad() const noexcept { return rate_radps * until_s; }
  double largest_speed_radps() const noexcept { return rate_radps; }
  void evaluate(double time_s, ReferenceSample& out) const noexcept {
    const bool rests = time_s >= until_s;
    out.acceleration.setZero();
    for (Eigen::Index i = 0; i < out.u.size(); i += 2) {
      out.u.segment<2>(i) << rate_radps * std::min(time_s, until_s), 0.0;
      out.velocity.segment<2>(i) << (rests ? 0.0 : rate_radps), 0.0;
    }
  }
};
const ReferenceRegistration kCurl(Curl{});

const MocapSourceRegistration kCopy({.label = "copy",
                                     .make = softarm_mocap().make,
                                     .channel = "COPY",
                                     .quaternion = QuaternionOrder::xyzw});

std::string with(const std::string& reference, const std::string& more) {
  return "include: " + (kConfigFolder / "one_segment.yaml").string() + "\nreference:\n  - " +
         reference + "\n" + more;
}

TEST(AddedKinds, AreNamedWithTheirOwnKeys) {
  const TestFolder folder;
  const Experiment e = load_experiment(folder.write(
      "a.yaml", with("{kind: curl, rate_radps: 0.5}",
                     "plant: {kind: softer, softer: {share: 0.25}}\ndaemon: {mocap: {source: "
                     "copy}}\n")));
  const auto* curl = e.reference.phases[0].kind.get_if<Curl>();
  ASSERT_NE(curl, nullptr);
  EXPECT_EQ(curl->rate_radps, 0.5);
  EXPECT_EQ(curl->until_s, 1.0);
  const auto* softer = e.plant.kind.get_if<Softer>();
  ASSERT_NE(softer, nullptr);
  EXPECT_EQ(softer->share, 0.25);
  EXPECT_EQ(e.transport.lcm.mocap_channel, "COPY");
  EXPECT_EQ(e.transport.mocap.quaternion, QuaternionOrder::xyzw);
  const Experiment again = load_experiment(folder.write("b.yaml", resolved_text(e)));
  EXPECT_EQ(again.hash, e.hash);
  EXPECT_EQ(resolved_text(again), resolved_text(e));
}

TEST(AddedKinds, FaultsAreNamedAsThoseOfOthers) {
  const TestFolder folder;
  const auto complaint = [&](const std::string& text) -> std::string {
    try {
      load_experiment(folder.write("bad.yaml", text));
    } catch (const ConfigError& error) {
      return error.what();
    }
    ADD_FAILURE() << text << " was accepted";
    return "";
  };
  const auto has = [](const std::string& text, const char* part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  has(complaint(with("{kind: curl}", "")), "reference[0].rate_radps");
  has(complaint(with("{kind: curl, rate_radps: 11}", "")), "[0, 10] rad/s");
  has(complaint(with("{kind: curl, rate_radps: 1, untill_s: 2}", "")), "did you mean until_s");
  has(complaint(with("{kind: curl, rate_radps: 9}", "")), "max_theta_rad");
  has(complaint(with("{kind: crul}", "")), "curl");
  has(complaint(with("{kind: curl, rate_radps: 1}", "plant: {softer: {share: 2}}\n")),
      "plant.softer.share");
  const std::string kinds = complaint(with("{kind: curl, rate_radps: 1}", "plant: {kind: soft}\n"));
  has(kinds, "one of pcc, refined, links, ");
  has(kinds, "softer");
}

TEST(AddedKinds, AreInTheSchema) {
  const std::string schema = schema_text();
  for (const char* word : {"\"curl\"", "\"until_s\"", "\"softer\"", "\"share\"", "\"copy\""})
    EXPECT_NE(schema.find(word), std::string::npos) << word;
}

}  // namespace
}  // namespace softarm
