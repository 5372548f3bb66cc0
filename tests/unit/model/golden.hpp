// The golden cases (128 digits and more, rounded to double): arms of constant length and arms that
// stretch, with the tolerances that come with the former (those of the latter: extensible_golden.hpp).
#pragma once

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "softarm/model/arm.hpp"
#include "softarm/model/chambers.hpp"

namespace softarm::golden {

using Terms = std::map<std::string, Eigen::MatrixXd>;

struct Case {
  std::string id;
  bool polar = false;
  ArmParameters arm;
  Eigen::VectorXd q, qd;
  Terms expected, distributed;            ///< absent keys: null in the file
  Terms control, forward, ik;             ///< inputs and results
  std::vector<ChamberGeometry> chambers;  ///< of every segment, where the arm is extensible
  Terms chamber;                          ///< of all segments one after the other
};

inline void flatten(const YAML::Node& node, std::vector<double>& out) {
  if (node.IsScalar()) {
    out.push_back(node.as<double>());
  } else {
    for (const auto& child : node) flatten(child, out);
  }
}

inline bool has_null(const YAML::Node& node) {
  if (node.IsNull()) return true;
  return node.IsSequence() &&
         std::any_of(node.begin(), node.end(), [](const YAML::Node& n) { return has_null(n); });
}

/// A list as a column, a list of lists as a matrix, a list of 4 x 4 poses as 4 rows and 4 n
/// columns.
inline Eigen::MatrixXd matrix(const YAML::Node& node) {
  std::vector<double> numbers;
  flatten(node, numbers);
  const auto count = static_cast<Eigen::Index>(numbers.size());
  if (!node.IsSequence() || !node[0].IsSequence()) {
    return Eigen::Map<Eigen::VectorXd>(numbers.data(), count);
  }
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  if (node[0][0].IsSequence()) {
    Eigen::MatrixXd poses(4, count / 4);
    for (Eigen::Index i = 0; i < count / 16; ++i) {
      poses.middleCols<4>(4 * i) =
          Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(numbers.data() + 16 * i);
    }
    return poses;
  }
  const auto rows = static_cast<Eigen::Index>(node.size());
  return Eigen::Map<RowMajor>(numbers.data(), rows, count / rows);
}

inline Terms terms(const YAML::Node& node) {
  Terms result;
  if (!node) return result;
  for (const auto& entry : node) {
    if (!entry.second.IsMap() && !has_null(entry.second) && entry.first.as<std::string>() != "id") {
      result[entry.first.as<std::string>()] = matrix(entry.second);
    }
  }
  return result;
}

/// What stands under `chambers`, of all segments one after the other.
inline Terms chamber_terms(const YAML::Node& node) {
  Terms result;
  for (const auto& entry : node["chambers"]) {
    std::vector<double> numbers;
    flatten(entry.second, numbers);
    result[entry.first.as<std::string>()] =
        Eigen::Map<Eigen::VectorXd>(numbers.data(), static_cast<Eigen::Index>(numbers.size()));
  }
  return result;
}

inline void read_extensible(const YAML::Node& node, Case& c) {
  const YAML::Node config = node["config"];
  c.arm.extensible = true;
  for (std::size_t i = 0; i < c.arm.segments.size(); ++i) {
    c.arm.segments[i].axial_stiffness_n_per_m = config["k_a"][i].as<double>();
    c.arm.segments[i].axial_damping_ns_per_m = config["beta_a"][i].as<double>();
    const YAML::Node chambers = config["chambers"][i];
    c.chambers.push_back({.angles_rad = chambers["chi"].as<std::vector<double>>(),
                          .offset_m = chambers["r"].as<double>(),
                          .area_n_per_bar = chambers["a"].as<double>()});
  }
  c.chamber = chamber_terms(node);
}

inline Case read_case(const YAML::Node& node) {
  Case c;
  c.id = node["id"].as<std::string>();
  const YAML::Node config = node["config"];
  c.polar = config["coords"].as<std::string>() == "polar";
  for (int i = 0; i < config["n"].as<int>(); ++i) {
    c.arm.segments.push_back({.length_m = config["L"][i].as<double>(),
                              .mass_kg = config["mu"][i].as<double>(),
                              .stiffness_nm_per_rad = config["k"][i].as<double>(),
                              .damping_nms_per_rad = config["beta"][i].as<double>()});
  }
  if (config["coords"].as<std::string>() == "cartesian_ue") read_extensible(node, c);
  c.arm.mass = MassModel::point;
  c.arm.base_rotation = matrix(config["base_rotation"]);
  c.arm.base_position_m = matrix(config["base_position"]);
  c.arm.gravity_mps2 = matrix(config["gravity"]);
  c.q = matrix(node["q"]);
  c.qd = matrix(node["qd"]);
  c.expected = terms(node["expected"]);
  c.distributed = terms(node["expected_distributed"]);
  c.control = terms(node["control"]);
  c.forward = terms(node["forward"]);
  c.ik = terms(node["ik"]);
  return c;
}

inline std::string path(const std::string& name = "golden.json") {
  return std::string(SOFTARM_SOURCE_DIR) + "/tests/golden/" + name;
}

inline std::vector<Case> read_cases(const std::string& file) {
  std::vector<Case> result;
  for (const auto& node : YAML::LoadFile(file)["cases"]) result.push_back(read_case(node));
  return result;
}

inline const std::vector<Case>& cases() {
  static const std::vector<Case> all = read_cases(path());
  return all;
}

/// Largest error over tolerance of one term: at most 1 is a pass.
inline double error_over_tolerance(const Case& c, const Terms& expected, const std::string& key,
                                   const Eigen::MatrixXd& got) {
  const Eigen::MatrixXd& want = expected.at(key);
  if (got.rows() != want.rows() || got.cols() != want.cols() || !got.allFinite()) return INFINITY;
  const Eigen::MatrixXd error = (got - want).cwiseAbs();
  const Eigen::VectorXd s = expected.at("B").diagonal().cwiseSqrt();
  const double inertia = s.maxCoeff() * s.maxCoeff();
  const double speed = c.qd.cwiseAbs().maxCoeff();
  const auto largest = [](const Eigen::MatrixXd& m) { return m.cwiseAbs().maxCoeff(); };
  if (key == "B") {
    return (s.array() == 0).any() ? largest(error) / 1e-12
                                  : largest(error.cwiseQuotient(s * s.transpose())) / 1e-12;
  }
  if (key == "C") {
    const Eigen::MatrixXd scale = (s * s.transpose()).array() * 1e-12;
    return largest(error.cwiseQuotient((scale.array() + 1e-13 * inertia * speed).matrix()));
  }
  if (key == "Cqd") {
    return largest(error) / (1e-12 * largest(want) + 1e-13 * inertia * speed * speed);
  }
  if (key == "G") return largest(error) / (1e-12 * std::max(largest(want), 1e-3));
  if (key == "kinetic_energy") return largest(error) / (1e-12 * largest(want));
  if (key == "gravity_potential") {
    double sum = 0.0;
    const Eigen::MatrixXd& centres = c.expected.at("com_world");
    for (int i = 0; i < c.arm.size(); ++i) {
      sum += c.arm.segments[static_cast<std::size_t>(i)].mass_kg *
             std::abs(centres.row(i).dot(c.arm.gravity_mps2));
    }
    return largest(error) / (1e-12 * std::max(sum, 1e-3 * largest(want)));
  }
  if (key.starts_with("qdd")) {
    const double condition = std::max(c.expected.at("cond_B_scaled")(0), 1e3);
    return largest(error.cwiseProduct(s)) / (1e-14 * condition * largest(want.cwiseProduct(s)));
  }
  if (key.starts_with("J")) return largest(error) / (1e-13 * std::max(1.0, largest(want)));
  return largest(error) / (1e-13 * std::max(1.0, largest(want)));  // T, com, A, K, D
}

}  // namespace softarm::golden
