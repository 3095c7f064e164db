// SPDX-License-Identifier: BSD-3-Clause
//
// Recorded functions as callees (callee.h): called from other recordings, derived when a derivation meets the call.
//
//   const auto leg = recorded_callee(record("leg", 3, ...));
//   record("robot", 12, [&](const VectorXad& q) { ... call(leg, q.segment(0, 3)) ... });
#pragma once

#include <memory>

#include <dyntape/autodiff/graph/callee.h>
#include <dyntape/autodiff/graph/function.h>

namespace dyntape {

// Throws ArgumentError if the function has parameters, weights or guards.
std::shared_ptr<const Callee> recorded_callee(const Function& function);

// The same, dissolving in the code around its calls, with derivatives that the caller knows better than
// derivation would find them (none: as derivation finds them, dissolving as well).
//   jvp, vjp   recorded callees of (in, tangents of in) and of (in, adjoints of out)
std::shared_ptr<const Callee> dissolving_callee(const Function& function, CalleeMaker jvp = {},
                                                CalleeMaker vjp = {});

}  // namespace dyntape
