// SPDX-License-Identifier: BSD-3-Clause
//
// The recording scalar in Python, its conditions, and arrays of it.
#include <nanobind/stl/string.h>

#include <cmath>
#include <sstream>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/record/linear_algebra.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/interface/robot/robot_workspace.h>

#include "numpy_api.h"
#include "recorded_arrays.h"

namespace dyntape::python {
namespace {

// The outcome of a comparison, and where it stands in Python.
struct Comparison {
  AD truth;
  std::string file;
  int line = 0;

  Condition condition() const { return {truth, file.c_str(), line}; }
};

// --- Places -----------------------------------------------------------------------------------------------

bool is_own(const std::string& file) {
  return file.ends_with("/dyntape/_arrays.py") || file.find("/site-packages/numpy/") != file.npos;
}

// The line of Python that runs, this package's own and numpy's left out.
void find_place(std::string& file, int& line) {
  nb::object frame = nb::borrow(reinterpret_cast<PyObject*>(PyEval_GetFrame()));
  while (frame.is_valid()) {
    auto* here = reinterpret_cast<PyFrameObject*>(frame.ptr());
    const nb::object code = nb::steal(reinterpret_cast<PyObject*>(PyFrame_GetCode(here)));
    file = nb::cast<std::string>(code.attr("co_filename"));
    line = PyFrame_GetLineNumber(here);
    if (!is_own(file)) return;
    frame = nb::steal(reinterpret_cast<PyObject*>(PyFrame_GetBack(here)));
  }
}

// --- Where a number stops being one -----------------------------------------------------------------------

thread_local bool finds_not_finite = false;

std::string sentence_of(const std::string& name, const AD& a, const AD* b) {
  std::ostringstream text;
  text << (name.starts_with("operator") ? name.substr(8) : name);
  if (name == "operator/" && b)
    text.str(""), text << a.value() << " / " << b->value();
  else if (b)
    text << " of " << a.value() << " and " << b->value();
  else
    text << " of " << a.value();
  return text.str();
}

// The result, unless it is looked for what is not finite and this is where it begins.
AD told(const AD& result, Op op, const std::string& name, const AD& a, const AD* b = nullptr) {
  if (!finds_not_finite) [[likely]]
    return result;
  const double x = a.value(), y = b ? b->value() : 0, r = result.value();
  if (!std::isfinite(x) || !std::isfinite(y)) return result;
  std::string what;
  if (!std::isfinite(r))
    what = std::isnan(r) ? " is no number" : " is infinite";
  else if ((a.is_recorded() && !std::isfinite(slope(op, 0, x, y, 0.0, r, 1.0))) ||
           (b && b->is_recorded() && !std::isfinite(slope(op, 1, x, y, 0.0, r, 1.0))))
    what = " has no slope";
  if (what.empty()) return result;
  std::string file;
  int line = 0;
  find_place(file, line);
  throw NumericalError(file + ":" + std::to_string(line) + ": " + sentence_of(name, a, b) + what);
}

// --- Operators --------------------------------------------------------------------------------------------

// f(self, other), or NotImplemented where the other is an array or nothing that can be computed with.
template <class F>
nb::object with_other(const AD& self, nb::handle other, F f) {
  AD value;
  if (!as_recorded(other, value)) return nb::borrow(Py_NotImplemented);
  return nb::cast(f(self, value));
}

template <class F>
nb::object compared(const AD& self, nb::handle other, F f) {
  return with_other(self, other, [&](const AD& a, const AD& b) {
    Comparison result{f(a, b), {}, 0};
    find_place(result.file, result.line);
    return result;
  });
}

AD operand(nb::handle given, const char* function) {
  AD value;
  if (as_recorded(given, value)) return value;
  throw ArgumentError(std::string(function) + ": expected recorded values and numbers, got " +
                      nb::cast<std::string>(nb::repr(given.type())));
}

// --- The table of operators -------------------------------------------------------------------------------

// Functions of one argument are methods, also by numpy's name, which is what ufuncs call of arrays of objects; all are
// functions of the module as well, for numbers and recorded values.
std::string numpy_name(const std::string& name) {
  if (name == "pow") return "power";
  if (name == "min" || name == "max") return name + "imum";
  const bool is_arc = name.size() > 3 && name[0] == 'a' && name != "abs" && name != "azmul";
  return is_arc ? "arc" + name.substr(1) : name;
}

bool is_operator(const std::string& name) { return name.starts_with("operator"); }

void define(nb::module_& module, nb::class_<AD>& type, Op op, const std::string& name, AD (*f)(const AD&)) {
  if (is_operator(name)) return;
  const std::string alias = numpy_name(name);
  const auto of = [f, op, name](const AD& x) { return told(f(x), op, name, x); };
  type.def(alias.c_str(), of);
  if (alias != name) type.def(name.c_str(), of);
  module.def(alias.c_str(), [of, alias](nb::handle x) { return of(operand(x, alias.c_str())); });
}

void define(nb::module_& module, nb::class_<AD>&, Op op, const std::string& name,
            AD (*f)(const AD&, const AD&)) {
  if (is_operator(name)) return;
  const std::string alias = numpy_name(name);
  module.def(alias.c_str(), [f, op, name, alias](nb::handle given_x, nb::handle given_y) {
    const AD x = operand(given_x, alias.c_str()), y = operand(given_y, alias.c_str());
    return told(f(x, y), op, name, x, &y);
  });
}

void define_functions(nb::module_& module, nb::class_<AD>& type) {
#define OP(name, fn, n, ...) DYNTAPE_PYTHON_##n(name, fn)
#define DYNTAPE_PYTHON_1(name, fn)                                                     \
  define(module, type, Op::name, #fn, static_cast<AD (*)(const AD&)>([](const AD& x) { \
           using dyntape::fn;                                                          \
           return fn(x);                                                               \
         }));
#define DYNTAPE_PYTHON_2(name, fn)                                                \
  define(module, type, Op::name, #fn,                                             \
         static_cast<AD (*)(const AD&, const AD&)>([](const AD& x, const AD& y) { \
           using dyntape::fn;                                                     \
           return fn(x, y);                                                       \
         }));
#define DYNTAPE_PYTHON_3(name, fn)
#include <dyntape/autodiff/graph/ops.def>
#undef DYNTAPE_PYTHON_1
#undef DYNTAPE_PYTHON_2
#undef DYNTAPE_PYTHON_3
}

