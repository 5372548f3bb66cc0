#include "softarm/actuation/chamber_hysteresis.hpp"

#include <algorithm>
#include <limits>

#include "softarm/model/memory.hpp"

namespace softarm {

ChamberHysteresis::ChamberHysteresis(double part, const std::vector<double>& half_width_bar,
                                     int chambers)
    : active_(part > 0.0 && !half_width_bar.empty()),
      weight_(Eigen::VectorXd::Constant(
          static_cast<Eigen::Index>(half_width_bar.size()),
          part / std::max(1.0, static_cast<double>(half_width_bar.size())))),
      half_width_bar_(Eigen::VectorXd::Map(half_width_bar.data(),
                                           static_cast<Eigen::Index>(half_width_bar.size()))),
      output_bar_(Eigen::MatrixXd::Zero(half_width_bar_.size(), chambers)) {}

double ChamberHysteresis::slack(Eigen::Index k, Eigen::Index chamber,
                                double pressure_bar) const noexcept {
  return play(output_bar_(k, chamber), pressure_bar, half_width_bar_[k]) - pressure_bar;
}

double ChamberHysteresis::acting(Eigen::Index chamber, double pressure_bar) const noexcept {
  double sum = pressure_bar;
  for (Eigen::Index k = 0; k < weight_.size(); ++k)
    sum += weight_[k] * slack(k, chamber, pressure_bar);
  return sum;
}

void ChamberHysteresis::set_weights(Eigen::Ref<const Eigen::VectorXd> weight) noexcept {
  weight_ = weight;
  active_ = weight_.size() > 0;
}

// acting() is linear between the pressures at which an operator begins to move, and has the slope 1
// beyond all of them.
double ChamberHysteresis::pressure(Eigen::Index chamber, double acting_bar) const noexcept {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  double below = -kInfinity, above = kInfinity;            // neighbouring such pressures
  double below_acts = -kInfinity, above_acts = kInfinity;  // what acts there
  for (Eigen::Index k = 0; k < half_width_bar_.size(); ++k) {
    for (const double side : {-1.0, 1.0}) {
      const double bend = output_bar_(k, chamber) + side * half_width_bar_[k];
      if (bend <= below || bend >= above) continue;
      const double acts = acting(chamber, bend);
      if (acts <= acting_bar) {
        below = bend;
        below_acts = acts;
      } else {
        above = bend;
        above_acts = acts;
      }
    }
  }
  if (below == -kInfinity) return above == kInfinity ? acting_bar : above + acting_bar - above_acts;
  if (above == kInfinity) return below + acting_bar - below_acts;
  return below + (above - below) * ((acting_bar - below_acts) / (above_acts - below_acts));
}

void ChamberHysteresis::apply(Eigen::Ref<Eigen::VectorXd> pressure_bar) const noexcept {
  for (Eigen::Index j = 0; j < pressure_bar.size(); ++j)
    pressure_bar[j] = acting(j, pressure_bar[j]);
}

void ChamberHysteresis::remember(Eigen::Ref<const Eigen::VectorXd> pressure_bar) noexcept {
  for (Eigen::Index j = 0; j < pressure_bar.size(); ++j)
    for (Eigen::Index k = 0; k < half_width_bar_.size(); ++k)
      output_bar_(k, j) = play(output_bar_(k, j), pressure_bar[j], half_width_bar_[k]);
}

}  // namespace softarm
