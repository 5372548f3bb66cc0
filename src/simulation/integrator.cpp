#include "simulation/integrator.hpp"

#include <nvector/nvector_serial.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "simulation/arkode_integrator.hpp"
#include "simulation/multistep_integrator.hpp"
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
      context_(new_context()) {
  expect_positive(settings.relative_tolerance, "relative_tolerance");
  expect_positive(settings.absolute_tolerance, "absolute_tolerance");
  expect_positive(settings.absolute_tolerance_velocity, "absolute_tolerance_velocity");
  if (settings.max_step_s != 0.0) expect_positive(settings.max_step_s, "max_step_s");
  saved_.setZero(length());
  y_.reset(N_VNew_Serial(length(), context_.get()));
  N_VConst(0.0, y_.get());
  tolerances_.reset(N_VNew_Serial(length(), context_.get()));
  N_VConst(settings.absolute_tolerance, tolerances_.get());
  Map(N_VGetArrayPointer(tolerances_.get()) + size_, size_)
      .setConstant(settings.absolute_tolerance_velocity);
}

Integrator::~Integrator() = default;

void Integrator::check(int flag, const char* call) const {
  if (flag < 0) {
    throw std::runtime_error(std::string("plant: ") + call + " refused: " + flag_name(flag));
  }
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
  switch (settings.method) {
    case IntegratorMethod::cvode_bdf:
    case IntegratorMethod::cvode_adams:
      return std::make_unique<CvodeIntegrator>(system, settings);
    case IntegratorMethod::ida:
      return std::make_unique<IdaIntegrator>(system, settings);
    case IntegratorMethod::sdirk2:
    case IntegratorMethod::cash4:
    case IntegratorMethod::sdirk4:
    case IntegratorMethod::erk:
      break;
  }
  return std::make_unique<ArkodeIntegrator>(system, settings);
}

}  // namespace softarm
