// SPDX-License-Identifier: BSD-3-Clause
//
// Random graphs over every operator of the table, and special arguments for them.
//
//   Function f = random_functions(random, 200, 25);      200 graphs of about 25 operations, three outputs each
//   std::vector<double> x = random_arguments(random, f.n_x());
#pragma once

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include <dyntape/autodiff/graph/function.h>

#include "autodiff/random.h"

namespace dyntape::testing {

inline constexpr double kSpecials[] = {0.0,
                                       -0.0,
                                       1.0,
                                       -1.0,
                                       0.5,
                                       2.0,
                                       5e-324,
                                       -5e-324,
                                       2.2250738585072014e-308,
                                       1e-300,
                                       1e300,
                                       1.7976931348623157e308,
                                       0.1,
                                       1e16,
                                       9007199254740993.0,
                                       std::numeric_limits<double>::infinity(),
                                       -std::numeric_limits<double>::infinity(),
                                       std::numeric_limits<double>::quiet_NaN()};

inline double random_argument(Random& random) {
  switch (random.below(4)) {
    case 0:
      return kSpecials[random.below(std::size(kSpecials))];
    case 1:
      return std::bit_cast<double>(random.bits());
    default:
      return random.uniform(-3, 3);
  }
}

inline std::vector<double> random_arguments(Random& random, std::size_t n) {
  std::vector<double> values(n);
  for (double& v : values) v = random_argument(random);
  return values;
}

// Graphs that share inputs, so that one library holds many.  Every operator appears for which `may` is true.
inline Function random_functions(
    Random& random, std::size_t graphs, std::size_t operations, bool (*may)(Op) = [](Op) { return true; }) {
  Function f;
  f.name = "random";
  f.inputs = {6, 3, 0};
  for (std::size_t g = 0; g < graphs; ++g) {
    std::vector<NodeId> pool;
    for (std::uint32_t i = 0; i < 6; ++i) pool.push_back(f.graph.input(Block::kVariables, i));
    for (std::uint32_t i = 0; i < 3; ++i) pool.push_back(f.graph.input(Block::kParameters, i));
    for (int i = 0; i < 2; ++i) pool.push_back(f.graph.constant(random_argument(random)));
    for (std::size_t k = 0; k < operations; ++k) {
      auto op = static_cast<Op>((g + k * 7 + random.below(3)) % kTableOps);
      while (!may(op)) op = static_cast<Op>((static_cast<int>(op) + 1) % kTableOps);
      const auto pick = [&] {  // recent nodes more often: deep rather than wide
        const std::size_t back = random.below(2) ? pool.size() : std::min<std::size_t>(pool.size(), 6);
        return pool[pool.size() - 1 - random.below(back)];
      };
      const int arity = info(op).arity;
      NodeId a = pick(), b = arity > 1 ? pick() : kNoNode, c = arity > 2 ? pick() : kNoNode;
      // The sign of a NaN is the one thing that neither C nor IEEE 754 defines, and copysign would show it.
      if (op == Op::Copysign)
        b = f.graph.make(Op::Select, f.graph.make(Op::Eq, b, b), b, f.graph.constant(1));
      pool.push_back(f.graph.make(op, a, b, c));
    }
    // Not only the last value: what a late NaN or comparison hides is seen in the earlier ones.
    for (std::size_t back : {1, 3, 6}) f.outputs.push_back(pool[pool.size() - back]);
  }
  return f;
}

// Equal bit for bit; of a NaN only that it is one (which of two operands' payloads survives is not defined).
inline bool same(double a, double b) {
  return (std::isnan(a) && std::isnan(b)) ||
         std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

}  // namespace dyntape::testing
