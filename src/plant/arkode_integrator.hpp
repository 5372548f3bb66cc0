// ARKODE's diagonally implicit Runge-Kutta methods on a second-order system in residual form.
#pragma once

#include <sundials/sundials_nonlinearsolver.h>
#include <sundials/sundials_nvector.h>

#include <Eigen/Core>
#include <memory>
#include <string>

#include "plant/second_order_system.hpp"
#include "plant/stage_solver.hpp"
#include "softarm/plant/settings.hpp"

namespace softarm {

struct IntegratorSettings {
  IntegratorMethod method = IntegratorMethod::cash4;
  double relative_tolerance = 1e-6;
  double absolute_tolerance = 1e-8;           ///< of x and of energies (J)
  double absolute_tolerance_velocity = 1e-5;  ///< of v
  bool account_energy = false;                ///< integrate work and dissipation along
};

/// Integrates x, v = x' (and, if asked to, the work supplied and dissipated) with error control on
/// all of them.
///
/// One-step methods forget nothing at a change of the input, so a command every millisecond costs
/// no restart. Of the diagonally implicit ones only those without an explicit first stage are used:
/// they never evaluate x'' = B^-1 (...) at the old input. The stages are solved by StageSolver
/// through the residual.
class ArkodeIntegrator {
 public:
  /// @param system outlives the integrator.
  /// @throw std::invalid_argument for tolerances that are not positive and finite.
  ArkodeIntegrator(SecondOrderSystem& system, const IntegratorSettings& settings);
  ~ArkodeIntegrator();
  ArkodeIntegrator(const ArkodeIntegrator&) = delete;
  ArkodeIntegrator& operator=(const ArkodeIntegrator&) = delete;

  /// Starts anew from x, v at time t; both energies count from zero.
  void reset(double t_s, SecondOrderSystem::ConstVector x, SecondOrderSystem::ConstVector v);

  /// Integrates up to t_end_s exactly; does nothing if that is not ahead. A failure is retried once
  /// from the same state with a small first step and a fresh linearization. @throw PlantError if
  /// that fails too; the state is then that of before the call.
  void advance(double t_end_s);

  double time_s() const { return time_s_; }
  Eigen::Map<const Eigen::VectorXd> x() const { return {data(), size_}; }
  Eigen::Map<const Eigen::VectorXd> v() const { return {data() + size_, size_}; }
  double supplied_j() const { return energy_ ? data()[2 * size_] : 0.0; }
  double dissipated_j() const { return energy_ ? data()[2 * size_ + 1] : 0.0; }

  IntegratorCounters counters() const;

 private:
  struct Handles;  // owns what SUNDIALS allocates

  const double* data() const;
  double* data();
  int evolve(double t_end_s, double* reached_s);
  void restart(double t_s, double first_step_s);
  static void check(int flag, const char* call);

  SecondOrderSystem& system_;
  IntegratorSettings settings_;
  Eigen::Index size_;
  bool energy_;
  double time_s_ = 0.0;
  std::int64_t retries_ = 0;
  StageSolver stages_;
  std::unique_ptr<Handles> handles_;
  Eigen::VectorXd saved_;
  std::string message_;  // the solver's last words
};

}  // namespace softarm