// --- Conditions -------------------------------------------------------------------------------------------

// Both branches are recorded; a plain bool chooses at once.
nb::object select_by(nb::handle condition, nb::handle a, nb::handle b) {
  if (nb::isinstance<Comparison>(condition)) {
    return nb::cast(
        select(nb::cast<const Comparison&>(condition).truth, operand(a, "where"), operand(b, "where")));
  }
  const int truth = PyObject_IsTrue(condition.ptr());
  if (truth < 0) nb::raise_python_error();
  return nb::cast(operand(truth ? a : b, "where"));
}

// Of a Condition and a Condition or a bool.
template <class F>
nb::object joined(const Comparison& self, nb::handle other, F f) {
  AD truth;
  if (nb::isinstance<Comparison>(other))
    truth = nb::cast<const Comparison&>(other).truth;
  else if (PyBool_Check(other.ptr()) || PyArray_IsScalar(other.ptr(), Bool))
    truth = AD(PyObject_IsTrue(other.ptr()) ? 1.0 : 0.0);
  else
    return nb::borrow(Py_NotImplemented);
  return nb::cast(Comparison{f(self.truth, truth), self.file, self.line});
}

void bind_conditions(nb::module_& module) {
  const auto both = [](const AD& a, const AD& b) { return select(a, b, AD(0)); };
  const auto either = [](const AD& a, const AD& b) { return select(a, AD(1), b); };
  const auto one = [](const AD& a, const AD& b) { return select(a, select(b, AD(0), AD(1)), b); };
  nb::class_<Comparison>(
      module, "Condition",
      "The outcome of a comparison of recorded values.\n\n"
      "`dyntape.where(condition, a, b)` records both branches and is right everywhere.  In an `if` the\n"
      "branch of the recording point is taken, and evaluations that would take the other raise\n"
      "GuardViolation with the line of the comparison.  `&`, `|`, `^` and `~` join conditions.")
      .def("__bool__", [](const Comparison& c) { return static_cast<bool>(c.condition()); })
      .def("__and__", [both](const Comparison& a, nb::handle b) { return joined(a, b, both); })
      .def("__rand__", [both](const Comparison& a, nb::handle b) { return joined(a, b, both); })
      .def("__or__", [either](const Comparison& a, nb::handle b) { return joined(a, b, either); })
      .def("__ror__", [either](const Comparison& a, nb::handle b) { return joined(a, b, either); })
      .def("__xor__", [one](const Comparison& a, nb::handle b) { return joined(a, b, one); })
      .def("__rxor__", [one](const Comparison& a, nb::handle b) { return joined(a, b, one); })
      .def("__invert__",
           [](const Comparison& c) {
             return Comparison{select(c.truth, AD(0), AD(1)), c.file, c.line};
           })
      .def("__repr__", [](const Comparison& c) {
        return "<dyntape.Condition of " + c.file + ":" + std::to_string(c.line) + ", " +
               (c.truth.value() != 0 ? "true" : "false") + " at the recording point>";
      });
  module.def("select", select_by, nb::arg("condition"), nb::arg("a"), nb::arg("b"));
}

