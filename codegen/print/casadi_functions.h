// SPDX-License-Identifier: BSD-3-Clause
//
// The functions that CasADi looks up in external code, and the layout of their arguments.
//
//   CasadiBlocks blocks;
//   blocks.inputs = {{"q", 7}, {"v", 7}, {"tau", 7}}, blocks.outputs = {{"ddq", 7}};
//   for (const CasadiFunction& f : casadi_functions(blocks, Order::kSecond, jacobian, hessian)) ...
//
//   f            q, v, tau -> ddq                                            values
//   jac_f        q, v, tau, out_ddq -> jac_ddq_q, jac_ddq_v, jac_ddq_tau     first order: one sparse block each
//   adj1_f       q, v, tau, out_ddq, adj_ddq -> adj_q, adj_v, adj_tau        first order: of a weighted sum of results
//   jac_adj1_f   the arguments of adj1_f, its results -> jac_adj_q_q, ...    second order: exact Hessians
//
// Matrices are row-major in a recorded function and column-major in CasADi.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <dyntape/codegen/print/source.h>

namespace dyntape::codegen {

struct CasadiBlock {
  std::string name;  // an identifier of C
  std::size_t rows = 1, cols = 1;
  std::size_t size() const { return rows * cols; }
};

// All variables and all results of a function, in their order.
struct CasadiBlocks {
  std::vector<CasadiBlock> inputs, outputs;
};

struct CasadiArgument {
  // kNothing: an unused input, or a result without non-zeros.
  enum Array { kNothing, kX, kWeights, kY, kJacobian, kHessian, kGradient };
  std::string name;
  std::vector<long long>
      sparsity;  // rows, columns, 1 for a dense one, else compressed columns and their rows
  Array array = kNothing;
  std::vector<std::uint32_t> places;  // index in the array, for each non-zero
};

struct CasadiFunction {
  std::string prefix;  // "jac_" of jac_f
  Order order = Order::kValue;
  std::vector<CasadiArgument> in, out;
};

// The functions up to an order.  ArgumentError for a function with parameters or weights (all_as_variables()), and
// for blocks whose sizes do not add up to the function's.
std::vector<CasadiFunction> casadi_functions(const Function& function, const CasadiBlocks& blocks,
                                             Order order, const Pattern& jacobian, const Pattern& hessian);

}  // namespace dyntape::codegen
