// `softarm eval` as a user sees it: its JSON read back and held against the golden file; its
// errors.
#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "program_output.hpp"
#include "test_folder.hpp"
#include "unit/model/extensible_golden.hpp"

namespace softarm {
namespace {

using test::Outcome;

Outcome run(const std::string& arguments) { return test::run("eval " + arguments); }

/// Sum of the magnitudes that (17) adds up, per row.
Eigen::VectorXd magnitude_of_tau(const golden::Case& c) {
  const auto a = [](const Eigen::MatrixXd& m) { return Eigen::MatrixXd(m.cwiseAbs()); };
  const auto& e = c.expected;
  const auto& in = c.control;
  const Eigen::VectorXd position = in.at("qbar") - c.q, velocity = in.at("qbar_dot") - c.qd;
  return a(e.at("G")) + a(e.at("C")) * a(in.at("qbar_dot")) + a(e.at("B")) * a(in.at("qbar_ddot")) +
         a(e.at("K")) * a(in.at("qbar")) + a(e.at("D")) * a(in.at("qbar_dot")) +
         a(in.at("KP").cwiseProduct(position)) + a(in.at("KD").cwiseProduct(velocity));
}

/// Smallest |sin theta| or |theta|, by which A^-1 may multiply an error.
double least_determinant(const golden::Case& c, bool couple) {
  double least = 1.0;
  for (Eigen::Index i = 0; i < c.q.size(); i += 2) {
    const double theta = c.polar ? c.q(i + 1) : c.q.segment<2>(i).norm();
    if (couple && (c.polar || theta > 1.0)) least = std::min(least, std::abs(std::sin(theta)));
    if (!couple && c.polar) least = std::min(least, std::abs(theta));
  }
  return least;
}

double ratio(const golden::Case& c, const golden::Terms& expected, const std::string& key,
             const Eigen::MatrixXd& want, const Eigen::MatrixXd& got) {
  if (got.size() != want.size()) return INFINITY;
  const auto error = (got - want).cwiseAbs();
  if (key == "tau") return error.cwiseQuotient(magnitude_of_tau(c)).maxCoeff() / 1e-12;
  if (key.starts_with("tau_A")) {
    const double least = least_determinant(c, key == "tau_A_couple");
    return least < 1e-9 ? 0.0 : error.maxCoeff() * least / (1e-12 * magnitude_of_tau(c).maxCoeff());
  }
  if (key.starts_with("qbar")) {
    const double manipulability = c.ik.at("manipulability_ratio")(0);
    return manipulability < 1e-8
               ? 0.0
               : error.maxCoeff() * manipulability / (1e-11 * want.cwiseAbs().maxCoeff());
  }
  golden::Terms all = expected;
  all[key] = want;
  return golden::error_over_tolerance(c, all, key, got);
}

void compare(const std::string& mass) {
  const Outcome outcome = run(golden::path() + " --mass " + mass);
  ASSERT_EQ(outcome.code, 0) << outcome.text;
  const YAML::Node output = YAML::Load(outcome.text)["cases"];
  ASSERT_EQ(output.size(), golden::cases().size());
  for (std::size_t i = 0; i < output.size(); ++i) {
    const golden::Case& c = golden::cases()[i];
    EXPECT_EQ(output[i]["id"].as<std::string>(), c.id);
    const golden::Terms got = golden::terms(output[i]);
    const auto check = [&](const golden::Terms& basis, const golden::Terms& wanted,
                           std::initializer_list<const char*> keys) {
      for (const std::string key : keys) {
        ASSERT_EQ(got.contains(key), wanted.contains(key)) << c.id << " " << key;
        if (!got.contains(key)) continue;
        EXPECT_LE(ratio(c, basis, key, wanted.at(key), got.at(key)), 0.05) << c.id << " " << key;
      }
    };
    if (mass == "distributed") {
      if (c.distributed.empty()) continue;
      check(c.distributed, c.distributed, {"B", "C", "Cqd", "G", "kinetic_energy", "qdd_chamber"});
      continue;
    }
    check(c.expected, c.expected,
          {"T_world", "T_local", "com_world", "J_tip", "Jdot_tip", "Jw_tip", "B", "C", "Cqd", "G",
           "K", "D", "A_couple", "A_chamber", "kinetic_energy", "gravity_potential"});
    check(c.expected, c.control, {"tau", "tau_A_couple", "tau_A_chamber"});
    check(c.expected, c.forward, {"qdd_couple", "qdd_chamber"});
    check(c.expected, c.ik, {"qbar_dot", "qbar_ddot"});
  }
}

TEST(Eval, GoldenCasesWithPointMasses) { compare("point"); }
TEST(Eval, GoldenCasesWithDistributedMass) { compare("distributed"); }

void compare_extensible(const std::string& mass) {
  const Outcome outcome = run(golden::path("extensible.json") + " --mass " + mass);
  ASSERT_EQ(outcome.code, 0) << outcome.text;
  const YAML::Node output = YAML::Load(outcome.text)["cases"];
  ASSERT_EQ(output.size(), golden::extensible_cases().size());
  for (std::size_t i = 0; i < output.size(); ++i) {
    const golden::Case& c = golden::extensible_cases()[i];
    EXPECT_EQ(output[i]["id"].as<std::string>(), c.id);
    const golden::Terms got = golden::terms(output[i]);
    const golden::Terms& basis = mass == "point" ? c.expected : c.distributed;
    const auto check = [&](const golden::Terms& wanted, const golden::Terms& printed,
                           std::initializer_list<const char*> keys) {
      for (const std::string key : keys) {
        ASSERT_TRUE(wanted.contains(key) && printed.contains(key)) << c.id << " " << key;
        EXPECT_LE(
            golden::extensible_error_over_tolerance(c, basis, key, wanted.at(key), printed.at(key)),
            0.1)
            << c.id << " " << key;
      }
    };
    // What does not depend on where the mass sits is the same for both.
    check(c.expected, got,
          {"T_world", "T_local", "com_world", "J_tip", "Jdot_tip", "Jw_tip", "G", "K", "D",
           "A_chamber", "gravity_potential"});
    check(basis, got, {"B", "C", "Cqd", "G", "kinetic_energy"});
    check(mass == "point" ? c.control : c.distributed, got, {"tau", "tau_A_chamber"});
    check(mass == "point" ? c.forward : c.distributed, got, {"qdd_chamber"});
    check(c.chamber, golden::chamber_terms(output[i]), {"generalized_force", "length"});
    for (const char* key : {"A_couple", "tau_A_couple", "qdd_couple"}) {
      EXPECT_TRUE(output[i][key].IsNull()) << c.id << " " << key;  // the couple knows no elongation
    }
  }
}

TEST(Eval, ArmsThatStretchWithPointMasses) { compare_extensible("point"); }
TEST(Eval, ArmsThatStretchWithDistributedMass) { compare_extensible("distributed"); }

class EvalFile : public ::testing::Test {
 protected:
  Outcome eval(const std::string& text, const std::string& options = "") {
    std::ofstream(path_) << text;
    return run(path_ + " " + options);
  }

