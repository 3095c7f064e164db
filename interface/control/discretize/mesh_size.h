// SPDX-License-Identifier: BSD-3-Clause
//
// Refuses a program that is too large before it takes memory.
#pragma once

#include <cstddef>
#include <string>

namespace dyntape {

// ArgumentError: intervals with these numbers of variables, constraints and non-zeros need more memory than the
// machine has, or more numbers than a solver can count.
void check_size(const std::string& problem, std::size_t intervals, double numbers_of_interval);

}  // namespace dyntape
