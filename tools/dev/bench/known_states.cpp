#include "dev/bench/known_states.hpp"

#include <yaml-cpp/yaml.h>

#include <cmath>
#include <numbers>
#include <random>

#include "softarm/model/polar.hpp"

namespace softarm {
namespace {

reference::Vector exact(const Eigen::Ref<const Eigen::VectorXd>& v) {
  return v.cast<reference::Real>();
}

/// The other coordinates of a state given in polar, and the terms there in long double.
void complete(KnownState& known) {
  BenchState& s = known.state;
  if (known.polar) {
    s.u = s.velocity = s.acceleration = Eigen::VectorXd(s.q.size());
    polar_to_u(s.q, s.u);
    polar_velocity_to_u(s.q, s.q_velocity, s.velocity);
    polar_acceleration_to_u(s.q, s.q_velocity, s.q_acceleration, s.acceleration);
    const reference::Vector q = exact(s.q), v = exact(s.q_velocity);
    const reference::Vector u = reference::polar_to_u(q);
    known.terms = reference::to_polar(
        reference::dynamics(known.arm, u, reference::polar_velocity_to_u(q, v)), q, v);
  } else {
    known.terms = reference::dynamics(known.arm, exact(s.u), exact(s.velocity));
  }
}

Eigen::VectorXd vector(const YAML::Node& node) {
  const auto numbers = node.as<std::vector<double>>();
  return Eigen::Map<const Eigen::VectorXd>(numbers.data(),
                                           static_cast<Eigen::Index>(numbers.size()));
}

Eigen::MatrixXd matrix(const YAML::Node& node) {
  Eigen::MatrixXd result(static_cast<Eigen::Index>(node.size()),
                         static_cast<Eigen::Index>(node[0].size()));
  for (std::size_t i = 0; i < node.size(); ++i) {
    result.row(static_cast<Eigen::Index>(i)) = vector(node[i]).transpose();
  }
  return result;
}

ArmParameters golden_arm(const YAML::Node& config, MassModel mass) {
  ArmParameters arm;
  for (std::size_t i = 0; i < config["L"].size(); ++i) {
    arm.segments.push_back({.length_m = config["L"][i].as<double>(),
                            .mass_kg = config["mu"][i].as<double>(),
                            .stiffness_nm_per_rad = config["k"][i].as<double>(),
                            .damping_nms_per_rad = config["beta"][i].as<double>()});
  }
  arm.mass = mass;
  arm.base_rotation = matrix(config["base_rotation"]);
  arm.base_position_m = vector(config["base_position"]);
  arm.gravity_mps2 = vector(config["gravity"]);
  return arm;
}

KnownState golden_state(const YAML::Node& node, MassModel mass, const YAML::Node& expected) {
  KnownState known;
  known.arm = golden_arm(node["config"], mass);
  known.polar = node["config"]["coords"].as<std::string>() == "polar";
  const YAML::Node control = node["control"];
  BenchState& s = known.state;
  ReferenceSample& r = s.reference.now;
  (known.polar ? s.q : s.u) = vector(node["q"]);
  (known.polar ? s.q_velocity : s.velocity) = vector(node["qd"]);
  (known.polar ? r.polar : r.u) = vector(control["qbar"]);
  (known.polar ? r.polar_velocity : r.velocity) = vector(control["qbar_dot"]);
  (known.polar ? r.polar_acceleration : r.acceleration) = vector(control["qbar_ddot"]);
  (known.polar ? s.q_acceleration : s.acceleration) = vector(control["qbar_ddot"]);
  r.has_polar = known.polar;
  known.kp = control["KP"].as<std::vector<double>>();
  known.kd = control["KD"].as<std::vector<double>>();
  complete(known);
  // The scales are the long double model's; the terms those of the file.
  known.terms.B = matrix(expected["B"]).cast<reference::Real>();
  known.terms.C = matrix(expected["C"]).cast<reference::Real>();
  known.terms.G = exact(vector(expected["G"]));
  return known;
}

}  // namespace

std::vector<KnownState> golden_states(const std::string& file, MassModel mass) {
  std::vector<KnownState> states;
  const YAML::Node root = YAML::LoadFile(file);
  for (const auto& node : root["cases"]) {
    const YAML::Node expected =
        node[mass == MassModel::point ? "expected" : "expected_distributed"];
    if (expected) states.push_back(golden_state(node, mass, expected));
  }
  return states;
}

std::vector<KnownState> sweep_states(bool polar, MassModel mass) {
  constexpr int kSegments = 3, kDecades = 12, kPerDecade = 6, kLinear = 69;
  std::vector<double> thetas;
  for (int k = 0; k <= kDecades * kPerDecade; ++k) {
    thetas.push_back(std::pow(10.0, -kDecades + static_cast<double>(k) / kPerDecade));
  }
  for (int k = 0; k <= kLinear; ++k) thetas.push_back(0.1 + 6.9 * k / kLinear);

  std::mt19937 engine(20190414);
  const auto uniform = [&engine](double bound) {
    return std::uniform_real_distribution<double>(-bound, bound)(engine);
  };
  const auto random = [&uniform](double bound) {
    return Eigen::VectorXd::NullaryExpr(2 * kSegments, [&] { return uniform(bound); }).eval();
  };
  std::vector<KnownState> states;
  for (const double theta : thetas) {
    KnownState known;
    known.arm.segments.resize(kSegments);
    known.arm.mass = mass;
    known.polar = polar;
    known.kp.assign(2 * kSegments, 1.0);
    known.kd.assign(2 * kSegments, 0.002);
    BenchState& s = known.state;
    s.q = s.u = Eigen::VectorXd(2 * kSegments);
    for (int i = 0; i < kSegments; ++i) s.q.segment<2>(2 * i) << uniform(std::numbers::pi), theta;
    polar_to_u(s.q, s.u);
    s.q_velocity = s.velocity = random(2.0);
    s.q_acceleration = s.acceleration = random(5.0);
    ReferenceSample& r = s.reference.now;
    // Near the state, so that no angle is wrapped.
    r.polar = s.q + random(0.3);
    r.u = s.u + random(0.3);
    r.polar_velocity = r.velocity = random(2.0);
    r.polar_acceleration = r.acceleration = random(5.0);
    r.has_polar = true;
    complete(known);
    states.push_back(std::move(known));
  }
  return states;
}

}  // namespace softarm
