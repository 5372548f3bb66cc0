#include "plant/arkode_integrator.hpp"

#include <arkode/arkode_arkstep.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_context.h>

#include <cmath>
#include <cstdlib>
#include <stdexcept>

#include "softarm/plant/plant_error.hpp"

namespace softarm {
namespace {

using ConstMap = Eigen::Map<const Eigen::VectorXd>;
using Map = Eigen::Map<Eigen::VectorXd>;

constexpr long kMaxSteps = 1'000'000;  // in one call to advance
// A step in the torque of a stiff arm asks for steps that are shorter by orders of magnitude.
constexpr int kMaxErrorTestFailures = 40;
constexpr double kMinStep_s = 1e-12;  // what needs less is not a motion of an arm

/// What SUNDIALS hands back to us in its callbacks.
struct Callbacks {
  SecondOrderSystem* system;
  StageSolver* stages;
  void* arkode = nullptr;
  Eigen::Index size = 0;
  bool energy = false;
  std::string* message = nullptr;
};

// y' explicitly. Only asked for at a (re)start: stages are solved through the residual.
int derivative(double t_s, N_Vector y, N_Vector y_dot, void* user) {
  auto& self = *static_cast<Callbacks*>(user);
  const double* state = N_VGetArrayPointer(y);
  double* rate = N_VGetArrayPointer(y_dot);
  const ConstMap x(state, self.size);
  const ConstMap v(state + self.size, self.size);
  Map(rate, self.size) = v;
  if (!self.system->acceleration(t_s, x, v, Map(rate + self.size, self.size))) {
    return 1;  // recoverable: a smaller step may stay where B is positive definite
  }
  if (self.energy) {
    const auto powers = self.system->powers(t_s, x, v);
    rate[2 * self.size] = powers.supplied_w;
    rate[2 * self.size + 1] = powers.dissipated_w;
  }
  return 0;
}

// One implicit stage z = s + gamma f(t, z), where s is what ARKODE calls its prediction plus data.
int solve_stage(SUNNonlinearSolver solver, N_Vector, N_Vector correction, N_Vector weights,
                double tolerance, int, void*) {
  auto& self = *static_cast<Callbacks*>(solver->content);
  double t_s = 0.0;
  double gamma = 0.0;
  N_Vector predicted = nullptr;
  N_Vector stage = nullptr;
  N_Vector rate = nullptr;
  N_Vector given = nullptr;
  void* user = nullptr;
  if (ARKStepGetNonlinearSystemData(self.arkode, &t_s, &predicted, &stage, &rate, &gamma, &given,
                                    &user) != ARK_SUCCESS) {
    return SUN_NLS_MEM_NULL;
  }
  const Eigen::Index n = self.size;
  const double* prediction = N_VGetArrayPointer(predicted);
  const double* weight = N_VGetArrayPointer(weights);
  double* out = N_VGetArrayPointer(correction);
  Map s(N_VGetArrayPointer(stage), N_VGetLength_Serial(stage));  // scratch until ARKODE writes z
  s = ConstMap(prediction, s.size()) + ConstMap(N_VGetArrayPointer(given), s.size());

  const StageSolver::Stage problem{.t_s = t_s,
                                   .gamma_s = gamma,
                                   .s_x = ConstMap(s.data(), n),
                                   .s_v = ConstMap(s.data() + n, n),
                                   .weight_x = ConstMap(weight, n),
                                   .weight_v = ConstMap(weight + n, n),
                                   .tolerance = tolerance,
                                   .components = static_cast<double>(s.size())};
  if (!self.stages->solve(problem)) {
    return SUN_NLS_CONV_RECVR;
  }
  Map(out, n) = self.stages->x() - ConstMap(prediction, n);
  Map(out + n, n) = self.stages->v() - ConstMap(prediction + n, n);
  if (self.energy) {
    const auto powers = self.system->powers(t_s, self.stages->x(), self.stages->v());
    out[2 * n] = s[2 * n] + gamma * powers.supplied_w - prediction[2 * n];
    out[2 * n + 1] = s[2 * n + 1] + gamma * powers.dissipated_w - prediction[2 * n + 1];
  }
  return SUN_NLS_SUCCESS;
}

SUNNonlinearSolver_Type solver_type(SUNNonlinearSolver) { return SUNNONLINEARSOLVER_ROOTFIND; }
int ignore_system(SUNNonlinearSolver, SUNNonlinSolSysFn) { return SUN_NLS_SUCCESS; }

void keep_message(int, const char*, const char*, char* text, void* user) {
  *static_cast<Callbacks*>(user)->message = text;
}

ARKODE_DIRKTableID table(IntegratorMethod method) {
  switch (method) {
    case IntegratorMethod::sdirk2:
      return ARKODE_SDIRK_2_1_2;
    case IntegratorMethod::cash4:
      return ARKODE_CASH_5_3_4;
    case IntegratorMethod::sdirk4:
      break;
  }
  return ARKODE_SDIRK_5_3_4;
}

std::string flag_name(int flag) {
  char* name = ARKStepGetReturnFlagName(flag);
  std::string text = name != nullptr ? name : "ARK_UNKNOWN";
  std::free(name);
  return text;
}

void expect_positive(double value, const char* key) {
  if (!(value > 0.0) || !std::isfinite(value)) {
    throw std::invalid_argument(std::string("integrator.") + key +
                                ": expected a finite number > 0, got " + std::to_string(value));
  }
}

}  // namespace

struct ArkodeIntegrator::Handles {
  SUNContext context = nullptr;
  N_Vector y = nullptr;
  N_Vector tolerances = nullptr;
  SUNNonlinearSolver solver = nullptr;
  void* arkode = nullptr;
  Callbacks callbacks;

