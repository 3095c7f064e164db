// SPDX-License-Identifier: BSD-3-Clause
//
// What the extension module is made of, a file a subject.
#pragma once

#include <nanobind/nanobind.h>

#include <dyntape/autodiff/error.h>

namespace dyntape::python {

namespace nb = nanobind;

// A property that its class has and this object has not, as q of a problem of one's own: dyntape.MissingError.
struct MissingError : ArgumentError {
  using ArgumentError::ArgumentError;
};

void bind_errors(nb::module_& module);             // errors.cpp
void bind_recorded_values(nb::module_& module);    // recorded_values.cpp
void bind_functions(nb::module_& module);          // functions.cpp
void bind_robot(nb::module_& module);              // robot.cpp
void bind_scenes(nb::module_& module);             // scenes.cpp
void bind_tasks(nb::module_& module);              // tasks.cpp
void bind_problems(nb::module_& module);           // problems.cpp
void bind_task_control(nb::module_& module);       // task_control.cpp
void bind_sweeps(nb::module_& module);             // sweeps.cpp
void bind_sweep_chunks(nb::module_& module);       // bridges/sweep_chunks.cpp
void bind_identification(nb::module_& module);     // identification.cpp
void bind_quadratic(nb::module_& module);          // quadratic.cpp
void rewrite_argument_errors(nb::module_ module);  // argument_errors.cpp, after all others

}  // namespace dyntape::python
