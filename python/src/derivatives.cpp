// Exact derivatives of softarm.Arm's dynamics and statics.
#include "softarm/model/derivatives.hpp"

#include <stdexcept>

#include "arm.hpp"

namespace softarm::python {
namespace {

MatrixResult square(const Arm& arm) { return {arm.parameters.dof(), arm.parameters.dof()}; }

py::tuple forward_dynamics_derivatives(Arm& arm, const Vector& u, const Vector& velocity,
                                       const Vector& force) {
  Result acceleration(arm.parameters.dof());
  MatrixResult by_u = square(arm), by_velocity = square(arm), by_force = square(arm);
  if (!arm.derivatives().forward_dynamics(arm.u(u), arm.u(velocity, "velocity"),
                                          arm.u(force, "generalized_force_nm"), acceleration.vector,
                                          by_u.matrix, by_velocity.matrix, by_force.matrix)) {
    throw std::domain_error("the inertia matrix is not positive definite in double precision");
  }
  return py::make_tuple(acceleration.array, by_u.array, by_velocity.array, by_force.array);
}

}  // namespace

void bind_derivatives(py::class_<Arm>& type) {
  type.def(
          "forward_dynamics_derivatives", &forward_dynamics_derivatives, py::arg("u"),
          py::arg("velocity"), py::arg("generalized_force_nm"),
          "(u'', d u''/du, d u''/du', d u''/d force), force held: (2n,) and three of (2n, 2n).\n\n"
          "Exact. By pressures: by_force @ allocator.input_matrix; a force that depends on u adds\n"
          "by_force @ (its slope) to the second.")
      .def(
          "inverse_dynamics_by_u",
          [](Arm& arm, const Vector& u, const Vector& velocity, const Vector& acceleration) {
            MatrixResult by_u = square(arm);
            arm.derivatives().inverse_dynamics_by_u(arm.u(u), arm.u(velocity, "velocity"),
                                                    arm.u(acceleration, "acceleration"),
                                                    by_u.matrix);
            return by_u.array;
          },
          py::arg("u"), py::arg("velocity"), py::arg("acceleration"),
          "d inverse_dynamics / du with u' and u'' held, (2n, 2n), N m/rad; exact. By u': 2 C + "
          "D,\n"
          "by u'': B.")
      .def(
          "static_stiffness",
          [](Arm& arm, const Vector& u) {
            MatrixResult by_u = square(arm);
            arm.derivatives().static_stiffness(arm.u(u), by_u.matrix);
            return by_u.array;
          },
          py::arg("u"),
          "K + dG/du, (2n, 2n), N m/rad: the slope of static_moments, exact. The shape at rest "
          "moves\n"
          "by solve(static_stiffness(u), allocator.input_matrix) for 1 bar in each chamber.")
      .def(
          "actuation_slope",
          [](const Arm& arm, const Vector& u, const Vector& tau) {
            MatrixResult by_u = square(arm);
            actuation_slope(arm.parameters, arm.u(u), arm.u(tau, "tau_actuation_nm"), by_u.matrix);
            return by_u.array;
          },
          py::arg("u"), py::arg("tau_actuation_nm"),
          "d (A(u) tau_A) / du with tau_A held, (2n, 2n), N m/rad; zero for 'chamber'.");
}

}  // namespace softarm::python
