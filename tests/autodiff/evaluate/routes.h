// SPDX-License-Identifier: BSD-3-Clause
//
// One program through every route to its values and derivatives: direct run, interpreter, 113 bits, forward,
// reverse, forward over reverse, reverse over forward, sparse first and second order, differences, patterns.
//
//   Random random(seed);
//   const Program program = random_program(random, 10 + random.below(60));
//   if (std::string found = disagreement(program, seed); !found.empty())
//     std::cerr << found << "\n" << shrunk_disagreement(program, seed);
#pragma once

#include <string>

#include "autodiff/random_program.h"

namespace dyntape::testing {

// The first disagreement in words, or nothing.  Directions and weights are drawn with the seed.
std::string disagreement(const Program& program, std::uint64_t seed);

// Of a program that disagrees: the smallest one that does so in the same way, and its instructions.
std::string shrunk_disagreement(const Program& program, std::uint64_t seed);

}  // namespace dyntape::testing
