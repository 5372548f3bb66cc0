// The input map: from chamber pressures to the generalized force in u.
#pragma once

#include <Eigen/Core>

#include "softarm/actuation/settings.hpp"

namespace softarm {

/// Input map of one segment, 2 x chambers, N m per bar, with columns -g (cos chi, sin chi): f = map
/// p is the generalized force that pressures p (bar) add to that segment's u. With actuation by
/// torque p is tau_A and the columns are those of A_chamber (times the gains, which are 1 unless
/// the simulated arm has a mismatch).
Eigen::Matrix2Xd input_map(ActuationKind kind, const std::vector<Chamber>& segment);

/// The axial force of every chamber's pressure on one segment, N per bar: its effective area, gain
/// over offset. 0 with actuation by torque.
Eigen::RowVectorXd axial_input_map(ActuationKind kind, const std::vector<Chamber>& segment);

/// Input map of the whole arm, 2n x chambers in the order of the valves: f = map p. Where segments
/// stretch, 3n x chambers with the axial force as every third row.
Eigen::MatrixXd input_map(const ActuationSettings& settings, bool extensible = false);

}  // namespace softarm
