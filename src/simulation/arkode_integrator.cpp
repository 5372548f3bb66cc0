#include "simulation/arkode_integrator.hpp"

#include <arkode/arkode_arkstep.h>

#include <algorithm>
#include <numbers>
#include <stdexcept>

namespace softarm {
namespace {

/// ARKODE leaves a stage at a tenth of the tolerance. What is left is no noise: it points the same
/// way in every step, and no error estimate sees it. Where one step a millisecond is far more exact
/// than the tolerance asked, it would be all the error there is. So stages are solved to 1e-9, or
/// to a thousandth of the tolerance, as far as round-off lets them.
double stage_tolerance(double relative_tolerance) {
  const double wanted = std::min(1e-3, 1e-9 / relative_tolerance);
  return std::min(0.1, std::max(wanted, 1e-13 / relative_tolerance));
}

/// Alexander's two stages, L-stable and stiffly accurate, with order 1 embedded. ARKODE's own pair
/// of order 2 is neither and five times less exact at the same step.
ARKodeButcherTable alexander2() {
  double c[2] = {1.0 - std::numbers::sqrt2 / 2.0, 1.0};
  double a[4] = {c[0], 0.0, 1.0 - c[0], c[0]};
  double b[2] = {1.0 - c[0], c[0]};
  double embedded[2] = {0.5, 0.5};
  return ARKodeButcherTable_Create(2, 2, 1, c, a, b, embedded);
}

}  // namespace

// One implicit stage z = s + gamma f(t, z), where s is what ARKODE calls its prediction plus data.
int ArkodeIntegrator::solve_stage(SUNNonlinearSolver solver, N_Vector, N_Vector correction,
                                  N_Vector weights, double tolerance, int, void*) {
  auto& self = static_cast<ArkodeIntegrator&>(of(solver->content));
  double t_s = 0.0, gamma = 0.0;
  N_Vector predicted = nullptr, stage = nullptr, rate = nullptr, given = nullptr;
  void* user = nullptr;
  if (ARKStepGetNonlinearSystemData(self.arkode_, &t_s, &predicted, &stage, &rate, &gamma, &given,
                                    &user) != ARK_SUCCESS) {
    return SUN_NLS_MEM_NULL;
  }
  const double* prediction = N_VGetArrayPointer(predicted);
  self.s_ =
      ConstMap(prediction, self.length()) + ConstMap(N_VGetArrayPointer(given), self.length());
  return self.correct(t_s, gamma, prediction, weights, tolerance, nullptr, correction);
}

ArkodeIntegrator::ArkodeIntegrator(SecondOrderSystem& system, const IntegratorSettings& settings)
    : Integrator(system, settings) {
  acceleration_.setZero(size_);
  // y' explicitly; for the implicit methods only asked for at a (re)start: stages are solved
  // through the residual.
  const bool explicit_method = settings.method == IntegratorMethod::erk;
  arkode_ = ARKStepCreate(explicit_method ? derivative : nullptr,
                          explicit_method ? nullptr : derivative, 0.0, y_.get(), context_.get());
  if (arkode_ == nullptr) {
    throw std::runtime_error("plant: ARKStepCreate refused");
  }
  check(ARKStepSetErrHandlerFn(arkode_, keep_message, self()), "ARKStepSetErrHandlerFn");
  check(ARKStepSetUserData(arkode_, self()), "ARKStepSetUserData");
  check(ARKStepSVtolerances(arkode_, settings.relative_tolerance, tolerances_.get()),
        "ARKStepSVtolerances");
  set_method();
  // Every call ends on a step, so nothing is ever interpolated, and Lagrange keeps x'' out of it.
  check(ARKStepSetInterpolantType(arkode_, ARK_INTERP_LAGRANGE), "ARKStepSetInterpolantType");
  check(ARKStepSetInterpolantDegree(arkode_, 0), "ARKStepSetInterpolantDegree");
  check(ARKStepSetMaxNumSteps(arkode_, kMaxSteps), "ARKStepSetMaxNumSteps");
  check(ARKStepSetMaxErrTestFails(arkode_, kMaxErrorTestFailures), "ARKStepSetMaxErrTestFails");
  check(ARKStepSetMinStep(arkode_, kMinStep_s), "ARKStepSetMinStep");
  check(ARKStepSetMaxStep(arkode_, settings.max_step_s), "ARKStepSetMaxStep");
}

void ArkodeIntegrator::set_method() {
  if (settings_.method == IntegratorMethod::erk) {
    check(ARKStepSetTableNum(arkode_, ARKODE_DIRK_NONE, ARKODE_DORMAND_PRINCE_7_4_5),
          "ARKStepSetTableNum");
    return;
  }
  if (settings_.method == IntegratorMethod::sdirk2) {
    ARKodeButcherTable table = alexander2();
    const int flag = ARKStepSetTables(arkode_, 2, 1, table, nullptr);
    ARKodeButcherTable_Free(table);
    check(flag, "ARKStepSetTables");
  } else {
    const bool cash = settings_.method == IntegratorMethod::cash4;
    check(
        ARKStepSetTableNum(arkode_, cash ? ARKODE_CASH_5_3_4 : ARKODE_SDIRK_5_3_4, ARKODE_ERK_NONE),
        "ARKStepSetTableNum");
  }
  stages_.accept_stalled(1e-2);
  check(ARKStepSetNonlinConvCoef(arkode_, stage_tolerance(settings_.relative_tolerance)),
        "ARKStepSetNonlinConvCoef");
  check(ARKStepSetNonlinearSolver(arkode_, make_solver(solve_stage)), "ARKStepSetNonlinearSolver");
  // The stage solver knows x'' of a stage: no second evaluation to find out.
  check(ARKStepSetDeduceImplicitRhs(arkode_, 1), "ARKStepSetDeduceImplicitRhs");
}

ArkodeIntegrator::~ArkodeIntegrator() { ARKStepFree(&arkode_); }

void ArkodeIntegrator::restart(double t_s, double first_step_s) {
  check(ARKStepSetInitStep(arkode_, first_step_s), "ARKStepSetInitStep");
  check(ARKStepReset(arkode_, t_s, y_.get()), "ARKStepReset");
  if (!system_.acceleration(t_s, x(), v(), acceleration_)) {
    acceleration_.setZero();
  }
  stages_.reset(acceleration_);
}

int ArkodeIntegrator::evolve(double t_end_s, double* reached_s) {
  const int flag = ARKStepSetStopTime(arkode_, t_end_s);
  return flag < 0 ? flag : ARKStepEvolve(arkode_, t_end_s, y_.get(), reached_s, ARK_NORMAL);
}

std::string ArkodeIntegrator::flag_name(int flag) const {
  return owned_text(ARKStepGetReturnFlagName(flag));
}

IntegratorCounters ArkodeIntegrator::counters() const {
  long steps = 0, rejected = 0, explicit_calls = 0, implicit_calls = 0;
  ARKStepGetNumSteps(arkode_, &steps);
  ARKStepGetNumErrTestFails(arkode_, &rejected);
  ARKStepGetNumRhsEvals(arkode_, &explicit_calls, &implicit_calls);
  return {.steps = steps,
          .rejected_steps = rejected,
          .residual_evaluations = explicit_calls + stages_.iterations(),
          .linearizations = stages_.linearizations(),
          .retries = retries_};
}

}  // namespace softarm
