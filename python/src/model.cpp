// softarm.Arm: kinematics, dynamics and statics of an arm as functions of numpy arrays.
#include <fmt/format.h>

#include <memory>
#include <vector>

#include "row_method.hpp"
#include "softarm/model/actuation_matrix.hpp"
#include "softarm/model/arm.hpp"
#include "softarm/model/dynamics.hpp"
#include "softarm/model/kinematics.hpp"
#include "softarm/model/polar.hpp"
#include "softarm/model/segment.hpp"
#include "softarm/model/statics.hpp"

namespace softarm::python {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

MassModel mass_model(const std::string& name) {
  if (name == "point") return MassModel::point;
  if (name == "distributed") return MassModel::distributed;
  throw std::invalid_argument("mass: expected 'point' or 'distributed', got '" + name + "'");
}

ActuationModel actuation_model(const std::string& name) {
  if (name == "chamber") return ActuationModel::chamber;
  if (name == "couple") return ActuationModel::couple;
  throw std::invalid_argument("actuation: expected 'chamber' or 'couple', got '" + name + "'");
}

std::unique_ptr<Arm> make_arm(const VectorXd& length, const VectorXd& mass,
                              const VectorXd& stiffness, const VectorXd& damping,
                              const std::string& mass_name, const std::string& actuation_name,
                              const Eigen::Matrix3d& base_rotation,
                              const Eigen::Vector3d& base_position,
                              const Eigen::Vector3d& gravity) {
  const Eigen::Index n = length.size();
  if (n < 1 || n > kMaxSegments) {
    throw std::invalid_argument(
        fmt::format("length_m: expected 1 to {} segments, got {}", kMaxSegments, n));
  }
  expect(length, n, "length_m");
  expect(mass, n, "mass_kg");
  expect(stiffness, n, "stiffness_nm_per_rad");
  expect(damping, n, "damping_nms_per_rad");
  if (length.minCoeff() <= 0.0) throw std::invalid_argument("length_m: expected numbers > 0");
  if (mass.minCoeff() <= 0.0) throw std::invalid_argument("mass_kg: expected numbers > 0");
  if (stiffness.minCoeff() < 0.0 || damping.minCoeff() < 0.0) {
    throw std::invalid_argument("stiffness_nm_per_rad, damping_nms_per_rad: expected numbers >= 0");
  }
  if (!base_position.allFinite() || !gravity.allFinite()) {
    throw std::invalid_argument("base_position_m, gravity_mps2: expected finite numbers");
  }
  constexpr double kTolerance = 1e-6;
  if (!(base_rotation * base_rotation.transpose()).isIdentity(kTolerance) ||
      !(base_rotation.determinant() > 0.0)) {
    throw std::invalid_argument("base_rotation: expected a rotation matrix");
  }
  ArmParameters arm;
  for (Eigen::Index i = 0; i < n; ++i) {
    arm.segments.push_back({.length_m = length(i),
                            .mass_kg = mass(i),
                            .stiffness_nm_per_rad = stiffness(i),
                            .damping_nms_per_rad = damping(i)});
  }
  arm.mass = mass_model(mass_name);
  arm.actuation = actuation_model(actuation_name);
  arm.base_rotation = base_rotation;
  arm.base_position_m = base_position;
  arm.gravity_mps2 = gravity;
  return std::make_unique<Arm>(arm);
}

std::vector<Eigen::Isometry3d> segment_ends(const ArmParameters& arm, ConstVectorRef u) {
  std::vector<Eigen::Isometry3d> ends(arm.segments.size());
  forward_kinematics(arm, u, ends);
  return ends;
}

MatrixXd centre_line(const Arm& arm, const Vector& u, int points_per_segment) {
  if (points_per_segment < 1) {
    throw std::invalid_argument("points_per_segment: expected a number >= 1");
  }
  const ArmParameters& parameters = arm.parameters;
  const auto ends = segment_ends(parameters, arm.u(u));
  const Eigen::Index width = parameters.segment_dof();
  MatrixXd points(parameters.size() * points_per_segment + 1, 3);
  points.row(0) = parameters.base_position_m.transpose();
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();
  frame.linear() = parameters.base_rotation;
  frame.translation() = parameters.base_position_m;
  Eigen::Index row = 1;
  for (int i = 0; i < parameters.size(); ++i) {
    const auto segment = static_cast<std::size_t>(i);
    const double elongation_m = parameters.extensible ? u[3 * i + 2] : 0.0;
    const double length_m = parameters.segments[segment].length_m + elongation_m;
    for (int k = 1; k <= points_per_segment; ++k) {
      const Eigen::Vector3d point = segment_point(length_m, u.segment<2>(width * i),
                                                  static_cast<double>(k) / points_per_segment);
      points.row(row++) = (frame * point).transpose();
    }
    frame = ends[segment];
  }
  return points;
}

VectorXd column_of(const Arm& arm, double SegmentParameters::*member) {
  VectorXd values(arm.parameters.size());
  for (int i = 0; i < arm.parameters.size(); ++i) {
    values(i) = arm.parameters.segments[static_cast<std::size_t>(i)].*member;
  }
  return values;
}

bool forward_rows(Arm& arm, const std::array<Vector, 3>& rows, VectorRef out) {
  return forward_dynamics(arm.parameters, arm.workspace, rows[0], rows[1], rows[2], out);
}

bool inverse_rows(Arm& arm, const std::array<Vector, 3>& rows, VectorRef out) {
  const auto& [u, velocity, acceleration] = rows;
  inverse_dynamics(arm.parameters, arm.workspace, u, velocity, velocity, acceleration, {}, out);
  add_impedance(arm.parameters, u, velocity, out);
  return true;
}

py::object forward(Arm& arm, const Vector& u, const Vector& velocity, const Vector& force) {
  Result acceleration(arm.parameters.dof());
  arm.u(u), arm.u(velocity, "velocity"), arm.u(force, "generalized_force_nm");
  if (!forward_rows(arm, {u, velocity, force}, acceleration.vector)) {
    throw std::domain_error("the inertia matrix is not positive definite in double precision");
  }
  return acceleration.array;
}

py::object inverse(Arm& arm, const Vector& u, const Vector& velocity, const Vector& acceleration) {
  Result out(arm.parameters.dof());
  arm.u(u), arm.u(velocity, "velocity"), arm.u(acceleration, "acceleration");
  inverse_rows(arm, {u, velocity, acceleration}, out.vector);
  return out.array;
}

MatrixXd whole_actuation_matrix(const Arm& arm, const Vector& u) {
  arm.u(u);
  const int dof = arm.parameters.dof();
  MatrixXd A(dof, dof);
  for (int j = 0; j < dof; ++j)
    apply_actuation(arm.parameters, u, VectorXd::Unit(dof, j), A.col(j));
  return A;
}

void bind_kinematics(py::class_<Arm>& type) {
  type.def(
          "segment_poses",
          [](const Arm& arm, const Vector& u) {
            return pose_array(segment_ends(arm.parameters, arm.u(u)));
          },
          py::arg("u"), "World pose of every segment's end, (n, 4, 4), m; (1).")
      .def("centre_line", &centre_line, py::arg("u"), py::arg("points_per_segment") = 16,
           "Points on the arm from base to tip, (n points_per_segment + 1, 3), m, world.")
      .def(
          "mass_centres",
          [](const Arm& arm, const Vector& u) {
            Eigen::Matrix3Xd centres(3, arm.parameters.size());
            mass_centres(arm.parameters, arm.u(u), centres);
            return MatrixXd(centres.transpose());
          },
          py::arg("u"), "Centre of mass of every segment, (n, 3), m, world; (5).")
      .def(
          "tip",
          [](const Arm& arm, const Vector& u) {
            Result tip(3);
            tip.vector = tip_position(arm.parameters, arm.u(u));
            return tip.array;
          },
          py::arg("u"), "Position of the tip, (3,), m, world.")
      .def(
          "tip_jacobian",
          [](const Arm& arm, const Vector& u) {
            Eigen::Matrix3Xd J(3, arm.parameters.dof());
            tip_jacobian(arm.parameters, arm.u(u), J);
            return MatrixXd(J);
          },
          py::arg("u"), "d tip / d u, (3, 2n), m/rad, world.")
      .def(
          "tip_jacobian_rate",
          [](const Arm& arm, const Vector& u, const Vector& velocity) {
            Eigen::Matrix3Xd J(3, arm.parameters.dof());
            tip_jacobian_rate(arm.parameters, arm.u(u), arm.u(velocity, "velocity"), J);
            return MatrixXd(J);
          },
          py::arg("u"), py::arg("velocity"),
          "Time derivative of tip_jacobian, (3, 2n), m/(rad s).");
}

void bind_dynamics(py::class_<Arm>& type) {
  type.def(
          "inertia",
          [](Arm& arm, const Vector& u) {
            MatrixResult B(arm.parameters.dof(), arm.parameters.dof());
            inertia_matrix(arm.parameters, arm.workspace, arm.u(u), B.matrix);
            return B.array;
          },
          py::arg("u"), "B(u), (2n, 2n), kg m^2.")
      .def(
          "dynamics_matrices",
          [](Arm& arm, const Vector& u, const Vector& velocity) {
            const int dof = arm.parameters.dof();
            MatrixResult B(dof, dof), C(dof, dof);
            Result G(dof);
            dynamics_matrices(arm.parameters, arm.workspace, arm.u(u), arm.u(velocity, "velocity"),
                              B.matrix, C.matrix, G.vector);
            return py::make_tuple(B.array, C.array, G.array);
          },
          py::arg("u"), py::arg("velocity"),
          "B(u) in kg m^2, C(u, u') (Christoffel, B' - 2C is skew) in kg m^2/s, G(u) in N m.")
      .def(
          "gravity",
          [](Arm& arm, const Vector& u) {
            Result G(arm.parameters.dof());
            gravity_moments(arm.parameters, arm.workspace, arm.u(u), G.vector);
            return G.array;
          },
          py::arg("u"), "G(u), (2n,), N m.")
      .def("inverse_dynamics", &inverse, py::arg("u"), py::arg("velocity"), py::arg("acceleration"),
           "Generalized force B u'' + C u' + D u' + G + K u of (16), (2n,), N m; O(n).")
      .def("forward_dynamics", &forward, py::arg("u"), py::arg("velocity"),
           py::arg("generalized_force_nm"),
           "u'' of (16), (2n,), rad/s^2, for a generalized force A tau_A + J' f in N m.")
      .def(
          "kinetic_energy",
          [](Arm& arm, const Vector& u, const Vector& velocity) {
            return kinetic_energy(arm.parameters, arm.workspace, arm.u(u),
                                  arm.u(velocity, "velocity"));
          },
          py::arg("u"), py::arg("velocity"), "1/2 u'^T B u', J.")
      .def(
          "gravity_potential",
          [](const Arm& arm, const Vector& u) {
            return gravity_potential(arm.parameters, arm.u(u));
          },
          py::arg("u"), "Potential energy of gravity, J; zero at the world's origin.")
      .def(
          "static_moments",
          [](Arm& arm, const Vector& u) {
            Result out(arm.parameters.dof());
            static_moments(arm.parameters, arm.workspace, arm.u(u), out.vector);
            return out.array;
          },
          py::arg("u"), "K u + G(u), (2n,), N m: the generalized force that holds u at rest.")
      .def(
          "rest_shape",
          [](const Arm& arm, const Vector& tau) {
            return rest_shape(arm.parameters, arm.u(tau, "tau_actuation_nm"));
          },
          py::arg("tau_actuation_nm"),
          "u at rest near straight under constant moments, (2n,), rad; None without convergence.")
      .def("actuation_matrix", &whole_actuation_matrix, py::arg("u"),
           "A(u), (2n, 2n): generalized force = A tau_A; (15).")
      .def(
          "tip_force",
          [](const Arm& arm, const Vector& u, const Eigen::Vector3d& force) {
            VectorXd out = VectorXd::Zero(arm.parameters.dof());
            add_tip_force(arm.parameters, arm.u(u), force, out);
            return out;
          },
          py::arg("u"), py::arg("force_n"), "J' f of a force on the tip (N, world), (2n,), N m.");
  RowMethod<3, forward_rows>::shorten(type, "forward_dynamics");
  RowMethod<3, inverse_rows>::shorten(type, "inverse_dynamics");
}

}  // namespace

