// softarm.Arm: an arm's parameters with the storage of its dynamics.
#pragma once

#include <optional>

#include "module.hpp"
#include "softarm/model/arm.hpp"
#include "softarm/model/derivatives.hpp"
#include "softarm/model/dynamics.hpp"

namespace softarm::python {

/// Python calls with the interpreter's lock held.
struct Arm {
  explicit Arm(const ArmParameters& arm) : parameters(arm), workspace(arm) {}
  /// The argument itself, checked: for use within the same expression.
  ConstVectorRef u(ConstVectorRef value, const char* name = "u") const {
    return expect(value, parameters.dof(), name);
  }
  /// Made at the first use: its storage is many times that of the dynamics.
  ModelDerivatives& derivatives() {
    if (!slopes) slopes.emplace(parameters);
    return *slopes;
  }

  ArmParameters parameters;
  DynamicsWorkspace workspace;
  std::optional<ModelDerivatives> slopes;
};

void bind_derivatives(py::class_<Arm>& type);

}  // namespace softarm::python
