// softarm._core: experiments, and the one exception type that reading them has.
#include "module.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "softarm/base/version.hpp"
#include "softarm/config/load.hpp"

namespace softarm::python {

bool Vector::look_at(py::handle source) noexcept {
  static PyObject* const kDouble = py::dtype::of<double>().release().ptr();
  const auto& numpy = py::detail::npy_api::get();
  constexpr int kReadable =
      py::detail::npy_api::NPY_ARRAY_ALIGNED_ | py::detail::npy_api::NPY_ARRAY_C_CONTIGUOUS_;
  if (!numpy.PyArray_Check_(source.ptr())) return false;
  const py::detail::PyArray_Proxy& array = *py::detail::array_proxy(source.ptr());
  if (array.nd != 1 || array.descr != kDouble || (array.flags & kReadable) != kReadable) {
    return false;
  }
  const void* const data = array.data;
  new (this) Vector(static_cast<const double*>(data), array.dimensions[0]);
  return true;
}

namespace {

/// A new array of doubles and its memory; of two dimensions column by column.
double* make_array(std::initializer_list<py::ssize_t> shape, py::object& out) {
  static PyObject* const kDouble = py::dtype::of<double>().release().ptr();
  constexpr int kColumns = py::detail::npy_api::NPY_ARRAY_F_CONTIGUOUS_;
  const auto& numpy = py::detail::npy_api::get();
  Py_INCREF(kDouble);  // the array takes one
  out = py::reinterpret_steal<py::object>(numpy.PyArray_NewFromDescr_(
      numpy.PyArray_Type_, kDouble, static_cast<int>(shape.size()), shape.begin(), nullptr, nullptr,
      shape.size() > 1 ? kColumns : 0, nullptr));
  if (!out) throw py::error_already_set();
  void* const data = py::detail::array_proxy(out.ptr())->data;
  return static_cast<double*>(data);
}

}  // namespace

Result::Result(Eigen::Index size) : vector(make_array({size}, array), size) {}

MatrixResult::MatrixResult(Eigen::Index rows, Eigen::Index columns)
    : matrix(make_array({rows, columns}, array), rows, columns) {}

ConstVectorRef expect(ConstVectorRef vector, Eigen::Index size, const char* name) {
  if (vector.size() != size) {
    throw std::invalid_argument(
        fmt::format("{}: expected {} numbers, got {}", name, size, vector.size()));
  }
  if (!vector.allFinite()) {
    throw std::invalid_argument(fmt::format("{}: expected finite numbers", name));
  }
  return vector;
}

py::array_t<double> pose_array(const std::vector<Eigen::Isometry3d>& poses) {
  py::array_t<double> array(
      {static_cast<py::ssize_t>(poses.size()), py::ssize_t{4}, py::ssize_t{4}});
  auto out = array.mutable_unchecked<3>();
  for (py::ssize_t i = 0; i < out.shape(0); ++i) {
    for (py::ssize_t row = 0; row < 4; ++row) {
      for (py::ssize_t column = 0; column < 4; ++column) {
        out(i, row, column) = poses[static_cast<std::size_t>(i)].matrix()(row, column);
      }
    }
  }
  return array;
}

namespace {

/// ConfigError of C++ becomes the one of Python, with the same parts.
void translate_config_error(std::exception_ptr pointer) {
  try {
    if (pointer) std::rethrow_exception(pointer);
  } catch (const ConfigError& error) {
    const py::object type = py::module_::import("softarm.errors").attr("ConfigError");
    const py::object value =
        type(error.what(), error.file, error.line, error.key, error.expected, error.got);
    PyErr_SetObject(type.ptr(), value.ptr());
  }
}

}  // namespace
}  // namespace softarm::python

bool pybind11::detail::type_caster<softarm::python::Vector>::load(handle source, bool convert) {
  if (value.look_at(source)) return true;
  if (!convert) return false;
  const auto array = array_t<double, array::c_style | array::forcecast>::ensure(source);
  if (!array || !(array.ndim() == 1 || (array.ndim() == 2 && array.shape(1) == 1))) return false;
  converted_ = array;
  new (&value) softarm::python::Vector(array.data(), array.size());
  return true;
}

PYBIND11_MODULE(_core, module) {
  using namespace softarm;
  using namespace softarm::python;
  module.doc() = "C++ part of the package softarm";
  module.attr("__version__") = version_text();
  py::register_exception_translator(&translate_config_error);

  py::class_<Experiment>(module, "Experiment",
                         "An experiment as in its file, checked, with every default filled in.")
      .def_readonly("name", &Experiment::name)
      .def_property(
          "seed", [](const Experiment& e) { return e.seed; },
          [](Experiment& e, std::uint64_t seed) { e.seed = e.plant.seed = seed; },
          "of noise and dropouts of the simulated arm")
      .def_readonly("rate_hz", &Experiment::rate_hz, "of the control tick, Hz")
      .def_property_readonly("segments", [](const Experiment& e) { return e.arm.size(); })
      .def_property_readonly(
          "chambers",
          [](const Experiment& e) {
            std::vector<std::size_t> counts;
            for (const auto& segment : e.actuation.segments) counts.push_back(segment.size());
            return counts;
          },
          "number of chambers of every segment")
      .def_property_readonly("duration_s", [](const Experiment& e) { return e.run.duration_s; })
      .def_property_readonly(
          "pressure_limits_bar",
          [](const Experiment& e) {
            return py::make_tuple(e.actuation.min_pressure_bar, e.actuation.max_pressure_bar);
          },
          "lowest and highest command, bar (N m with actuation by torque)")
      .def_property_readonly(
          "max_theta_rad", [](const Experiment& e) { return e.control.max_theta_rad; },
          "soft limit of every segment's bending angle, rad")
      .def_property_readonly(
          "warnings", [](const Experiment& e) { return experiment_warnings(e); },
          "what is allowed but probably not intended, one sentence each")
      .def_property_readonly("text", &resolved_text,
                             "the whole configuration as YAML with every default")
      .def("__repr__", [](const Experiment& e) {
        return fmt::format("<softarm.Experiment '{}': {} segments, {:g} Hz>", e.name, e.arm.size(),
                           e.rate_hz);
      });
  module.def(
      "load_experiment", [](const std::filesystem::path& file) { return load_experiment(file); },
      py::arg("file"),
      "Read and check an experiment in YAML, with the files that it includes.\n\n"
      "Raises ConfigError with file, line, key, expected and got.");

  bind_model(module);
  bind_control(module);
  bind_simulation(module);
  bind_client(module);
  bind_law(module);
}
