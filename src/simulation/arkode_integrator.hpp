// ARKODE's one-step methods on a second-order system in residual form.
#pragma once

#include "simulation/integrator.hpp"

namespace softarm {

/// Diagonally implicit Runge-Kutta methods and, for systems that are not stiff, an explicit one.
///
/// One-step methods forget nothing at a change of the input, so a command every millisecond costs
/// no restart. Of the diagonally implicit ones only those without an explicit first stage are used:
/// they never evaluate x'' = B^-1 (...) at the old input. The stages are solved by StageSolver
/// through the residual.
class ArkodeIntegrator final : public Integrator {
 public:
  /// @param system outlives the integrator.
  /// @throw std::invalid_argument for tolerances that are not positive and finite.
  ArkodeIntegrator(SecondOrderSystem& system, const IntegratorSettings& settings);
  ~ArkodeIntegrator() override;

  IntegratorCounters counters() const override;

 private:
  int evolve(double t_end_s, double* reached_s) override;
  void restart(double t_s, double first_step_s) override;
  std::string flag_name(int flag) const override;
  void set_method();

  static int solve_stage(SUNNonlinearSolver solver, N_Vector y, N_Vector correction,
                         N_Vector weights, double tolerance, int, void*);

  void* arkode_ = nullptr;
  Eigen::VectorXd acceleration_;
};

}  // namespace softarm
