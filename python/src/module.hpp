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

/// An argument of `size` finite numbers, itself: for use within the same expression.
/// @throws std::invalid_argument (ValueError) naming it.
ConstVectorRef expect(ConstVectorRef vector, Eigen::Index size, const char* name);

/// Poses as an array (n, 4, 4).
py::array_t<double> pose_array(const std::vector<Eigen::Isometry3d>& poses);

}  // namespace softarm::python