using Binary = AD (*)(const AD&, const AD&);

// self op other, and other op self.
void define_operator(nb::class_<AD>& type, const std::string& name, Binary f) {
  const auto define = [&](const std::string& spelt, auto body) {
    type.def(spelt.c_str(), body, nb::is_operator(),
             nb::sig(kept("def " + spelt + "(self, other: AD | float, /) -> AD")));
  };
  define("__" + name + "__", [f](const AD& self, nb::handle other) { return with_other(self, other, f); });
  define("__r" + name + "__", [f](const AD& self, nb::handle other) {
    return with_other(self, other, [f](const AD& a, const AD& b) { return f(b, a); });
  });
}

void define_comparison(nb::class_<AD>& type, const std::string& name, Binary f) {
  const std::string spelt = "__" + name + "__";
  const bool overrides = name == "eq" || name == "ne";  // object has them, and they give a bool
  const std::string types = overrides ? "object, /) -> Any" : "AD | float, /) -> Condition";
  type.def(
      spelt.c_str(), [f](const AD& self, nb::handle other) { return compared(self, other, f); },
      nb::is_operator(), nb::sig(kept("def " + spelt + "(self, other: " + types)));
}

// As Python has it: with the sign of b.
AD modulo(const AD& a, const AD& b) {
  const AD rest = fmod(a, b);
  const AD has_sign = equal(less(rest, AD(0)), less(b, AD(0)));
  return select(equal(rest, AD(0)), rest, select(has_sign, rest, rest + b));
}

void bind_operators(nb::class_<AD>& ad) {
  define_operator(ad, "add", [](const AD& a, const AD& b) { return a + b; });
  define_operator(ad, "sub", [](const AD& a, const AD& b) { return a - b; });
  define_operator(ad, "mul", [](const AD& a, const AD& b) { return a * b; });
  define_operator(ad, "truediv",
                  [](const AD& a, const AD& b) { return told(a / b, Op::Div, "operator/", a, &b); });
  define_operator(ad, "mod", modulo);
  define_operator(ad, "floordiv",
                  [](const AD& a, const AD& b) { return floor((a - modulo(a, b)) / b + 0.5); });
  define_operator(ad, "pow", [](const AD& a, const AD& b) { return told(pow(a, b), Op::Pow, "pow", a, &b); });
  define_comparison(ad, "lt", [](const AD& a, const AD& b) { return less(a, b); });
  define_comparison(ad, "gt", [](const AD& a, const AD& b) { return less(b, a); });
  define_comparison(ad, "le", [](const AD& a, const AD& b) { return less_equal(a, b); });
  define_comparison(ad, "ge", [](const AD& a, const AD& b) { return less_equal(b, a); });
  define_comparison(ad, "eq", [](const AD& a, const AD& b) { return equal(a, b); });
  define_comparison(ad, "ne", [](const AD& a, const AD& b) { return not_equal(a, b); });
  ad.def("__neg__", [](const AD& a) { return -a; }).def("__pos__", [](const AD& a) { return a; });
  ad.def("__abs__", [](const AD& a) { return abs(a); }).def("__floor__", [](const AD& a) {
    return floor(a);
  });
  ad.def("__ceil__", [](const AD& a) { return ceil(a); }).def("__trunc__", [](const AD& a) {
    return trunc(a);
  });
  ad.def("conjugate", [](const AD& a) { return a; });
  ad.def("__float__", [](const AD& a) {
    if (!a.is_recorded()) return a.value();
    throw RecordingError(
        "a recorded value is no plain number; expected numpy's functions in place of math's, and "
        "np.array([...]) or "
        "np.concatenate in place of writing into an array of floats");
  });
}

