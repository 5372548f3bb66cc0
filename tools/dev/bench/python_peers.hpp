// What `softarm-dev bench python` sets beside the Python package: the same calls in C++.
#pragma once

#include "softarm/config/experiment.hpp"

namespace softarm {

/// Medians, in us a call.
struct PythonPeers {
  double controller_us = 0.0;   ///< (17), processor time
  double tick_us = 0.0;         ///< the pipeline's tick in lock step, wall clock
  double forward_us = 0.0;      ///< forward dynamics of three of the paper's segments
  double derivatives_us = 0.0;  ///< the same with its derivatives
};
PythonPeers time_python_peers(const Experiment& experiment);

}  // namespace softarm
