// CVODE's and IDA's multistep methods on a second-order system in residual form.
#pragma once

#include <sundials/sundials_nonlinearsolver.h>

#include "simulation/integrator.hpp"
#include "simulation/stage_solver.hpp"

namespace softarm {

/// What CVODE and IDA have in common: in either, a step is one equation z = s + gamma f(t, z),
/// which StageSolver solves through the residual with a matrix of size n.
///
/// Each call of `advance` ends on a step (unless `smooth_input`), since the input after it is not
/// known; the steps before are remembered. That is sound while x'' is continuous, as behind a valve
/// with a lag, whose torque only changes its slope at a command; error control meets the kink with
/// shorter steps. Where x'' jumps, `input_jumped` makes the method start anew at order 1.
class MultistepIntegrator : public Integrator {
 public:
  ~MultistepIntegrator() override;
  void input_jumped() override;
  IntegratorCounters counters() const override;

 protected:
  MultistepIntegrator(SecondOrderSystem& system, const IntegratorSettings& settings);

  using Solve = int (*)(SUNNonlinearSolver, N_Vector, N_Vector, N_Vector, double, int, void*);
  /// A solver that calls `solve` with `this` for its content.
  void make_solver(Solve solve);
  int correct(double t_s, double gamma_s, const double* prediction, const double* guess,
              N_Vector weights, double tolerance, N_Vector correction);
  /// y' at y_; false where B is not positive definite.
  bool derivative(double t_s, const double* y, double* rate);
  static void keep_message(int, const char*, const char*, char* text, void* self);
  virtual void count(long* steps, long* rejected) const = 0;
  void forget_counts();  ///< to be called before each restart

  StageSolver stages_;
  SUNNonlinearSolver solver_ = nullptr;
  Eigen::VectorXd s_, guess_;

 private:
  // SUNDIALS counts from the last restart.
  std::int64_t steps_before_ = 0, rejected_before_ = 0;
};

/// BDF or Adams in Nordsieck's form.
class CvodeIntegrator final : public MultistepIntegrator {
 public:
  CvodeIntegrator(SecondOrderSystem& system, const IntegratorSettings& settings);
  ~CvodeIntegrator() override;

 private:
  int evolve(double t_end_s, double* reached_s) override;
  void restart(double t_s, double first_step_s) override;
  std::string flag_name(int flag) const override;
  void count(long* steps, long* rejected) const override;
  static int solve(SUNNonlinearSolver, N_Vector, N_Vector, N_Vector, double, int, void*);
  static int call_derivative(double t_s, N_Vector y, N_Vector rate, void* self);

  void* cvode_ = nullptr;
};

/// BDF on F(t, y, y') = [x' - v; r(t, x, v, v')] = 0.
class IdaIntegrator final : public MultistepIntegrator {
 public:
  IdaIntegrator(SecondOrderSystem& system, const IntegratorSettings& settings);
  ~IdaIntegrator() override;

 private:
  int evolve(double t_end_s, double* reached_s) override;
  void restart(double t_s, double first_step_s) override;
  std::string flag_name(int flag) const override;
  void count(long* steps, long* rejected) const override;
  static int solve(SUNNonlinearSolver, N_Vector, N_Vector, N_Vector, double, int, void*);
  static int residual(double t_s, N_Vector y, N_Vector rate, N_Vector out, void* self);

  void* ida_ = nullptr;
  NVector rate_;
};

}  // namespace softarm
