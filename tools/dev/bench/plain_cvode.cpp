#include "dev/bench/plain_cvode.hpp"

#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

#include <stdexcept>

#include "softarm/simulation/settings.hpp"

namespace softarm {
namespace {

using Map = Eigen::Map<Eigen::VectorXd>;
using ConstMap = Eigen::Map<const Eigen::VectorXd>;

void stay_silent(int, const char*, const char*, char*, void*) {}

int derivative(double t_s, N_Vector y, N_Vector rate, void* user) {
  auto& system = *static_cast<SecondOrderSystem*>(user);
  const Eigen::Index n = system.size();
  const double* state = N_VGetArrayPointer(y);
  double* slope = N_VGetArrayPointer(rate);
  Map(slope, n) = ConstMap(state + n, n);
  return system.acceleration(t_s, ConstMap(state, n), ConstMap(state + n, n), Map(slope + n, n))
             ? 0
             : 1;
}

void check(int flag, const char* call) {
  if (flag < 0) throw std::runtime_error(std::string(call) + ": " + std::to_string(flag));
}

}  // namespace

struct PlainCvode::Handles {
  SUNContext context = nullptr;
  N_Vector y = nullptr, tolerances = nullptr;
  SUNMatrix matrix = nullptr;
  SUNLinearSolver solver = nullptr;
  void* cvode = nullptr;
  Eigen::Index size = 0;
  double time_s = 0.0;

  ~Handles() {
    CVodeFree(&cvode);
    SUNLinSolFree(solver);
    SUNMatDestroy(matrix);
    N_VDestroy(tolerances);
    N_VDestroy(y);
    SUNContext_Free(&context);
  }
};

PlainCvode::PlainCvode(SecondOrderSystem& system, double relative, double absolute, bool smooth)
    : handles_(std::make_unique<Handles>()), smooth_(smooth) {
  Handles& h = *handles_;
  h.size = system.size();
  check(SUNContext_Create(nullptr, &h.context), "SUNContext_Create");
  h.y = N_VNew_Serial(2 * h.size, h.context);
  N_VConst(0.0, h.y);
  h.tolerances = N_VClone(h.y);
  Map(N_VGetArrayPointer(h.tolerances), h.size).setConstant(absolute);
  Map(N_VGetArrayPointer(h.tolerances) + h.size, h.size).setConstant(kVelocityTolerance * absolute);
  h.matrix = SUNDenseMatrix(2 * h.size, 2 * h.size, h.context);
  h.solver = SUNLinSol_Dense(h.y, h.matrix, h.context);
  h.cvode = CVodeCreate(CV_BDF, h.context);
  check(CVodeSetErrHandlerFn(h.cvode, stay_silent, nullptr), "CVodeSetErrHandlerFn");
  check(CVodeInit(h.cvode, derivative, 0.0, h.y), "CVodeInit");
  check(CVodeSetUserData(h.cvode, &system), "CVodeSetUserData");
  check(CVodeSVtolerances(h.cvode, relative, h.tolerances), "CVodeSVtolerances");
  check(CVodeSetLinearSolver(h.cvode, h.solver, h.matrix), "CVodeSetLinearSolver");
  check(CVodeSetMaxNumSteps(h.cvode, 1'000'000), "CVodeSetMaxNumSteps");
}

PlainCvode::~PlainCvode() = default;

void PlainCvode::reset(double t_s, const Eigen::VectorXd& x, const Eigen::VectorXd& v) {
  Map(N_VGetArrayPointer(handles_->y), x.size()) = x;
  Map(N_VGetArrayPointer(handles_->y) + x.size(), x.size()) = v;
  handles_->time_s = t_s;
  input_jumped();
}

void PlainCvode::input_jumped() {
  check(CVodeReInit(handles_->cvode, handles_->time_s, handles_->y), "CVodeReInit");
}

void PlainCvode::advance(double t_end_s) {
  if (!smooth_) check(CVodeSetStopTime(handles_->cvode, t_end_s), "CVodeSetStopTime");
  check(CVode(handles_->cvode, t_end_s, handles_->y, &handles_->time_s, CV_NORMAL), "CVode");
}

Eigen::VectorXd PlainCvode::x() const {
  return ConstMap(N_VGetArrayPointer(handles_->y), handles_->size);
}

}  // namespace softarm
