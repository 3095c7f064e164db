// SPDX-License-Identifier: BSD-3-Clause
//
// What the extension module is made of, a file a subject.
#pragma once

#include <nanobind/nanobind.h>

namespace dyntape::python {

namespace nb = nanobind;

void bind_errors(nb::module_& module);           // errors.cpp
void bind_recorded_values(nb::module_& module);  // recorded_values.cpp
void bind_functions(nb::module_& module);        // functions.cpp
void bind_robot(nb::module_& module);            // robot.cpp

}  // namespace dyntape::python
