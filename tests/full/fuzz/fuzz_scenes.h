// SPDX-License-Identifier: BSD-3-Clause
//
// Random scenes: what is wrong with the one of a seed, in a sentence; "" if nothing is.
#pragma once

#include <cstdint>
#include <string>

namespace dyntape::testing {

// Random robots under random effects, by every scheme of fixed steps.  What the balance of energy is off by must fall with
// the step as simulate.h says, or be rounding.  A scene that fails is shrunk: its effects are dropped, then its joints.
std::string scene_failure(std::uint64_t seed);
// How many of those that were tried were refused with a sentence, and so show nothing.
std::uint64_t refused_scenes();

// Smooth ones among them, by schemes of fixed steps: the end of a motion that simulate() calls whole is as near to that of an
// adaptive integration at 1e-12 as accuracy_of() says, to a factor.
std::string accuracy_failure(std::uint64_t seed);

}  // namespace dyntape::testing
