#include "simulation/cvode_integrator.hpp"

#include <cvode/cvode.h>

#include <stdexcept>

namespace softarm {

CvodeIntegrator::CvodeIntegrator(SecondOrderSystem& system, const IntegratorSettings& settings)
    : Integrator(system, settings) {
  guess_.setZero(size_);
  cvode_ = CVodeCreate(CV_BDF, context_.get());
  if (cvode_ == nullptr) throw std::runtime_error("plant: CVodeCreate refused");
  check(CVodeSetErrHandlerFn(cvode_, keep_message, self()), "CVodeSetErrHandlerFn");
  check(CVodeInit(cvode_, derivative, 0.0, y_.get()), "CVodeInit");
  check(CVodeSetUserData(cvode_, self()), "CVodeSetUserData");
  check(CVodeSVtolerances(cvode_, settings.relative_tolerance, tolerances_.get()),
        "CVodeSVtolerances");
  check(CVodeSetNonlinearSolver(cvode_, make_solver(solve_step)), "CVodeSetNonlinearSolver");
  check(CVodeSetMaxNumSteps(cvode_, kMaxSteps), "CVodeSetMaxNumSteps");
  check(CVodeSetMaxErrTestFails(cvode_, kMaxErrorTestFailures), "CVodeSetMaxErrTestFails");
  check(CVodeSetMinStep(cvode_, kMinStep_s), "CVodeSetMinStep");
  check(CVodeSetMaxStep(cvode_, settings.max_step_s), "CVodeSetMaxStep");
}

CvodeIntegrator::~CvodeIntegrator() { CVodeFree(&cvode_); }

// z = prediction - rl1 zn1 + gamma f(t, z); zn1 is the predicted y' times the step.
int CvodeIntegrator::solve_step(SUNNonlinearSolver solver, N_Vector, N_Vector correction,
                                N_Vector weights, double tolerance, int, void*) {
  auto& self = static_cast<CvodeIntegrator&>(of(solver->content));
  double t_s = 0.0, gamma = 0.0, rl1 = 0.0;
  N_Vector predicted = nullptr, stage = nullptr, rate = nullptr, scaled_rate = nullptr;
  void* user = nullptr;
  if (CVodeGetNonlinearSystemData(self.cvode_, &t_s, &predicted, &stage, &rate, &gamma, &rl1,
                                  &scaled_rate, &user) != CV_SUCCESS) {
    return SUN_NLS_MEM_NULL;
  }
  const double* prediction = N_VGetArrayPointer(predicted);
  const double* zn1 = N_VGetArrayPointer(scaled_rate);
  self.s_ = ConstMap(prediction, self.length()) - rl1 * ConstMap(zn1, self.length());
  self.guess_ = (rl1 / gamma) * ConstMap(zn1 + self.size_, self.size_);
  return self.correct(t_s, gamma, prediction, weights, tolerance, self.guess_.data(), correction);
}

void CvodeIntegrator::input_jumped() { restart(time_s_, 0.0); }

void CvodeIntegrator::restart(double t_s, double first_step_s) {
  const IntegratorCounters before = counters();
  steps_before_ = before.steps;
  rejected_before_ = before.rejected_steps;
  check(CVodeReInit(cvode_, t_s, y_.get()), "CVodeReInit");
  check(CVodeSetInitStep(cvode_, first_step_s), "CVodeSetInitStep");
  stages_.forget();
}

int CvodeIntegrator::evolve(double t_end_s, double* reached_s) {
  const int flag = settings_.smooth_input ? CV_SUCCESS : CVodeSetStopTime(cvode_, t_end_s);
  return flag < 0 ? flag : CVode(cvode_, t_end_s, y_.get(), reached_s, CV_NORMAL);
}

std::string CvodeIntegrator::flag_name(int flag) const {
  return owned_text(CVodeGetReturnFlagName(flag));
}

IntegratorCounters CvodeIntegrator::counters() const {
  long steps = 0, rejected = 0;
  CVodeGetNumSteps(cvode_, &steps);
  CVodeGetNumErrTestFails(cvode_, &rejected);
  return {.steps = steps_before_ + steps,
          .rejected_steps = rejected_before_ + rejected,
          .residual_evaluations = stages_.iterations(),
          .linearizations = stages_.linearizations(),
          .retries = retries_};
}

}  // namespace softarm
