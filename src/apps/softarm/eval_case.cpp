// Reading the cases of `softarm eval`: the golden file's JSON, or the same as YAML.
#include "apps/softarm/eval_case.hpp"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <cmath>

#include "softarm/config/config_error.hpp"

namespace softarm {
namespace {

constexpr int kMaxEvalSegments = 1000;

/// A node with its location, for messages.
struct Place {
  const std::string& file;
  YAML::Node node;
  std::string key;

  [[noreturn]] void fail(const std::string& expected, const std::string& got) const {
    const YAML::Mark mark = node.IsDefined() ? node.Mark() : YAML::Mark::null_mark();
    throw ConfigError(file, mark.is_null() ? 0 : mark.line + 1, key, expected, got);
  }

  std::string what() const {
    if (!node.IsDefined()) return "nothing";
    switch (node.Type()) {
      case YAML::NodeType::Null:
        return "null";
      case YAML::NodeType::Scalar:
        return fmt::format("'{}'", node.Scalar());
      case YAML::NodeType::Sequence:
        return fmt::format("a list of {}", node.size());
      default:
        return node.IsMap() ? "a map" : "nothing";
    }
  }

  bool has(const std::string& name) const { return node[name] && !node[name].IsNull(); }

  Place at(const std::string& name) const {
    const std::string full = key.empty() ? name : key + "." + name;
    if (!node.IsMap()) fail("a map", what());
    if (!node[name]) Place{file, node, full}.fail("a value", "nothing (missing key)");
    return {file, node[name], full};
  }
  Place at(std::size_t index) const {
    return {file, node[index], fmt::format("{}[{}]", key, index)};
  }

  double number() const {
    double value = 0.0;
    if (!node.IsScalar() || !YAML::convert<double>::decode(node, value)) fail("a number", what());
    return value;
  }
  double positive() const {
    const double value = number();
    if (!(value > 0.0) || !std::isfinite(value)) fail("a number > 0", what());
    return value;
  }
  double non_negative() const {
    const double value = number();
    if (!(value >= 0.0) || !std::isfinite(value)) fail("a number >= 0", what());
    return value;
  }
  void expect_list(std::size_t size) const {
    if (!node.IsSequence() || node.size() != size) fail(fmt::format("a list of {}", size), what());
  }
  Eigen::VectorXd vector(int size) const {
    expect_list(static_cast<std::size_t>(size));
    Eigen::VectorXd result(size);
    for (int i = 0; i < size; ++i) result(i) = at(static_cast<std::size_t>(i)).number();
    return result;
  }
  Eigen::Matrix3d rotation() const {
    expect_list(3);
    Eigen::Matrix3d R;
    for (int i = 0; i < 3; ++i) R.row(i) = at(static_cast<std::size_t>(i)).vector(3).transpose();
    constexpr double kTolerance = 1e-6;
    if (!((R * R.transpose()).isIdentity(kTolerance) && R.determinant() > 0.0)) {
      fail("a rotation matrix (orthonormal rows, determinant 1)", "another matrix");
    }
    return R;
  }
};

int read_size(const Place& config) {
  const Place place = config.at("n");
  int n = 0;
  if (!place.node.IsScalar() || !YAML::convert<int>::decode(place.node, n) || n < 1 ||
      n > kMaxEvalSegments) {
    place.fail(fmt::format("a number of segments from 1 to {}", kMaxEvalSegments), place.what());
  }
  return n;
}

ArmParameters read_arm(const Place& config) {
  ArmParameters arm;
  const auto n = static_cast<std::size_t>(read_size(config));
  const Place L = config.at("L"), mu = config.at("mu"), k = config.at("k"),
              beta = config.at("beta");
  for (const Place* list : {&L, &mu, &k, &beta}) list->expect_list(n);
  for (std::size_t i = 0; i < n; ++i) {
    arm.segments.push_back({.length_m = L.at(i).positive(),
                            .mass_kg = mu.at(i).positive(),
                            .stiffness_nm_per_rad = k.at(i).non_negative(),
                            .damping_nms_per_rad = beta.at(i).non_negative()});
  }
  arm.gravity_mps2 = config.at("gravity").vector(3);
  arm.base_rotation = config.at("base_rotation").rotation();
  arm.base_position_m = config.at("base_position").vector(3);
  return arm;
}

bool read_polar(const Place& config) {
  const Place place = config.at("coords");
  const std::string name = place.node.IsScalar() ? place.node.Scalar() : "";
  if (name != "polar" && name != "cartesian_u") {
    place.fail("'polar' or 'cartesian_u'", place.what());
  }
  return name == "polar";
}

EvalCase read_case(const Place& place) {
  EvalCase result;
  const Place id = place.at("id");
  if (!id.node.IsScalar()) id.fail("a name", id.what());
  result.id = id.node.Scalar();
  const Place config = place.at("config");
  result.polar = read_polar(config);
  result.arm = read_arm(config);
  const int dof = result.arm.dof();
  result.q = place.at("q").vector(dof);
  result.qd = place.at("qd").vector(dof);
  if (place.has("control")) {
    const Place control = place.at("control");
    result.control = EvalControl{.reference = control.at("qbar").vector(dof),
                                 .velocity = control.at("qbar_dot").vector(dof),
                                 .acceleration = control.at("qbar_ddot").vector(dof),
                                 .kp = control.at("KP").vector(dof),
                                 .kd = control.at("KD").vector(dof)};
  }
  if (place.has("forward")) {
    result.tau_actuation = place.at("forward").at("tau_A").vector(dof);
  }
  if (place.has("ik")) {
    const Place ik = place.at("ik");
    EvalInverseKinematics inputs;
    inputs.gains = {.lambda_1ps = ik.at("lambda1").number(),
                    .lambda_position_1ps2 = ik.at("lambda_p").number(),
                    .lambda_velocity_1ps = ik.at("lambda_d").number()};
    inputs.reference = {.position_m = ik.at("p_d").vector(3),
                        .velocity_mps = ik.at("pd_dot").vector(3),
                        .acceleration_mps2 = ik.at("pd_ddot").vector(3)};
    result.inverse_kinematics = inputs;
  }
  return result;
}

YAML::Node load(const std::string& file) {
  try {
    return YAML::LoadFile(file);
  } catch (const YAML::BadFile&) {
    throw ConfigError(file, 0, "", "a readable file", "none");
  } catch (const YAML::Exception& error) {
    throw ConfigError(file, error.mark.is_null() ? 0 : error.mark.line + 1, "", "JSON or YAML",
                      error.msg);
  }
}

}  // namespace

std::vector<EvalCase> read_eval_cases(const std::string& file) {
  const YAML::Node root = load(file);
  const Place place{file, root, ""};
  if (!root.IsMap()) place.fail("a map with the key cases", place.what());
  const Place list = place.at("cases");
  if (!list.node.IsSequence()) list.fail("a list of cases", list.what());
  std::vector<EvalCase> result;
  std::size_t index = 0;
  for (const auto& node : list.node) {
    const Place one{file, node, fmt::format("cases[{}]", index++)};
    if (!node.IsMap()) one.fail("a map", one.what());
    result.push_back(read_case(one));
  }
  return result;
}

}  // namespace softarm