  const TestFolder folder_;
  const std::string path_ = (folder_ / "cases.yaml").string();
  const std::string arm_ =
      "  config: {n: 1, coords: cartesian_u, gravity: [0, 0, -9.81],\n"
      "    base_rotation: [[1, 0, 0], [0, -1, 0], [0, 0, -1]], base_position: [0, 0, 0],\n"
      "    L: [0.11], mu: [0.15], k: [0.626], beta: [0.029]}\n";
};

TEST_F(EvalFile, OwnCaseWithoutTheOptionalParts) {
  const Outcome outcome = eval("cases:\n- id: mine\n" + arm_ + "  q: [0.1, 0.2]\n  qd: [0, 0]\n");
  ASSERT_EQ(outcome.code, 0) << outcome.text;
  const YAML::Node one = YAML::Load(outcome.text)["cases"][0];
  EXPECT_EQ(one["id"].as<std::string>(), "mine");
  EXPECT_DOUBLE_EQ(one["K"][0][0].as<double>(), 0.626);
  EXPECT_FALSE(one["tau"]);
  EXPECT_FALSE(one["qdd_chamber"]);
  EXPECT_FALSE(one["qbar_dot"]);
}

TEST_F(EvalFile, NotFiniteIsNull) {
  const Outcome outcome = eval("cases:\n- id: a\n" + arm_ + "  q: [.nan, 0.2]\n  qd: [0, 0]\n");
  ASSERT_EQ(outcome.code, 0) << outcome.text;
  const YAML::Node one = YAML::Load(outcome.text)["cases"][0];
  EXPECT_TRUE(one["B"].IsNull());
  EXPECT_TRUE(one["K"].IsSequence());
}

TEST_F(EvalFile, FaultsAreReportedWithTheirPlace) {
  const auto expect = [](const Outcome& outcome, const std::string& part) {
    EXPECT_EQ(outcome.code, 78) << outcome.text;
    EXPECT_NE(outcome.text.find(part), std::string::npos) << outcome.text;
  };
  expect(eval("cases:\n- id: a\n" + arm_ + "  q: [0.1]\n  qd: [0, 0]\n"), ":6: cases[0].q");
  expect(eval("cases:\n- id: a\n" + arm_ + "  qd: [0, 0]\n"), "cases[0].q: expected");
  expect(eval("cases:\n- id: a\n" + arm_ + "  q: [0.1, x]\n  qd: [0, 0]\n"), "cases[0].q[1]");
  expect(eval("cases: [}"), "YAML");
  expect(eval("7"), "expected a map");
  expect(run("/nowhere/at/all.json"), "/nowhere/at/all.json");
}

TEST_F(EvalFile, FaultsOfArmsThatStretch) {
  const std::string arm =
      "cases:\n- id: a\n  config: {n: 1, coords: cartesian_ue, gravity: [0, 0, -9.81],\n"
      "    base_rotation: [[1, 0, 0], [0, -1, 0], [0, 0, -1]], base_position: [0, 0, 0],\n"
      "    L: [0.11], mu: [0.15], k: [0.626], beta: [0.029], k_a: [4000], ";
  const std::string chambers = "beta_a: [185], chambers: [{chi: [0, 2, 4], r: 0.01, a: 60}]}\n";
  const std::string state = "  q: [0.1, 0.2, 0.01]\n  qd: [0, 0, 0]\n";
  const auto expect = [](const Outcome& outcome, const std::string& part) {
    EXPECT_EQ(outcome.code, 78) << outcome.text;
    EXPECT_NE(outcome.text.find(part), std::string::npos) << outcome.text;
  };
  const Outcome plain = eval(arm + "beta_a: [185]}\n" + state);
  ASSERT_EQ(plain.code, 0) << plain.text;
  const YAML::Node one = YAML::Load(plain.text)["cases"][0];
  EXPECT_DOUBLE_EQ(one["K"][2][2].as<double>(), 4000.0);
  EXPECT_FALSE(one["chambers"]);

  expect(eval(arm + "}\n" + state), "config.beta_a");
  expect(eval(arm + "beta_a: [185]}\n  q: [0.1, 0.2]\n  qd: [0, 0, 0]\n"), "cases[0].q: expected");
  expect(eval(arm + "beta_a: [185]}\n  q: [0.1, 0.2, -0.11]\n  qd: [0, 0, 0]\n"),
         "cases[0].q[2]: expected an elongation above -0.11 m");
  expect(eval(arm + "beta_a: [185]}\n" + state + "  chambers: {pressure: [[1, 1, 1]]}\n"),
         "config.chambers");
  expect(eval(arm + chambers + state + "  chambers: {pressure: [[1, 1]]}\n"),
         "cases[0].chambers.pressure[0]: expected a list of 3");
  expect(eval(arm + chambers + state + "  ik: {lambda1: 1}\n"), "coords polar or cartesian_u");
  EXPECT_EQ(eval(arm + chambers + state, "--method augmented").code, 64);
}

TEST(Eval, UnknownOptionsAreUsageErrors) {
  EXPECT_EQ(run(golden::path() + " --mass heavy").code, 64);
  EXPECT_EQ(run(golden::path() + " --method guess").code, 64);
  EXPECT_EQ(run(golden::path() + " --frobnicate").code, 64);
  EXPECT_EQ(run("").code, 64);
}

}  // namespace
}  // namespace softarm
