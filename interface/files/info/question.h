// SPDX-License-Identifier: BSD-3-Clause
//
// Questions to a Section (section.h).
#pragma once

#include <string>

#include <dyntape/interface/io/range.h>

namespace dyntape::io {

// A question that was asked, for lists of keys.
struct Question {
  std::string path;      // "solver.tolerance"
  std::string takes;     // "a number, positive", "euler | trapezoid"; "a block"
  std::string fallback;  // value of an absent key
  bool is_required = false;
  std::string meaning;
};

}  // namespace dyntape::io
