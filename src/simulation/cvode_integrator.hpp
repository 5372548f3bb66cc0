// CVODE's multistep method on a second-order system in residual form.
#pragma once

#include "simulation/integrator.hpp"

namespace softarm {

/// Backward differences in Nordsieck's form.
///
/// Each call of `advance` ends on a step (unless `smooth_input`), since the input after it is not
/// known; the steps before are remembered. That is sound while x'' is continuous, as behind a valve
/// with a lag, whose torque only changes its slope at a command; error control meets the kink with
/// shorter steps. Where x'' jumps, `input_jumped` makes the method start again at order 1.
class CvodeIntegrator final : public Integrator {
 public:
  CvodeIntegrator(SecondOrderSystem& system, const IntegratorSettings& settings);
  ~CvodeIntegrator() override;
  void input_jumped() override;
  IntegratorCounters counters() const override;

 private:
  int evolve(double t_end_s, double* reached_s) override;
  void restart(double t_s, double first_step_s) override;
  std::string flag_name(int flag) const override;
  /// One step's equation z = s + gamma f(t, z).
  static int solve_step(SUNNonlinearSolver, N_Vector, N_Vector, N_Vector, double, int, void*);

  void* cvode_ = nullptr;
  Eigen::VectorXd guess_;
  std::int64_t steps_before_ = 0, rejected_before_ = 0;  // CVODE counts from the last restart
};

}  // namespace softarm