void bind_model(py::module_& module) {
  py::class_<Arm> type(
      module, "Arm",
      "The model of an arm of n segments with constant curvature.\n\n"
      "The state is u = theta [cos phi, sin phi] of every segment, (2n,), rad. Where segments "
      "stretch it\n"
      "is (u_x, u_y, e) of every segment, (3n,), with e in m, and forces along e are in N.\n"
      "A wrong size, NaN or inf raises ValueError. Not for two threads at a time.");
  const Eigen::Matrix3d hanging = Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
  type.def(py::init(&make_arm), py::arg("length_m"), py::arg("mass_kg"),
           py::arg("stiffness_nm_per_rad"), py::arg("damping_nms_per_rad"),
           py::arg("mass") = "distributed", py::arg("actuation") = "chamber",
           py::arg("base_rotation") = hanging,
           py::arg("base_position_m") = Eigen::Vector3d(Eigen::Vector3d::Zero()),
           py::arg("gravity_mps2") = Eigen::Vector3d(0.0, 0.0, -9.81),
           "One number a segment each. The default base hangs the arm from a ceiling.")
      .def(py::init(
               [](const Experiment& experiment) { return std::make_unique<Arm>(experiment.arm); }),
           py::arg("experiment"), "The arm as the experiment's controller models it.")
      .def_property_readonly("segments", [](const Arm& arm) { return arm.parameters.size(); })
      .def_property_readonly("dof", [](const Arm& arm) { return arm.parameters.dof(); })
      .def_property_readonly(
          "length_m", [](const Arm& arm) { return column_of(arm, &SegmentParameters::length_m); })
      .def_property_readonly(
          "mass_kg", [](const Arm& arm) { return column_of(arm, &SegmentParameters::mass_kg); })
      .def_property_readonly(
          "stiffness_nm_per_rad",
          [](const Arm& arm) { return column_of(arm, &SegmentParameters::stiffness_nm_per_rad); })
      .def_property_readonly("damping_nms_per_rad", [](const Arm& arm) {
        return column_of(arm, &SegmentParameters::damping_nms_per_rad);
      });
  bind_kinematics(type);
  bind_dynamics(type);
  bind_derivatives(type);

  module.def(
      "polar_to_u",
      [](const VectorXd& q) {
        expect(q, q.size() / 2 * 2, "q");
        VectorXd u(q.size());
        polar_to_u(q, u);
        return u;
      },
      py::arg("q"), "u of [phi_1, theta_1, ...], rad.");
  module.def(
      "u_to_polar",
      [](const Vector& u) {
        expect(u, u.size() / 2 * 2, "u");
        VectorXd q(u.size());
        u_to_polar(u, q);
        return q;
      },
      py::arg("u"), "[phi_1, theta_1, ...] of u, rad; phi is 0 where theta is.");
}

}  // namespace softarm::python
