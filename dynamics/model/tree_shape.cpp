// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/dynamics/model/tree_shape.h>

#include <dyntape/autodiff/error.h>

namespace dyntape::dynamics::detail {

void throw_shape(const char* function, const char* what, const std::string& model, int index,
                 const std::string& joint) {
  throw ArgumentError(std::string(function) + ": " + what +
                      " was made for other joints than those of model \"" + model + "\": joint " +
                      std::to_string(index) + " \"" + joint + "\" differs");
}

}  // namespace dyntape::dynamics::detail
