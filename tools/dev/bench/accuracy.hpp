// How exact each method is: against the golden file, and against the long double model over theta.
#pragma once

#include <vector>

#include "dev/bench/known_states.hpp"
#include "dev/bench/methods.hpp"

namespace softarm {

struct LargestError {
  double relative = 0.0;  ///< NaN where a method gave none
  int states = 0;         ///< those that the method covers
};

/// Largest error of any term over the size that its entries can have there (max s_i s_j for B, max
/// s_i r_j for C, max s_i w for G; the sum of the magnitudes for (17) and the recursions; see
/// reference::Dynamics).
LargestError largest_error(const Method& method, const std::vector<KnownState>& states);

}  // namespace softarm
