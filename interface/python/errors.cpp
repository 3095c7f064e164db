// SPDX-License-Identifier: BSD-3-Clause
//
// The family of exceptions (autodiff/error.h) in Python: the same sentences, and each also what Python has for it.
#include <dyntape/autodiff/error.h>

#include <cstring>
#include <filesystem>
#include <string>
#include <typeinfo>
#include <utility>

#include "module.h"

namespace dyntape::python {
namespace {

nb::object make(nb::module_& module, const char* name, nb::handle bases, const char* what) {
  nb::object type = nb::module_::import_("builtins").attr("type")(name, bases, nb::dict());
  type.attr("__module__") = "dyntape";
  type.attr("__doc__") = what;
  module.attr(name) = type;
  return type;
}

// The exceptions, from the most special to the root.
struct PythonErrors {
  nb::object error, argument, missing, file, recording, guard, tool, numerical;
};
PythonErrors* family = nullptr;  // lives as long as the process: exceptions may be raised until its end

const nb::object& type_of(const Error& error) {
  if (dynamic_cast<const MissingError*>(&error)) return family->missing;
  if (dynamic_cast<const ArgumentError*>(&error)) return family->argument;
  if (dynamic_cast<const FileError*>(&error)) return family->file;
  if (dynamic_cast<const RecordingError*>(&error)) return family->recording;
  if (dynamic_cast<const GuardViolation*>(&error)) return family->guard;
  if (dynamic_cast<const ToolError*>(&error)) return family->tool;
  if (dynamic_cast<const NumericalError*>(&error)) return family->numerical;
  return family->error;
}

// The sentence with Python's words for what C++ calls otherwise.
std::string in_python_words(std::string sentence) {
  constexpr std::pair<const char*, const char*> kWords[] = {
      {"use select(condition, a, b)", "use dyntape.where(condition, a, b)"},
      {"or none (Problem::kFree)", "or NaN for a free entry"},
      {"step before solution()", "step before that"}};
  for (const auto& [from, to] : kWords) {
    const std::size_t at = sentence.find(from);
    if (at != sentence.npos) sentence.replace(at, std::strlen(from), to);
  }
  return sentence;
}

void translate(const std::exception_ptr& exception, void*) {
  try {
    std::rethrow_exception(exception);
  } catch (const Error& error) {
    PyErr_SetString(type_of(error).ptr(), in_python_words(error.what()).c_str());
  } catch (const std::filesystem::filesystem_error& error) {
    const std::string sentence = error.path1().string() + ": " + error.code().message();
    PyErr_SetString(family->file.ptr(), sentence.c_str());
  } catch (const std::bad_cast&) {
    PyErr_SetString(PyExc_TypeError,
                    "an argument, or an entry of one, has a type that nothing can be made of");
  }
}

}  // namespace

void bind_errors(nb::module_& module) {
  const nb::module_ builtins = nb::module_::import_("builtins");
  const auto with = [&](nb::handle root, const char* other) {
    return nb::make_tuple(root, builtins.attr(other));
  };
  family = new PythonErrors;
  family->error = make(module, "Error", nb::make_tuple(builtins.attr("Exception")),
                       "Root of dyntape's exceptions; the message is one sentence.");
  family->argument = make(module, "ArgumentError", with(family->error, "ValueError"),
                          "Something that was passed has the wrong shape, name or value.");
  family->missing = make(module, "MissingError", with(family->argument, "AttributeError"),
                         "A property that objects of this class may have, and this one has not.");
  family->file = make(module, "FileError", with(family->error, "OSError"),
                      "A file could not be read, or says something that cannot be: `file:line: sentence`.");
  family->recording = make(module, "RecordingError", with(family->error, "RuntimeError"),
                           "Recording was used in a way that cannot give a correct function.");
  family->guard = make(module, "GuardViolation", with(family->error, "ArithmeticError"),
                       "An evaluation left the branch that was recorded: the message names file and line.");
  family->tool = make(module, "ToolError", with(family->error, "RuntimeError"),
                      "An external tool, the compiler mostly, failed.");
  family->numerical = make(module, "NumericalError", with(family->error, "ArithmeticError"),
                           "A numerical procedure has no valid answer.");
  nb::register_exception_translator(translate);
}

}  // namespace dyntape::python
