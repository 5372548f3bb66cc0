#include "simulation/multistep_integrator.hpp"

#include <cvode/cvode.h>
#include <ida/ida.h>
#include <nvector/nvector_serial.h>

#include <cstdlib>
#include <stdexcept>

namespace softarm {
namespace {

constexpr long kMaxSteps = 1'000'000;  // in one call to advance
constexpr int kMaxErrorTestFailures = 40;
constexpr double kMinStep_s = 1e-12;  // what needs less is not a motion of an arm

SUNNonlinearSolver_Type solver_type(SUNNonlinearSolver) { return SUNNONLINEARSOLVER_ROOTFIND; }
int ignore_system(SUNNonlinearSolver, SUNNonlinSolSysFn) { return SUN_NLS_SUCCESS; }

std::string owned_text(char* name) {
  std::string text = name != nullptr ? name : "UNKNOWN";
  std::free(name);
  return text;
}

}  // namespace

MultistepIntegrator::MultistepIntegrator(SecondOrderSystem& system,
                                         const IntegratorSettings& settings)
    : Integrator(system, settings), stages_(system) {
  s_.setZero(length());
  guess_.setZero(size_);
}

MultistepIntegrator::~MultistepIntegrator() {
  if (solver_ != nullptr) SUNNonlinSolFreeEmpty(solver_);
}

void MultistepIntegrator::make_solver(Solve solve) {
  solver_ = SUNNonlinSolNewEmpty(context_.get());
  solver_->content = this;
  solver_->ops->gettype = solver_type;
  solver_->ops->solve = solve;
  solver_->ops->setsysfn = ignore_system;
}

void MultistepIntegrator::input_jumped() { restart(time_s_, 0.0); }

int MultistepIntegrator::correct(double t_s, double gamma_s, const double* prediction,
                                 const double* guess, N_Vector weights, double tolerance,
                                 N_Vector correction) {
  return stages_.correct(t_s, gamma_s, s_, prediction, N_VGetArrayPointer(weights), tolerance,
                         guess, energy_, N_VGetArrayPointer(correction))
             ? SUN_NLS_SUCCESS
             : SUN_NLS_CONV_RECVR;
}

bool MultistepIntegrator::derivative(double t_s, const double* y, double* rate) {
  const ConstMap x(y, size_);
  const ConstMap v(y + size_, size_);
  Map(rate, size_) = v;
  if (!system_.acceleration(t_s, x, v, Map(rate + size_, size_))) return false;
  if (energy_) {
    const auto powers = system_.powers(t_s, x, v);
    rate[2 * size_] = powers.supplied_w;
    rate[2 * size_ + 1] = powers.dissipated_w;
  }
  return true;
}

void MultistepIntegrator::keep_message(int, const char*, const char*, char* text, void* self) {
  static_cast<MultistepIntegrator*>(self)->message_ = text;
}

void MultistepIntegrator::forget_counts() {
  long steps = 0, rejected = 0;
  count(&steps, &rejected);
  steps_before_ += steps;
  rejected_before_ += rejected;
}

IntegratorCounters MultistepIntegrator::counters() const {
  long steps = 0, rejected = 0;
  count(&steps, &rejected);
  return {.steps = steps_before_ + steps,
          .rejected_steps = rejected_before_ + rejected,
          .residual_evaluations = stages_.iterations(),
          .linearizations = stages_.linearizations(),
          .retries = retries_};
}

int CvodeIntegrator::call_derivative(double t_s, N_Vector y, N_Vector rate, void* user) {
  auto& self = *static_cast<CvodeIntegrator*>(user);
  return self.derivative(t_s, N_VGetArrayPointer(y), N_VGetArrayPointer(rate)) ? 0 : 1;
}

// z = prediction - rl1 zn1 + gamma f(t, z); zn1 is the predicted y' times the step.
int CvodeIntegrator::solve(SUNNonlinearSolver solver, N_Vector, N_Vector correction,
                           N_Vector weights, double tolerance, int, void*) {
  auto& self = *static_cast<CvodeIntegrator*>(solver->content);
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
  return self.correct(t_s, gamma, prediction, self.guess_.data(), weights, tolerance, correction);
}

CvodeIntegrator::CvodeIntegrator(SecondOrderSystem& system, const IntegratorSettings& settings)
    : MultistepIntegrator(system, settings) {
  cvode_ = CVodeCreate(settings.method == IntegratorMethod::cvode_adams ? CV_ADAMS : CV_BDF,
                       context_.get());
  if (cvode_ == nullptr) throw std::runtime_error("plant: CVodeCreate refused");
  check(CVodeSetErrHandlerFn(cvode_, keep_message, this), "CVodeSetErrHandlerFn");
  check(CVodeInit(cvode_, call_derivative, 0.0, y_.get()), "CVodeInit");
  check(CVodeSetUserData(cvode_, this), "CVodeSetUserData");
  check(CVodeSVtolerances(cvode_, settings.relative_tolerance, tolerances_.get()),
        "CVodeSVtolerances");
  make_solver(solve);
  check(CVodeSetNonlinearSolver(cvode_, solver_), "CVodeSetNonlinearSolver");
  check(CVodeSetMaxNumSteps(cvode_, kMaxSteps), "CVodeSetMaxNumSteps");
  check(CVodeSetMaxErrTestFails(cvode_, kMaxErrorTestFailures), "CVodeSetMaxErrTestFails");
  check(CVodeSetMinStep(cvode_, kMinStep_s), "CVodeSetMinStep");
  check(CVodeSetMaxStep(cvode_, settings.max_step_s), "CVodeSetMaxStep");
}

CvodeIntegrator::~CvodeIntegrator() { CVodeFree(&cvode_); }

void CvodeIntegrator::restart(double t_s, double first_step_s) {
  forget_counts();
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

void CvodeIntegrator::count(long* steps, long* rejected) const {
  CVodeGetNumSteps(cvode_, steps);
  CVodeGetNumErrTestFails(cvode_, rejected);
}

int IdaIntegrator::residual(double t_s, N_Vector y, N_Vector rate, N_Vector out, void* user) {
  auto& self = *static_cast<IdaIntegrator*>(user);
  const Eigen::Index n = self.size_;
  const double* state = N_VGetArrayPointer(y);
  const double* slope = N_VGetArrayPointer(rate);
  double* r = N_VGetArrayPointer(out);
  Map(r, n) = ConstMap(slope, n) - ConstMap(state + n, n);
  self.system_.residual(t_s, ConstMap(state, n), ConstMap(state + n, n), ConstMap(slope + n, n),
                        Map(r + n, n));
  if (self.energy_) {
    const auto powers = self.system_.powers(t_s, ConstMap(state, n), ConstMap(state + n, n));
    r[2 * n] = slope[2 * n] - powers.supplied_w;
    r[2 * n + 1] = slope[2 * n + 1] - powers.dissipated_w;
  }
  return 0;
}

// y' = yp + cj (z - prediction), which makes z = prediction - yp / cj + y' / cj.
int IdaIntegrator::solve(SUNNonlinearSolver solver, N_Vector, N_Vector correction, N_Vector weights,
                         double tolerance, int, void*) {
  auto& self = *static_cast<IdaIntegrator*>(solver->content);
  double t_s = 0.0, cj = 0.0;
  N_Vector predicted = nullptr, predicted_rate = nullptr, y = nullptr, rate = nullptr,
           out = nullptr;
  void* user = nullptr;
  if (IDAGetNonlinearSystemData(self.ida_, &t_s, &predicted, &predicted_rate, &y, &rate, &out, &cj,
                                &user) != IDA_SUCCESS) {
    return SUN_NLS_MEM_NULL;
  }
  const double gamma = 1.0 / cj;
  const double* prediction = N_VGetArrayPointer(predicted);
  const double* yp = N_VGetArrayPointer(predicted_rate);
  self.s_ = ConstMap(prediction, self.length()) - gamma * ConstMap(yp, self.length());
  return self.correct(t_s, gamma, prediction, yp + self.size_, weights, tolerance, correction);
}

IdaIntegrator::IdaIntegrator(SecondOrderSystem& system, const IntegratorSettings& settings)
    : MultistepIntegrator(system, settings), rate_(N_VClone(y_.get())) {
  N_VConst(0.0, rate_.get());
  ida_ = IDACreate(context_.get());
  if (ida_ == nullptr) throw std::runtime_error("plant: IDACreate refused");
  check(IDASetErrHandlerFn(ida_, keep_message, this), "IDASetErrHandlerFn");
  check(IDAInit(ida_, residual, 0.0, y_.get(), rate_.get()), "IDAInit");
  check(IDASetUserData(ida_, this), "IDASetUserData");
  check(IDASVtolerances(ida_, settings.relative_tolerance, tolerances_.get()), "IDASVtolerances");
  make_solver(solve);
  check(IDASetNonlinearSolver(ida_, solver_), "IDASetNonlinearSolver");
  check(IDASetMaxNumSteps(ida_, kMaxSteps), "IDASetMaxNumSteps");
  check(IDASetMaxErrTestFails(ida_, kMaxErrorTestFailures), "IDASetMaxErrTestFails");
  check(IDASetMinStep(ida_, kMinStep_s), "IDASetMinStep");
  check(IDASetMaxStep(ida_, settings.max_step_s), "IDASetMaxStep");
}

IdaIntegrator::~IdaIntegrator() { IDAFree(&ida_); }

void IdaIntegrator::restart(double t_s, double first_step_s) {
  forget_counts();
  if (!derivative(t_s, data(), N_VGetArrayPointer(rate_.get()))) {
    N_VConst(0.0, rate_.get());
    Map(N_VGetArrayPointer(rate_.get()), size_) = v();
  }
  check(IDAReInit(ida_, t_s, y_.get(), rate_.get()), "IDAReInit");
  check(IDASetInitStep(ida_, first_step_s), "IDASetInitStep");
  stages_.forget();
}

int IdaIntegrator::evolve(double t_end_s, double* reached_s) {
  const int flag = settings_.smooth_input ? IDA_SUCCESS : IDASetStopTime(ida_, t_end_s);
  return flag < 0 ? flag : IDASolve(ida_, t_end_s, reached_s, y_.get(), rate_.get(), IDA_NORMAL);
}

std::string IdaIntegrator::flag_name(int flag) const {
  return owned_text(IDAGetReturnFlagName(flag));
}

void IdaIntegrator::count(long* steps, long* rejected) const {
  IDAGetNumSteps(ida_, steps);
  IDAGetNumErrTestFails(ida_, rejected);
}

}  // namespace softarm
