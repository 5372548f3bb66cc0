// States at which the terms of the model are known: the golden file, and a sweep over theta.
#pragma once

#include <string>
#include <vector>

#include "dev/bench/states.hpp"
#include "dev/reference_model/reference_model.hpp"
#include "softarm/model/arm.hpp"

namespace softarm {

/// A state, and what the terms are there.
struct KnownState {
  ArmParameters arm;
  bool polar = false;  ///< `state.q` is given and `terms` are in polar; otherwise `state.u`
  BenchState state;
  std::vector<double> kp, kd;
  reference::Dynamics terms;
};

/// The cases of the golden file (130-digit results) for one mass model, with the scales of the long
/// double model. @throws std::exception where the file cannot be read.
std::vector<KnownState> golden_states(const std::string& file, MassModel mass);

/// Three of the paper's segments, all at one theta from 1e-12 to 7 rad, any phi, against the long
/// double model.
std::vector<KnownState> sweep_states(bool polar, MassModel mass);

}  // namespace softarm
