// SPDX-License-Identifier: BSD-3-Clause
//
// A program that is too large is refused before memory is spent on it.
#pragma once

#include <cstddef>
#include <string>

namespace dyntape {

// ArgumentError where intervals of so many variables, constraints and non-zeros each ask for more memory than there is, or for more
// numbers than a solver can count.
void check_size(const std::string& problem, std::size_t intervals, double numbers_of_interval);

}  // namespace dyntape
