#include "softarm/simulation/chamber_hysteresis.hpp"

#include "softarm/model/memory.hpp"

namespace softarm {

ChamberHysteresis::ChamberHysteresis(double part, const std::vector<double>& half_width_bar,
                                     int chambers)
    : part_(part),
      half_width_bar_(Eigen::VectorXd::Map(half_width_bar.data(),
                                           static_cast<Eigen::Index>(half_width_bar.size()))),
      output_bar_(Eigen::MatrixXd::Zero(half_width_bar_.size(), chambers)) {}

void ChamberHysteresis::apply(Eigen::Ref<Eigen::VectorXd> pressure_bar) const noexcept {
  const Eigen::Index operators = half_width_bar_.size();
  for (Eigen::Index j = 0; j < pressure_bar.size(); ++j) {
    double sum = 0.0;
    for (Eigen::Index k = 0; k < operators; ++k)
      sum += play(output_bar_(k, j), pressure_bar[j], half_width_bar_[k]);
    pressure_bar[j] += part_ * (sum / static_cast<double>(operators) - pressure_bar[j]);
  }
}

void ChamberHysteresis::remember(const Eigen::VectorXd& pressure_bar) noexcept {
  for (Eigen::Index j = 0; j < pressure_bar.size(); ++j)
    for (Eigen::Index k = 0; k < half_width_bar_.size(); ++k)
      output_bar_(k, j) = play(output_bar_(k, j), pressure_bar[j], half_width_bar_[k]);
}

}  // namespace softarm
