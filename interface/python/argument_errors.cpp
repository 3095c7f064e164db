// SPDX-License-Identifier: BSD-3-Clause
//
// TypeErrors of wrong arguments in one sentence.  nanobind lists all signatures and the types of all arguments; here every bound
// function gets a call that rewrites this error by dyntape._messages.of_arguments().
#include <nanobind/stl/string.h>

#include <string_view>
#include <unordered_map>

#include "module.h"

namespace dyntape::python {
namespace {

// The calls that nanobind gave to its functions, which live as long as the module.
std::unordered_map<PyObject*, vectorcallfunc>& original_calls() {
  static auto& calls = *new std::unordered_map<PyObject*, vectorcallfunc>;
  return calls;
}

// Replaces the error at hand if it is nanobind's of wrong arguments to this function.  Errors of Python code, and of functions that the
// user passes, have a traceback or another name.
void rewrite(PyObject* function, PyObject* const* arguments, std::size_t count, PyObject* names) {
  nb::python_error error;  // takes the error
  const std::string text = nb::cast<std::string>(nb::str(error.value()));
  const nb::object sentence = [&]() -> nb::object {
    const std::string own =
        nb::cast<std::string>(nb::handle(function).attr("__name__")) + "(): incompatible function arguments";
    if (!text.starts_with(own) || error.traceback().is_valid()) return nb::none();
    nb::list given;
    nb::dict by_name;
    for (std::size_t i = 0; i < count; ++i) given.append(nb::handle(arguments[i]));
    for (std::size_t k = 0; names && k < nb::len(nb::handle(names)); ++k)
      by_name[nb::handle(PyTuple_GET_ITEM(names, Py_ssize_t(k)))] = nb::handle(arguments[count + k]);
    try {
      return nb::module_::import_("dyntape._messages")
          .attr("of_arguments")(nb::handle(function), given, by_name);
    } catch (const nb::python_error&) {
      return nb::none();  // the text as it was
    }
  }();
  if (sentence.is_none()) {
    error.restore();
  } else {
    PyErr_SetObject(PyExc_TypeError, sentence.ptr());
  }
}

PyObject* call(PyObject* function, PyObject* const* arguments, std::size_t n, PyObject* names) {
  PyObject* const result = original_calls().at(function)(function, arguments, n, names);
  constexpr std::size_t kCount = 0xffffffff;  // the bits above are flags of Python's and nanobind's
  if (!result && PyErr_ExceptionMatches(PyExc_TypeError)) rewrite(function, arguments, n & kCount, names);
  return result;
}

void rewrite_errors_of(nb::handle function) {
  const std::string_view type = Py_TYPE(function.ptr())->tp_name;
  const Py_ssize_t offset = Py_TYPE(function.ptr())->tp_vectorcall_offset;
  if ((type != "nanobind.nb_func" && type != "nanobind.nb_method") || offset <= 0) return;
  auto* const slot = reinterpret_cast<vectorcallfunc*>(reinterpret_cast<char*>(function.ptr()) + offset);
  if (*slot == call) return;
  original_calls()[function.ptr()] = *slot;
  *slot = call;
}

}  // namespace

void rewrite_argument_errors(nb::module_ module) {
  for (nb::handle entry : nb::list(module.attr("__dict__").attr("values")())) {
    rewrite_errors_of(entry);
    if (!PyType_Check(entry.ptr())) continue;
    for (nb::handle member : nb::list(entry.attr("__dict__").attr("values")())) rewrite_errors_of(member);
  }
}

}  // namespace dyntape::python
