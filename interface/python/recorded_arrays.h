// SPDX-License-Identifier: BSD-3-Clause
//
// Recorded values in numpy arrays of objects: what a Python function computes with while it is recorded.
#pragma once

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/record/record.h>

#include "arrays.h"
#include "robot.h"

namespace dyntape::python {

// A recorded value, or a number: AD of an AD, float, int or numpy scalar.  False: it is something else.
bool as_recorded(nb::handle given, AD& value);

// The entries of an array, list or tuple of those, in C order; ArgumentError, naming `what`, for others.
VectorXad recorded_vector(nb::handle given, const std::string& what);
VectorXad recorded_vector(nb::handle given, const std::string& what, Eigen::Index entries);

// Throws what `error`, of a function that is recorded, means, where it is numpy's: dyntape._arrays.explained().
void explain(nb::python_error& error);

// f(arguments) of a function that is recorded; ArgumentError, naming it, if it returned nothing.
template <class... Arguments>
nb::object call_recorded(nb::handle f, const std::string& name, const Arguments&... arguments) {
  try {
    nb::object result = f(arguments...);
    if (!result.is_none()) return result;
  } catch (nb::python_error& error) {
    explain(error);
    throw;
  }
  throw ArgumentError(name +
                      ": the function returned None; expected recorded values and numbers; a `return` may be "
                      "missing");
}

// A dyntape.Array (an array of objects whose comparisons give conditions); of no axes: the value itself.
nb::object recorded_array(const AD* values, const Shape& shape);

// While it lives, an operation of this thread whose value or slope is not finite, though its arguments are, raises NumericalError
// with the line of Python: "user.py:3: sqrt of -1 is nan".
class FindNotFinite {
 public:
  FindNotFinite();
  ~FindNotFinite();
  FindNotFinite(const FindNotFinite&) = delete;
  FindNotFinite& operator=(const FindNotFinite&) = delete;
};

// The function of a robot in the recording that the state belongs to.
VectorXad record_in_place(const Robot& robot, const RobotFunction& function, const VectorXad& state);

}  // namespace dyntape::python
