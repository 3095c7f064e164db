// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/dynamics/model/checks.h>

#include <dyntape/autodiff/error.h>

namespace dyntape::dynamics::detail {

void throw_size(const char* function, const char* what, long got, long expected, const std::string& model,
                const char* counted) {
  throw ArgumentError(std::string(function) + ": " + what + " has " + std::to_string(got) + " " + counted +
                      ", expected " + std::to_string(expected) + " for model \"" + model + "\"");
}

}  // namespace dyntape::dynamics::detail
