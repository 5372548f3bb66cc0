#include "simulation/integrator.hpp"

#include <nvector/nvector_serial.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <stdexcept>

#include "simulation/arkode_integrator.hpp"
#include "simulation/cvode_integrator.hpp"
#include "softarm/simulation/plant_error.hpp"

namespace softarm {
namespace {

constexpr int kNotFinite = std::numeric_limits<int>::min();  // no flag of SUNDIALS

void expect_positive(double value, const char* key) {
  if (!(value > 0.0) || !std::isfinite(value)) {
    throw std::invalid_argument(std::string("integrator.") + key +
                                ": expected a finite number > 0, got " + std::to_string(value));
  }
}

SUNContext new_context() {
  SUNContext context = nullptr;
  if (SUNContext_Create(nullptr, &context) < 0) {
    throw std::runtime_error("plant: SUNContext_Create refused");
  }
  return context;
}

}  // namespace

Integrator::Integrator(SecondOrderSystem& system, const IntegratorSettings& settings)
    : system_(system),
      settings_(settings),
      size_(system.size()),
      energy_(settings.account_energy),
      context_(new_context()),
      stages_(system) {
  expect_positive(settings.relative_tolerance, "relative_tolerance");
  expect_positive(settings.absolute_tolerance, "absolute_tolerance");
  expect_positive(settings.absolute_tolerance_velocity, "absolute_tolerance_velocity");
  if (settings.max_step_s != 0.0) expect_positive(settings.max_step_s, "max_step_s");
  saved_.setZero(length());
  s_.setZero(length());
  y_.reset(N_VNew_Serial(length(), context_.get()));
  N_VConst(0.0, y_.get());
  tolerances_.reset(N_VNew_Serial(length(), context_.get()));
  N_VConst(settings.absolute_tolerance, tolerances_.get());
  for (Eigen::Index i = 0; i < size_; ++i) {
    double* const tolerance = N_VGetArrayPointer(tolerances_.get()) + i;
    tolerance[0] = settings.absolute_tolerance * system.unit(i);
    tolerance[size_] = settings.absolute_tolerance_velocity * system.unit(i);
  }
}

Integrator::~Integrator() = default;

void Integrator::check(int flag, const char* call) const {
  if (flag < 0) {
    throw std::runtime_error(std::string("plant: ") + call + " refused: " + flag_name(flag));
  }
}

void Integrator::keep_message(int, const char*, const char*, char* text, void* self) {
  of(self).message_ = text;
}

std::string Integrator::owned_text(char* name) {
  std::string text = name != nullptr ? name : "UNKNOWN";
  std::free(name);
  return text;
}

int Integrator::derivative(double t_s, N_Vector y, N_Vector rate, void* self) {
  Integrator& it = of(self);
  const Eigen::Index n = it.size_;
  const ConstMap x(N_VGetArrayPointer(y), n), v(N_VGetArrayPointer(y) + n, n);
  double* out = N_VGetArrayPointer(rate);
  Map(out, n) = v;
  if (!it.system_.acceleration(t_s, x, v, Map(out + n, n))) {
    return 1;  // recoverable: a smaller step may stay where B is positive definite
  }
  if (it.energy_) {
    const auto powers = it.system_.powers(t_s, x, v);
    out[2 * n] = powers.supplied_w;
    out[2 * n + 1] = powers.dissipated_w;
  }
  return 0;
}

SUNNonlinearSolver Integrator::make_solver(Solve solve) {
  solver_.reset(SUNNonlinSolNewEmpty(context_.get()));
  solver_->content = self();
  solver_->ops->gettype = [](SUNNonlinearSolver) { return SUNNONLINEARSOLVER_ROOTFIND; };
  solver_->ops->solve = solve;
  solver_->ops->setsysfn = [](SUNNonlinearSolver, SUNNonlinSolSysFn) -> int {
    return SUN_NLS_SUCCESS;
  };
  return solver_.get();
}

int Integrator::correct(double t_s, double gamma_s, const double* prediction, N_Vector weights,
                        double tolerance, const double* guess, N_Vector correction) {
  return stages_.correct(t_s, gamma_s, s_, prediction, N_VGetArrayPointer(weights), tolerance,
                         guess, energy_, N_VGetArrayPointer(correction))
             ? SUN_NLS_SUCCESS
             : SUN_NLS_CONV_RECVR;
}

void Integrator::reset(double t_s, SecondOrderSystem::ConstVector x,
                       SecondOrderSystem::ConstVector v) {
  Map(data(), length()).setZero();
  Map(data(), size_) = x;
  Map(data() + size_, size_) = v;
  time_s_ = t_s;
  restart(t_s, 1e-5);
}

void Integrator::advance(double t_end_s) {
  if (!(t_end_s > time_s_)) {
    return;
  }
  const auto attempt = [&](double* reached_s) {
    *reached_s = time_s_;
    const int flag = evolve(t_end_s, reached_s);
    return flag >= 0 && !ConstMap(data(), length()).allFinite() ? kNotFinite : flag;
  };
  saved_ = ConstMap(data(), length());
  double reached_s = time_s_;
  if (attempt(&reached_s) < 0) {
    Map(data(), length()) = saved_;
    const double first_step_s = 1e-3 * (t_end_s - time_s_);
    restart(time_s_, first_step_s);
    const int flag = attempt(&reached_s);
    if (flag < 0) {
      const std::string cause = flag == kNotFinite ? "NOT_FINITE" : flag_name(flag);
      PlantError error(reached_s, cause, message_, x(), v());
      Map(data(), length()) = saved_;
      restart(time_s_, first_step_s);
      throw error;
    }
    ++retries_;
  }
  time_s_ = t_end_s;
}

std::unique_ptr<Integrator> make_integrator(SecondOrderSystem& system,
                                            const IntegratorSettings& settings) {
  if (settings.method == IntegratorMethod::cvode_bdf) {
    return std::make_unique<CvodeIntegrator>(system, settings);
  }
  return std::make_unique<ArkodeIntegrator>(system, settings);
}

}  // namespace softarm
