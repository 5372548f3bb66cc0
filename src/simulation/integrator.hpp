// What every integrator of a simulated arm does, whatever its method.
#pragma once

#include <sundials/sundials_context.h>
#include <sundials/sundials_nonlinearsolver.h>
#include <sundials/sundials_nvector.h>

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <string>

#include "simulation/stage_solver.hpp"
#include "softarm/simulation/second_order_system.hpp"
#include "softarm/simulation/settings.hpp"

namespace softarm {

struct IntegratorSettings {
  IntegratorMethod method = IntegratorMethod::cash4;
  double relative_tolerance = 1e-6;
  double absolute_tolerance = 1e-8;           ///< of x and of energies (J)
  double absolute_tolerance_velocity = 1e-5;  ///< of v
  double max_step_s = 0.0;                    ///< 0: as long as the tolerances allow
  bool account_energy = false;                ///< integrate work and dissipation along
  /// What drives the system is smooth for all time: multistep methods may then step past the end
  /// of a call and interpolate. One-step methods do not care.
  bool smooth_input = false;
};

/// Integrates x, v = x' (and, if asked to, the work supplied and dissipated) of a second-order
/// system with error control on all of them.
class Integrator {
 public:
  virtual ~Integrator();
  Integrator(const Integrator&) = delete;
  Integrator& operator=(const Integrator&) = delete;

  /// Starts again from x, v at time t; both energies count from zero.
  void reset(double t_s, SecondOrderSystem::ConstVector x, SecondOrderSystem::ConstVector v);

  /// Integrates up to t_end_s exactly; does nothing if that is not ahead. A failure is retried once
  /// from the same state with a small first step and nothing remembered. @throw PlantError if that
  /// fails too; the state is then that of before the call.
  void advance(double t_end_s);

  /// To be called when x'' jumps here and now. A multistep method then starts again, a one-step
  /// method has nothing to forget.
  virtual void input_jumped() {}

  double time_s() const { return time_s_; }
  Eigen::Map<const Eigen::VectorXd> x() const { return {data(), size_}; }
  Eigen::Map<const Eigen::VectorXd> v() const { return {data() + size_, size_}; }
  double supplied_j() const { return energy_ ? data()[2 * size_] : 0.0; }
  double dissipated_j() const { return energy_ ? data()[2 * size_ + 1] : 0.0; }

  virtual IntegratorCounters counters() const = 0;

 protected:
  using Map = Eigen::Map<Eigen::VectorXd>;
  using ConstMap = Eigen::Map<const Eigen::VectorXd>;

  /// @param system outlives the integrator.
  /// @throw std::invalid_argument for tolerances that are not positive and finite.
  Integrator(SecondOrderSystem& system, const IntegratorSettings& settings);

  /// Goes to t_end_s and returns the solver's flag, negative where it failed; in any case reports
  /// how far it came.
  virtual int evolve(double t_end_s, double* reached_s) = 0;
  /// Forgets everything before t_s; the state is in `y_`. @param first_step_s 0: as the method
  /// likes.
  virtual void restart(double t_s, double first_step_s) = 0;
  virtual std::string flag_name(int flag) const = 0;

  static constexpr long kMaxSteps = 1'000'000;  // in one call to advance
  // A step in the torque of a stiff arm asks for steps that are shorter by orders of magnitude.
  static constexpr int kMaxErrorTestFailures = 40;
  static constexpr double kMinStep_s = 1e-12;  // what needs less is not a motion of an arm

  void check(int flag, const char* call) const;  ///< @throw std::runtime_error if refused

  // What SUNDIALS calls back with, and from it this object again.
  void* self() { return this; }
  static Integrator& of(void* self) { return *static_cast<Integrator*>(self); }
  static void keep_message(int, const char*, const char*, char* text, void* self);
  /// y' from the explicit x''.
  static int derivative(double t_s, N_Vector y, N_Vector rate, void* self);
  /// The name of a flag, which SUNDIALS leaves to the caller to free.
  static std::string owned_text(char* name);

  /// In place of SUNDIALS' Newton iteration, with self() as its content. It solves the implicit
  /// equation z = s + gamma f(t, z) of a step or stage with s in `s_`, by `correct`.
  using Solve = int (*)(SUNNonlinearSolver, N_Vector, N_Vector, N_Vector, double, int, void*);
  SUNNonlinearSolver make_solver(Solve solve);
  /// StageSolver::correct as a SUNDIALS flag. @param guess of x'', or null: the last one found.
  int correct(double t_s, double gamma_s, const double* prediction, N_Vector weights,
              double tolerance, const double* guess, N_Vector correction);

  const double* data() const { return N_VGetArrayPointer(y_.get()); }
  double* data() { return N_VGetArrayPointer(y_.get()); }
  Eigen::Index length() const { return 2 * size_ + (energy_ ? 2 : 0); }

  struct Free {
    void operator()(SUNContext context) const { SUNContext_Free(&context); }
    void operator()(N_Vector vector) const { N_VDestroy(vector); }
    void operator()(SUNNonlinearSolver solver) const { SUNNonlinSolFreeEmpty(solver); }
  };
  using Context = std::unique_ptr<_SUNContext, Free>;
  using NVector = std::unique_ptr<_generic_N_Vector, Free>;

  SecondOrderSystem& system_;
  IntegratorSettings settings_;
  Eigen::Index size_;
  bool energy_;
  double time_s_ = 0.0;
  std::int64_t retries_ = 0;
  Context context_;
  NVector y_, tolerances_;
  StageSolver stages_;
  Eigen::VectorXd s_;
  std::string message_;  // the solver's last words

 private:
  std::unique_ptr<_generic_SUNNonlinearSolver, Free> solver_;
  Eigen::VectorXd saved_;
};

/// The one that `settings.method` names.
std::unique_ptr<Integrator> make_integrator(SecondOrderSystem& system,
                                            const IntegratorSettings& settings);

}  // namespace softarm
