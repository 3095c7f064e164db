// SPDX-License-Identifier: BSD-3-Clause
//
// Random straight-line programs over every operator, run in any scalar: what the differential test feeds to
// all routes.
//
//   Random random(seed);
//   Program program = random_program(random);      // evaluable and differentiable at program.x, program.p
//   std::vector<double> y = run<double>(program, program.x, program.p);
//   Function f = recorded(program);
//
// The generator takes only what stays clear of poles and of jumps, with one exception: values that are not
// finite, or stand on a pole, are let through into the branches of selections that are not taken.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <dyntape/autodiff/graph/function.h>

#include "quad.h"
#include "random.h"

namespace dyntape::testing {

// Operand k is variable k, then parameter, then constant, then the result of an instruction.
struct Instruction {
  Op op;
  std::size_t a, b, c;
};

struct Program {
  std::vector<double> x, p;  // the point
  std::vector<double> constants;
  std::vector<Instruction> instructions;
  std::vector<std::size_t> outputs;

  std::size_t first_instruction() const { return x.size() + p.size() + constants.size(); }
};

Program random_program(Random& random, std::size_t instructions);

// All operands, in the order of their numbers, without any simplification.
template <class T>
std::vector<T> run_all(const Program& program, const std::vector<T>& x, const std::vector<T>& p) {
  std::vector<T> v(x);
  v.insert(v.end(), p.begin(), p.end());
  for (double c : program.constants) v.push_back(T(c));
  for (const Instruction& i : program.instructions) v.push_back(evaluate<T>(i.op, v[i.a], v[i.b], v[i.c]));
  return v;
}

template <class T>
std::vector<T> run(const Program& program, const std::vector<T>& x, const std::vector<T>& p) {
  const std::vector<T> v = run_all(program, x, p);
  std::vector<T> y;
  for (std::size_t k : program.outputs) y.push_back(v[k]);
  return y;
}

// Through record() and the overloads of AD, by name.
Function recorded(const Program& program);

// The instructions that the outputs need, one a line.
std::string text(const Program& program);

// A program on which `fails` still says so, with as few outputs and instructions as cutting one at a time
// gives.
Program shrunk(Program program, const std::function<bool(const Program&)>& fails);

}  // namespace dyntape::testing
