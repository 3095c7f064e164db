// SPDX-License-Identifier: BSD-3-Clause
//
// Prints a recorded function, as text with one line per node or as a Graphviz drawing.  Use it to debug a recording.
//
//   std::cout << to_text(f);            //   n3 = Mul n0, n2
//   std::ofstream("f.dot") << to_dot(f);      // dot -Tsvg f.dot > f.svg
#pragma once

#include <string>

#include <dyntape/autodiff/graph/function.h>

namespace dyntape {

// One line per node, then outputs and guards.  Inputs have their names, if any; constants have all their digits.
std::string to_text(const Function& function);

// The graph in Graphviz's language.  ArgumentError if the function has more than `most` live nodes.
std::string to_dot(const Function& function, std::size_t most = 500);

}  // namespace dyntape
