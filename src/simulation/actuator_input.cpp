#include "softarm/simulation/actuator_input.hpp"

#include <algorithm>

#include "softarm/actuation/chamber_hysteresis.hpp"
#include "softarm/simulation/valves.hpp"

namespace softarm {

void ActuatorInput::follow(double t_s, const Valves& valves, const ChamberHysteresis& hysteresis,
                           const Eigen::MatrixXd& map) {
  valves_ = &valves;
  hysteresis_ = &hysteresis;
  map_ = &map;
  pressures_bar_.resize(valves.size());
  since_s_ = t_s;
  known_ = false;
}

const Eigen::VectorXd& ActuatorInput::force_of_valves_nm(double t_s) {
  if (!known_ || t_s != time_s_) {
    valves_->after(std::max(0.0, t_s - since_s_), pressures_bar_);
    acting_bar_ = pressures_bar_;
    if (hysteresis_->active()) hysteresis_->apply(acting_bar_);
    force_nm_.noalias() = *map_ * acting_bar_;
    time_s_ = t_s;
    known_ = true;
  }
  return force_nm_;
}

}  // namespace softarm
