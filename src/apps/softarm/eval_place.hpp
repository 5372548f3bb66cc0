// A node of the cases of `softarm eval` that knows where it is, for messages.
#pragma once

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <Eigen/Core>
#include <Eigen/LU>
#include <cmath>
#include <string>
#include <vector>

#include "softarm/config/config_error.hpp"

namespace softarm {

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
  std::vector<double> numbers() const {
    if (!node.IsSequence() || node.size() == 0) fail("a list of numbers", what());
    std::vector<double> result;
    for (std::size_t i = 0; i < node.size(); ++i) result.push_back(at(i).number());
    return result;
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

}  // namespace softarm
