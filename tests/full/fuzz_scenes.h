// SPDX-License-Identifier: BSD-3-Clause
//
// Random scenes: what is wrong with the one of a seed, in a sentence; "" if nothing is.
//
// A random robot with a random choice of effects, whose numbers are spread over decades, moves for a moment.  What its energy
// balance (simulate.h) is off by has to vanish with the step, by the order of what acts, or be rounding.
#pragma once

#include <cstdint>
#include <string>

namespace dyntape::testing {

// A scene that fails is shrunk first: fewer effects, then fewer joints, as long as it fails.
std::string scene_failure(std::uint64_t seed);

}  // namespace dyntape::testing
