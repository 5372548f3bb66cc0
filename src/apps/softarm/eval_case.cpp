// Reading the cases of `softarm eval`: the golden file's JSON, or the same as YAML.
#include "apps/softarm/eval_case.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "apps/softarm/eval_place.hpp"
#include "softarm/config/config_error.hpp"

namespace softarm {
namespace {

constexpr int kMaxEvalSegments = 1000;

int read_size(const Place& config) {
  const Place place = config.at("n");
  int n = 0;
  if (!place.node.IsScalar() || !YAML::convert<int>::decode(place.node, n) || n < 1 ||
      n > kMaxEvalSegments) {
    place.fail(fmt::format("a number of segments from 1 to {}", kMaxEvalSegments), place.what());
  }
  return n;
}

ArmParameters read_arm(const Place& config, bool extensible) {
  ArmParameters arm;
  arm.extensible = extensible;
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
  if (extensible) {
    const Place k_a = config.at("k_a"), beta_a = config.at("beta_a");
    for (const Place* list : {&k_a, &beta_a}) list->expect_list(n);
    for (std::size_t i = 0; i < n; ++i) {
      arm.segments[i].axial_stiffness_n_per_m = k_a.at(i).non_negative();
      arm.segments[i].axial_damping_ns_per_m = beta_a.at(i).non_negative();
    }
  }
  arm.gravity_mps2 = config.at("gravity").vector(3);
  arm.base_rotation = config.at("base_rotation").rotation();
  arm.base_position_m = config.at("base_position").vector(3);
  return arm;
}

std::string read_coordinates(const Place& config) {
  const Place place = config.at("coords");
  const std::string name = place.node.IsScalar() ? place.node.Scalar() : "";
  if (name != "polar" && name != "cartesian_u" && name != "cartesian_ue") {
    place.fail("'polar', 'cartesian_u' or 'cartesian_ue'", place.what());
  }
  return name;
}

/// [u_x, u_y, e] of every segment, none shorter than nothing.
void expect_lengths(const Place& q, const EvalCase& read) {
  for (int i = 0; i < read.arm.size(); ++i) {
    const int e = 3 * i + 2;
    const double length = read.arm.segments[static_cast<std::size_t>(i)].length_m;
    if (length + read.q(e) <= 0.0) {
      const Place place = q.at(static_cast<std::size_t>(e));
      place.fail(fmt::format("an elongation above -{} m, the length at rest", length),
                 place.what());
    }
  }
}

EvalChambers read_chambers(const Place& geometry, const Place& pressures, std::size_t segments) {
  EvalChambers result;
  geometry.expect_list(segments);
  pressures.expect_list(segments);
  for (std::size_t i = 0; i < segments; ++i) {
    const Place one = geometry.at(i);
    result.geometry.push_back({.angles_rad = one.at("chi").numbers(),
                               .offset_m = one.at("r").non_negative(),
                               .area_n_per_bar = one.at("a").positive()});
    pressures.at(i).expect_list(result.geometry.back().angles_rad.size());
    result.pressures_bar.push_back(pressures.at(i).numbers());
  }
  return result;
}

EvalInverseKinematics read_inverse_kinematics(const Place& ik) {
  EvalInverseKinematics inputs;
  inputs.gains = {.lambda_1ps = ik.at("lambda1").number(),
                  .lambda_position_1ps2 = ik.at("lambda_p").number(),
                  .lambda_velocity_1ps = ik.at("lambda_d").number()};
  inputs.reference = {.position_m = ik.at("p_d").vector(3),
                      .velocity_mps = ik.at("pd_dot").vector(3),
                      .acceleration_mps2 = ik.at("pd_ddot").vector(3)};
  return inputs;
}

EvalCase read_case(const Place& place) {
  EvalCase result;
  const Place id = place.at("id");
  if (!id.node.IsScalar()) id.fail("a name", id.what());
  result.id = id.node.Scalar();
  const Place config = place.at("config");
  const std::string coordinates = read_coordinates(config);
  result.polar = coordinates == "polar";
  result.arm = read_arm(config, coordinates == "cartesian_ue");
  const int dof = result.arm.dof();
  result.q = place.at("q").vector(dof);
  if (result.arm.extensible) expect_lengths(place.at("q"), result);
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
    const Place forward = place.at("forward");
    result.tau_actuation = forward.at("tau_A").vector(dof);
    if (forward.has("f_tip")) result.tip_force_n = forward.at("f_tip").vector(3);
  }
  if (result.arm.extensible && place.has("chambers")) {
    result.chambers = read_chambers(config.at("chambers"), place.at("chambers").at("pressure"),
                                    result.arm.segments.size());
  }
  if (place.has("ik")) {
    // J^+ of (21) would count a metre as a radian.
    if (result.arm.extensible) place.at("ik").fail("coords polar or cartesian_u", coordinates);
    result.inverse_kinematics = read_inverse_kinematics(place.at("ik"));
  }
  return result;
}

YAML::Node load(const std::string& file) {
  if (std::filesystem::is_directory(file)) throw ConfigError(file, 0, "", "a file", "a folder");
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
