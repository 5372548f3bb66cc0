// Methods of softarm.Arm that take rows of numbers and give one, called in half of the time.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "arm.hpp"

namespace softarm::python {

/// False where the function that pybind11 calls shall be asked for the reason.
template <std::size_t kRows>
using RowFunction = bool (*)(Arm&, const std::array<Vector, kRows>&, VectorRef out);

/// Lets a call with `kRows` arrays of dof() finite doubles past pybind11's dispatcher, which takes
/// longer than the dynamics of an arm. All else, keywords, lists, what is wrong, goes to pybind11's
/// function, as before.
template <std::size_t kRows, RowFunction<kRows> kFunction>
class RowMethod {
 public:
  /// Takes the place of the method of that name.
  static void shorten(py::class_<Arm>& type, const char* name) {
    whole_ = py::object(type.attr(name)).release().ptr();
    static std::string doc;
    doc = py::str(py::handle(whole_).attr("__doc__"));
    void* const function = reinterpret_cast<void*>(&call);
    static PyMethodDef definition{name, reinterpret_cast<PyCFunction>(function),
                                  METH_FASTCALL | METH_KEYWORDS, doc.c_str()};
    auto* const python_type = reinterpret_cast<PyTypeObject*>(type.ptr());
    type.attr(name) =
        py::reinterpret_steal<py::object>(PyDescr_NewMethod(python_type, &definition));
  }

 private:
  static PyObject* call(PyObject* self, PyObject* const* arguments, Py_ssize_t count,
                        PyObject* names) noexcept {
    try {
      if (names == nullptr && count == kRows) {
        if (PyObject* const out = short_way(self, arguments)) return out;
      }
      std::vector<PyObject*> all{self};
      const Py_ssize_t named = names == nullptr ? 0 : PyTuple_GET_SIZE(names);
      all.insert(all.end(), arguments, arguments + count + named);
      return PyObject_Vectorcall(whole_, all.data(), static_cast<std::size_t>(count) + 1, names);
    } catch (py::error_already_set& error) {
      error.restore();
    } catch (const std::bad_alloc&) {
      PyErr_NoMemory();
    }
    return nullptr;
  }

  /// None where the long way is to be taken.
  static PyObject* short_way(PyObject* self, PyObject* const* arguments) {
    const auto& instance = *reinterpret_cast<py::detail::instance*>(self);
    if (!instance.simple_layout || instance.simple_value_holder[0] == nullptr) return nullptr;
    Arm& arm = *static_cast<Arm*>(instance.simple_value_holder[0]);
    std::array<Vector, kRows> rows;
    for (std::size_t i = 0; i < kRows; ++i) {
      if (!rows[i].look_at(arguments[i]) || rows[i].size() != arm.parameters.dof() ||
          !rows[i].allFinite()) {
        return nullptr;
      }
    }
    Result out(arm.parameters.dof());
    return kFunction(arm, rows, out.vector) ? out.array.release().ptr() : nullptr;
  }

  static inline PyObject* whole_ = nullptr;
};

}  // namespace softarm::python
