// What `softarm-dev bench python` sets beside the Python package: the same calls in C++.
#pragma once

#include <vector>

#include "softarm/config/experiment.hpp"

namespace softarm {

/// Exact derivatives over one evaluation of what they are of, each the median over the rounds.
struct DerivativeCost {
  bool stretching = false;
  int segments = 0;
  double forward_us = 0.0, derivatives_us = 0.0;
  double forward_ratio = 0.0;  ///< forward dynamics with all its derivatives
  double static_ratio = 0.0;   ///< static stiffness over static moments
};
/// Of arms of 1, 3, 5 and 10 segments, of constant length and stretching, with mass along the arc.
std::vector<DerivativeCost> time_derivatives();

/// Medians, in us a call.
struct PythonPeers {
  double controller_us = 0.0;   ///< (17), processor time
  double tick_us = 0.0;         ///< the pipeline's tick in lock step, wall clock
  double forward_us = 0.0;      ///< forward dynamics of three of the paper's segments
  double derivatives_us = 0.0;  ///< the same with its derivatives
};
PythonPeers time_python_peers(const Experiment& experiment);

}  // namespace softarm
