// SPDX-License-Identifier: BSD-3-Clause
//
// Sizes of arguments.
#pragma once

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/model/model.h>

#include <string>

namespace dyntape::dynamics::detail {

// Throws ArgumentError: `rnea: q has 6 entries, expected 7 for model "arm"`.
void throw_size(const char* function, const char* what, long got, long expected, const std::string& model,
                const char* counted = "entries");

template <class T>
void check(const char* function, const char* what, const Model<T>& model, long got, long expected) {
  if (got != expected) throw_size(function, what, got, expected, model.name);
}

// `rnea: external has 3 joints, expected 4 for model "arm"`
template <class T>
void check_count(const char* function, const char* what, const Model<T>& model, long got) {
  if (got != model.njoints()) throw_size(function, what, got, model.njoints(), model.name, "joints");
}

}  // namespace dyntape::dynamics::detail
