// SPDX-License-Identifier: BSD-3-Clause
//
// What a Call node calls: another recorded function, or a kernel written by hand (a loop, an iterative
// solve). It stays one node on the tape and one function in the generated C, and its derivatives are calls
// again.
//
//   auto leg = recorded_callee(leg_function);                // derivatives are derived when asked for
//
//   Callee kepler;                                           // E - e sin E = M, solved by a loop for E
//   kepler.name = "kepler"; kepler.n_in = 2; kepler.n_out = 1;
//   kepler.evaluate = [](const double* in, double* out) { ... };
//   kepler.c_body = "...";                             // the same loop in C99: reads in[i], writes out[i]
//   kepler.jvp = [] { return recorded_callee(...); };  // (in, tangents of in) -> tangents of out
//   kepler.vjp = [] { return recorded_callee(...); };  // (in, adjoints of out) -> adjoints of in
//
// Make one callee and use it for every call: calls are equal, and shared, if callee and arguments are the same.
// tests/examples/kernel_call.cpp is the complete program.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <dyntape/autodiff/op.h>
#include <dyntape/autodiff/pattern.h>

namespace dyntape {

struct Function;

struct Callee {
  std::string name;  // a C identifier
  std::size_t n_in = 0, n_out = 0;

  // Either a recorded function of n_in variables without parameters, ...
  std::shared_ptr<const Function> recorded;

  // ... or a kernel.  `evaluate` and `c_body` are the same arithmetic in the same order; the body is what
  // stands between the braces of `static void name(const double* in, double* out)`.
  std::function<void(const double* in, double* out)> evaluate;
  std::string c_body;
  // The same over arrays of `reals`, several lanes at once; empty: c_body runs lane by lane.
  std::string c_body_of_lanes;
  // What one call takes, by kind; of a recorded function it is counted.
  std::vector<OperationCount> operations;
  // The same kernel with products fused into sums (fma), for the profile fast; empty: there is nothing to fuse.
  std::function<std::shared_ptr<const Callee>()> fused;
  // The kernel once more as a recorded function, made when number types other than double ask for it.
  std::function<std::shared_ptr<const Function>()> unrolled;

  // A recorded function that stands in for what derivation would find: derive() gives its call back as the
  // statements of the function, which share with everything around, once the derivatives below are taken.
  bool dissolves = false;

  // Derivative callees, made when a derivation meets the call; they may call this kernel again.  A kernel
  // without them throws when it is differentiated.
  std::function<std::shared_ptr<const Callee>()> jvp;  // n_in + n_in -> n_out
  std::function<std::shared_ptr<const Callee>()> vjp;  // n_in + n_out -> n_in

  // Which outputs depend on which inputs (n_out x n_in); with zero rows: all on all.
  Pattern pattern;

  // The derivative callees made so far, while some graph holds them.
  mutable std::weak_ptr<const Callee> jvp_made, vjp_made;
};

// A recorded function as a callee.  Throws ArgumentError if it has parameters, weights or guards.
std::shared_ptr<const Callee> recorded_callee(const Function& function);

// The same, dissolving in the code around its calls, with derivatives that the caller knows better than
// derivation would find them (none: as derivation finds them, dissolving as well).
//   jvp, vjp   recorded callees of (in, tangents of in) and of (in, adjoints of out)
using CalleeMaker = std::function<std::shared_ptr<const Callee>()>;
std::shared_ptr<const Callee> dissolving_callee(const Function& function, CalleeMaker jvp = {},
                                                CalleeMaker vjp = {});

// Operations of one call, those of callees of its own included.
std::vector<OperationCount> count_operations(const Callee& callee);

// The derivative callees of a callee, made once for as long as some graph holds them; ArgumentError if a
// kernel gives none.
std::shared_ptr<const Callee> jvp_callee(const std::shared_ptr<const Callee>& callee);
std::shared_ptr<const Callee> vjp_callee(const std::shared_ptr<const Callee>& callee);

}  // namespace dyntape
