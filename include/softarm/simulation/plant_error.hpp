// What went wrong in the simulated arm, with the evidence: the only exception that simulating one
// throws.
#pragma once

#include <Eigen/Core>
#include <stdexcept>
#include <string>

namespace softarm {

/// The integrator gave up, twice. The plant is left where it was before the call that failed;
/// nothing it returns is a half-integrated state. what() names the time, the cause and the solver's
/// own words.
class PlantError : public std::runtime_error {
 public:
  double time_s;             ///< of the last state that met the tolerance
  std::string cause;         ///< the solver's flag by name, for example "ARK_ERR_FAILURE"
  Eigen::VectorXd u_rad;     ///< configuration at `time_s`
  Eigen::VectorXd velocity;  ///< its rate at `time_s`, rad/s

  PlantError(double time, std::string flag, const std::string& detail, Eigen::VectorXd u,
             Eigen::VectorXd rate)
      : std::runtime_error("plant: integration failed at t = " + std::to_string(time) +
                           " s: " + flag + (detail.empty() ? "" : " (" + detail + ")")),
        time_s(time),
        cause(std::move(flag)),
        u_rad(std::move(u)),
        velocity(std::move(rate)) {}
};

}  // namespace softarm
