// SPDX-License-Identifier: BSD-3-Clause
//
// Random robots: what is wrong with the one of a seed, in a sentence; "" if nothing is.
#pragma once

#include <cstdint>
#include <string>

namespace dyntape::testing {

// Functions and derivatives as templates on double and on the interpreted tape, against 113 bits.
std::string robot_failure(std::uint64_t seed);
// The same functions compiled, against the interpreter bit for bit.
std::string compiled_robot_failure(std::uint64_t seed);

}  // namespace dyntape::testing