void bind_scalar(nb::module_& module) {
  nb::class_<AD> ad(module, "AD",
                    "A recorded number: computes as a float does, and the recording keeps what it did.");
  bind_operators(ad);
  ad.def_prop_ro("value", &AD::value, "The value at the recording point.");
  ad.def_prop_ro("is_recorded", &AD::is_recorded,
                 "Whether it depends on an input of its recording; otherwise it is a constant.");
  ad.def("__repr__", [](const AD& a) {
    std::ostringstream text;
    text << "AD(" << a.value() << (a.is_recorded() ? ", recorded)" : ")");
    return text.str();
  });
  ad.def(
      "__format__",
      [](nb::handle a, const std::string& format) {
        if (format.empty()) return nb::cast<std::string>(nb::repr(a));
        throw RecordingError(
            "format '" + format +
            "' of a recorded value: it has a number only where a function is evaluated; expected no format, "
            "or that of its .value, the number at the recording point");
      },
      nb::arg("format"));
  define_functions(module, ad);
}

// --- Matrices ---------------------------------------------------------------------------------------------

using RowMajorAd = Eigen::Matrix<AD, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// The extents of an array or of nested lists.
Shape shape_of(nb::handle given) {
  return nb::cast<Shape>(nb::list(nb::module_::import_("numpy").attr("shape")(given)));
}

MatrixXad recorded_matrix(nb::handle given, const std::string& what) {
  const Shape shape = shape_of(given);
  if (shape.size() != 2) throw ArgumentError(what + ": expected a matrix (n, n), got " + shape_text(shape));
  const VectorXad values = recorded_vector(given, what);
  return RowMajorAd::Map(values.data(), shape[0], shape[1]);
}

nb::object array_of_matrix(const MatrixXad& matrix, const Shape& shape) {
  const RowMajorAd rows = matrix;
  return recorded_array(rows.data(), shape);
}

nb::object cholesky(nb::handle a) {
  const MatrixXad matrix = recorded_matrix(a, "cholesky");
  return array_of_matrix(llt(matrix), {matrix.rows(), matrix.cols()});
}

nb::object symmetric_solve(nb::handle a, nb::handle b) {
  const MatrixXad matrix = recorded_matrix(a, "symmetric_solve: a");
  const Shape shape = shape_of(b);
  if (shape.empty() || shape.size() > 2)
    throw ArgumentError("symmetric_solve: expected b of shape (n,) or (n, k), got " + shape_text(shape));
  const VectorXad values = recorded_vector(b, "symmetric_solve: b");
  const MatrixXad right = RowMajorAd::Map(values.data(), shape[0], shape.size() == 2 ? shape[1] : 1);
  return array_of_matrix(ldlt_solve(ldlt(matrix), right), shape);
}

}  // namespace

FindNotFinite::FindNotFinite() { finds_not_finite = true; }
FindNotFinite::~FindNotFinite() { finds_not_finite = false; }

bool as_recorded(nb::handle given, AD& value) {
  if (nb::isinstance<AD>(given)) {
    value = nb::cast<const AD&>(given);
    return true;
  }
  if (!PyFloat_Check(given.ptr()) && !PyLong_Check(given.ptr()) && !PyArray_IsScalar(given.ptr(), Number) &&
      !PyArray_IsScalar(given.ptr(), Bool))
    return false;
  const double number = PyFloat_AsDouble(given.ptr());
  if (number == -1 && PyErr_Occurred()) nb::raise_python_error();
  value = AD(number);
  return true;
}

