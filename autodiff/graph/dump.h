// SPDX-License-Identifier: BSD-3-Clause
//
// A recorded function to read: one line a node, or a drawing.
//
//   std::cout << to_text(f);            //   n3 = Mul n0, n2
//   std::ofstream("f.dot") << to_dot(f);      // dot -Tsvg f.dot > f.svg
#pragma once

#include <string>

#include <dyntape/autodiff/graph/function.h>

namespace dyntape {

// Inputs by name where they have one, constants so that they round-trip, calls with their arguments, then
// outputs and guards.
std::string to_text(const Function& function);

// Graphviz.  Throws ArgumentError above `most` live nodes: no picture of that many can be read.
std::string to_dot(const Function& function, std::size_t most = 500);

}  // namespace dyntape
