// What a model with other terms would predict, from the sensitivities of one model alone.
#pragma once

#include <vector>

#include "softarm/commissioning/identification/term_selection.hpp"

namespace softarm {

/// Forecasts, without a simulation for each of them, the error on motion not seen of models near one
/// that was identified: the response is taken as linear in the unknowns of the model with all terms.
/// Which terms stand in for each other shows in it, as it does not in what each gains alone. Good for
/// an order of what to try, not for a choice.
class ExchangeForecast {
 public:
  /// @param all  unknowns of the model with all terms; must outlive this
  /// @param arms  what was identified in every fold
  /// @throws std::runtime_error where the response next to an arm is not bounded
  ExchangeForecast(const ParameterSet& all, const std::vector<Fold>& folds,
                   const std::vector<ArmHypothesis>& arms, double prior, int threads);

  /// RMS over all folds of the model with the unknowns `of`, identified again; rad.
  double unseen_rad(const ParameterSet& of) const;

 private:
  /// The normal equations of a set of frames: J'J, J'r and r'r.
  struct Normal {
    Eigen::MatrixXd information;
    Eigen::VectorXd gradient;
    double squares = 0.0, count = 0.0, inflation = 1.0;
  };
  struct Part {
    ArmHypothesis arm;
    Normal seen, unseen;
  };
  Normal normal(const ArmHypothesis& arm, std::span<const MotionRecord> records, int threads) const;

  const ParameterSet& all_;
  double prior_;
  std::vector<Part> parts_;
};

}  // namespace softarm