  ~Handles() {
    ARKStepFree(&arkode);
    if (solver != nullptr) SUNNonlinSolFreeEmpty(solver);
    if (tolerances != nullptr) N_VDestroy(tolerances);
    if (y != nullptr) N_VDestroy(y);
    SUNContext_Free(&context);
  }
};

void ArkodeIntegrator::check(int flag, const char* call) {
  if (flag < 0) {
    throw std::runtime_error(std::string("plant: ") + call + " refused: " + flag_name(flag));
  }
}

ArkodeIntegrator::ArkodeIntegrator(SecondOrderSystem& system, const IntegratorSettings& settings)
    : system_(system),
      settings_(settings),
      size_(system.size()),
      energy_(settings.account_energy),
      stages_(system),
      handles_(std::make_unique<Handles>()) {
  expect_positive(settings.relative_tolerance, "relative_tolerance");
  expect_positive(settings.absolute_tolerance, "absolute_tolerance");
  expect_positive(settings.absolute_tolerance_velocity, "absolute_tolerance_velocity");
  const Eigen::Index length = 2 * size_ + (energy_ ? 2 : 0);
  saved_.setZero(length);
  Handles& h = *handles_;
  check(SUNContext_Create(nullptr, &h.context), "SUNContext_Create");
  h.y = N_VNew_Serial(length, h.context);
  N_VConst(0.0, h.y);
  h.tolerances = N_VNew_Serial(length, h.context);
  N_VConst(settings.absolute_tolerance, h.tolerances);
  Map(N_VGetArrayPointer(h.tolerances) + size_, size_)
      .setConstant(settings.absolute_tolerance_velocity);

  h.arkode = ARKStepCreate(nullptr, derivative, 0.0, h.y, h.context);
  if (h.arkode == nullptr) {
    throw std::runtime_error("plant: ARKStepCreate refused");
  }
  h.callbacks = {&system_, &stages_, h.arkode, size_, energy_, &message_};
  h.solver = SUNNonlinSolNewEmpty(h.context);
  h.solver->content = &h.callbacks;
  h.solver->ops->gettype = solver_type;
  h.solver->ops->solve = solve_stage;
  h.solver->ops->setsysfn = ignore_system;
  check(ARKStepSetErrHandlerFn(h.arkode, keep_message, &h.callbacks), "ARKStepSetErrHandlerFn");
  check(ARKStepSetUserData(h.arkode, &h.callbacks), "ARKStepSetUserData");
  check(ARKStepSetTableNum(h.arkode, table(settings.method), ARKODE_ERK_NONE),
        "ARKStepSetTableNum");
  check(ARKStepSVtolerances(h.arkode, settings.relative_tolerance, h.tolerances),
        "ARKStepSVtolerances");
  check(ARKStepSetNonlinearSolver(h.arkode, h.solver), "ARKStepSetNonlinearSolver");
  // The stage solver knows x'' of a stage: no second evaluation to find out.
  check(ARKStepSetDeduceImplicitRhs(h.arkode, 1), "ARKStepSetDeduceImplicitRhs");
  // Every call ends on a step, so nothing is ever interpolated, and Lagrange keeps x'' out of it.
  check(ARKStepSetInterpolantType(h.arkode, ARK_INTERP_LAGRANGE), "ARKStepSetInterpolantType");
  check(ARKStepSetInterpolantDegree(h.arkode, 0), "ARKStepSetInterpolantDegree");
  check(ARKStepSetMaxNumSteps(h.arkode, kMaxSteps), "ARKStepSetMaxNumSteps");
  check(ARKStepSetMaxErrTestFails(h.arkode, kMaxErrorTestFailures), "ARKStepSetMaxErrTestFails");
  check(ARKStepSetMinStep(h.arkode, kMinStep_s), "ARKStepSetMinStep");
}

ArkodeIntegrator::~ArkodeIntegrator() = default;

const double* ArkodeIntegrator::data() const { return N_VGetArrayPointer(handles_->y); }
double* ArkodeIntegrator::data() { return N_VGetArrayPointer(handles_->y); }

void ArkodeIntegrator::restart(double t_s, double first_step_s) {
  check(ARKStepSetInitStep(handles_->arkode, first_step_s), "ARKStepSetInitStep");
  check(ARKStepReset(handles_->arkode, t_s, handles_->y), "ARKStepReset");
  Eigen::VectorXd acceleration = Eigen::VectorXd::Zero(size_);
  if (!system_.acceleration(t_s, x(), v(), acceleration)) {
    acceleration.setZero();
  }
  stages_.reset(acceleration);
}

void ArkodeIntegrator::reset(double t_s, SecondOrderSystem::ConstVector x0,
                             SecondOrderSystem::ConstVector v0) {
  Map(data(), saved_.size()).setZero();
  Map(data(), size_) = x0;
  Map(data() + size_, size_) = v0;
  time_s_ = t_s;
  restart(t_s, 1e-5);
}

int ArkodeIntegrator::evolve(double t_end_s, double* reached_s) {
  *reached_s = time_s_;
  int flag = ARKStepSetStopTime(handles_->arkode, t_end_s);
  if (flag >= 0) {
    flag = ARKStepEvolve(handles_->arkode, t_end_s, handles_->y, reached_s, ARK_NORMAL);
  }
  if (flag >= 0 && !Map(data(), saved_.size()).allFinite()) {
    return ARK_RHSFUNC_FAIL;
  }
  return flag;
}

void ArkodeIntegrator::advance(double t_end_s) {
  if (!(t_end_s > time_s_)) {
    return;
  }
  saved_ = ConstMap(data(), saved_.size());
  double reached_s = time_s_;
  int flag = evolve(t_end_s, &reached_s);
  if (flag < 0) {
    Map(data(), saved_.size()) = saved_;
    restart(time_s_, 1e-3 * (t_end_s - time_s_));
    flag = evolve(t_end_s, &reached_s);
    if (flag < 0) {
      PlantError error(reached_s, flag_name(flag), message_, x(), v());
      Map(data(), saved_.size()) = saved_;
      restart(time_s_, 1e-3 * (t_end_s - time_s_));
      throw error;
    }
    ++retries_;
  }
  time_s_ = t_end_s;
}

IntegratorCounters ArkodeIntegrator::counters() const {
  IntegratorCounters counters;
  long steps = 0;
  long rejected = 0;
  ARKStepGetNumSteps(handles_->arkode, &steps);
  ARKStepGetNumErrTestFails(handles_->arkode, &rejected);
  counters.steps = steps;
  counters.rejected_steps = rejected;
  counters.residual_evaluations = stages_.iterations();
  counters.linearizations = stages_.linearizations();
  counters.retries = retries_;
  return counters;
}

}  // namespace softarm