VectorXad recorded_vector(nb::handle given, const std::string& what) {
  const nb::object array =
      nb::steal(PyArray_FROM_OTF(given.ptr(), NPY_OBJECT, NPY_ARRAY_C_CONTIGUOUS | NPY_ARRAY_ALIGNED));
  if (!array.is_valid()) nb::raise_python_error();
  auto* entries = reinterpret_cast<PyArrayObject*>(array.ptr());
  auto* from = static_cast<PyObject**>(PyArray_DATA(entries));
  VectorXad values(PyArray_SIZE(entries));
  for (AD& value : values) {
    const nb::handle entry(*from ? *from : Py_None);  // numpy leaves null where it wrote nothing
    ++from;
    if (!as_recorded(entry, value))
      throw ArgumentError(
          what + ": expected recorded values and numbers, got " +
          (PyArray_Check(entry.ptr())
               ? "an array among them; expected a[0] of an array of one entry, or np.concatenate"
               : nb::cast<std::string>(nb::repr(entry.type()))));
  }
  return values;
}

VectorXad recorded_vector(nb::handle given, const std::string& what, Eigen::Index entries) {
  VectorXad values = recorded_vector(given, what);
  if (values.size() == entries) return values;
  throw ArgumentError(what + ": expected " + std::to_string(entries) + " entries in a recording, got " +
                      std::to_string(values.size()));
}

void explain(nb::python_error& error) {
  const nb::object better = nb::module_::import_("dyntape._arrays").attr("explained")(error.value());
  if (better.is_none()) return;
  PyErr_SetObject(better.type().ptr(), better.ptr());
  nb::raise_python_error();
}

nb::object recorded_array(const AD* values, const Shape& shape) {
  if (shape.empty()) return nb::cast(*values);
  const nb::object array =
      nb::steal(PyArray_SimpleNew(static_cast<int>(shape.size()), shape.data(), NPY_OBJECT));
  if (!array.is_valid()) nb::raise_python_error();
  auto* entries = reinterpret_cast<PyArrayObject*>(array.ptr());
  auto** to = static_cast<PyObject**>(PyArray_DATA(entries));
  for (npy_intp i = 0; i < PyArray_SIZE(entries); ++i) {
    PyObject* before = to[i];  // numpy fills new arrays of objects with None or nothing
    to[i] = nb::cast(values[i]).release().ptr();
    Py_XDECREF(before);
  }
  return array.attr("view")(nb::module_::import_("dyntape._arrays").attr("RecordedArray"));
}

VectorXad record_in_place(const Robot& robot, const RobotFunction& function, const VectorXad& state) {
  if (const auto callee = robot.callee(function)) return call(callee, state);
  const dynamics::Model<AD> taped = robot.model().cast<AD>();
  dyntape::detail::RobotWorkspace<AD> work(taped, function);
  VectorXad y(static_cast<Eigen::Index>(work.n_out()));
  work.evaluate(state.data(), y.data());
  return y;
}

void bind_recorded_values(nb::module_& module) {
  bind_scalar(module);
  module.def("cholesky", cholesky, nb::arg("a"));
  module.def(
      "symmetric_solve", symmetric_solve, nb::arg("a"), nb::arg("b"),
      nb::sig("def symmetric_solve(a: Any, b: Any) -> Any"),
      "x with a x = b, a (n, n) symmetric, of which the lower triangle is read, b (n,) or (n, k), of "
      "recorded values.\n\n"
      "By L D L^T, pivots in order, so that no guard is left.  Raises ArgumentError for other shapes.\n\n"
      ">>> f = dyntape.record(lambda x: dyntape.symmetric_solve(np.diag(x), np.ones(2)), 2)\n"
      ">>> f([2.0, 4.0])\n"
      "array([0.5 , 0.25])");
  bind_conditions(module);
}

}  // namespace dyntape::python
