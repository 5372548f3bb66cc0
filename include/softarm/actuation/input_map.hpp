// What chambers do to the generalized force in u.
#pragma once

#include <Eigen/Core>

#include "softarm/actuation/settings.hpp"

namespace softarm {

/// Columns -g (cos chi, sin chi), one a chamber of one segment, N m per bar: f = columns p is the
/// generalized force that pressures p (bar) add to that segment's u. With actuation by torque the
/// columns of A_chamber (times the gains, 1 but for a mismatch), for p = tau_A.
Eigen::Matrix2Xd input_map(ActuationKind kind, const std::vector<Chamber>& segment);

/// Of the whole arm, 2n x chambers in the order of the valves: f = map p.
Eigen::MatrixXd input_map(const ActuationSettings& settings);

}  // namespace softarm
