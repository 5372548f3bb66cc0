// What the parts of the Python module share.
#pragma once

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "softarm/config/experiment.hpp"

namespace softarm::python {

namespace py = pybind11;

void bind_model(py::module_& module);
void bind_control(py::module_& module);
void bind_simulation(py::module_& module);
void bind_client(py::module_& module);
void bind_law(py::module_& module);

/// A vector argument: numpy's own memory where that is one row of doubles, otherwise a copy. A
/// fifth of what pybind11's conversion to Eigen costs.
class Vector : public Eigen::Map<const Eigen::VectorXd> {
 public:
  Vector() noexcept : Map(nullptr, 0) {}
  Vector(const double* data, Eigen::Index size) noexcept : Map(data, size) {}
  /// Looks at the memory of one row of doubles; false, and unchanged, where it is anything else.
  bool look_at(py::handle source) noexcept;
};

/// A vector result, written where numpy will read it.
struct Result {
  explicit Result(Eigen::Index size);
  py::object array;
  Eigen::Map<Eigen::VectorXd> vector;
};

/// A matrix result, the same; column by column.
struct MatrixResult {
  MatrixResult(Eigen::Index rows, Eigen::Index columns);
  py::object array;
  Eigen::Map<Eigen::MatrixXd> matrix;
};

/// An argument of `size` finite numbers, itself: for use within the same expression.
/// @throws std::invalid_argument (ValueError) naming it.
ConstVectorRef expect(ConstVectorRef vector, Eigen::Index size, const char* name);

/// Poses as an array (n, 4, 4).
py::array_t<double> pose_array(const std::vector<Eigen::Isometry3d>& poses);

}  // namespace softarm::python

namespace pybind11::detail {

template <>
struct type_caster<softarm::python::Vector> {
  PYBIND11_TYPE_CASTER(softarm::python::Vector, const_name("numpy.ndarray[numpy.float64[m, 1]]"));

  bool load(handle source, bool convert);

 private:
  object converted_;  ///< what `value` looks at, where it is not the argument itself
};

}  // namespace pybind11::detail
