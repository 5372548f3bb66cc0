// Every term of the model by two routes.
#include "softarm/control/evaluation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>

namespace softarm {
namespace {

EvalCase three_segments() {
  EvalCase one;
  one.id = "three";
  one.polar = true;
  one.arm.segments.assign(3, {.length_m = 0.11,
                              .mass_kg = 0.15,
                              .stiffness_nm_per_rad = 0.6,
                              .damping_nms_per_rad = 0.03});
  one.arm.mass = MassModel::point;
  one.q = (Eigen::VectorXd(6) << 0.3, 0.5, -1.1, 0.8, 2.0, 0.4).finished();
  one.qd = (Eigen::VectorXd(6) << 0.2, -0.4, 0.7, 0.1, -0.3, 0.6).finished();
  one.tau_actuation = Eigen::VectorXd::LinSpaced(6, -0.2, 0.3);
  one.control = EvalControl{.reference = one.q,
                            .velocity = one.qd,
                            .acceleration = Eigen::VectorXd::Zero(6),
                            .kp = Eigen::VectorXd::Ones(6),
                            .kd = Eigen::VectorXd::Ones(6)};
  return one;
}

const EvalTerm* find(const std::vector<NamedTerm>& terms, const std::string& name) {
  const auto at = std::find_if(terms.begin(), terms.end(),
                               [&](const NamedTerm& each) { return each.name == name; });
  return at == terms.end() ? nullptr : &at->term;
}

TEST(Evaluation, TheRoutesOfTheLoopAndOfTableOneAgree) {
  const EvalCase one = three_segments();
  const std::vector<NamedTerm> direct = evaluate(one, EvalMethod::direct);
  const std::vector<NamedTerm> augmented = evaluate(one, EvalMethod::augmented);
  EXPECT_GT(direct.size(), 20u);
  for (const NamedTerm& each : direct) {
    const EvalTerm* other = find(augmented, each.name);
    ASSERT_NE(other, nullptr) << each.name;
    ASSERT_EQ(other->matrices.size(), each.term.matrices.size()) << each.name;
    if (each.name == "C") continue;  // only C q' is unique
    for (std::size_t i = 0; i < other->matrices.size(); ++i) {
      const double scale = std::max(1.0, each.term.matrices[i].cwiseAbs().maxCoeff());
      EXPECT_LT((other->matrices[i] - each.term.matrices[i]).cwiseAbs().maxCoeff(), 1e-9 * scale)
          << each.name;
    }
  }
  EXPECT_NE(find(augmented, "xi"), nullptr);
  EXPECT_EQ(find(direct, "xi"), nullptr);
}

TEST(Evaluation, WhereTheActuationMatrixIsSingularThereIsNoValue) {
  EvalCase one = three_segments();
  one.q[1] = 0.0;
  const std::vector<NamedTerm> terms = evaluate(one, EvalMethod::direct);
  EXPECT_TRUE(find(terms, "tau_A_couple")->matrices.empty());
  EXPECT_TRUE(find(terms, "qdd_couple")->matrices.empty());
  EXPECT_FALSE(find(terms, "tau")->matrices.empty());
}

TEST(Evaluation, TheRobotOfTableOneIsPolar) {
  EvalCase one = three_segments();
  one.polar = false;
  EXPECT_THROW(evaluate(one, EvalMethod::augmented), std::invalid_argument);
}

}  // namespace
}  // namespace softarm
