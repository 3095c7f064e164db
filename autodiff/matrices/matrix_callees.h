// SPDX-License-Identifier: BSD-3-Clause
//
// Functions of matrices as callees (callee.h) that dissolve and have given derivatives.
//
//   const MatrixFunction f{"inverse_3x3", 9, 9,
//                          [](FlatReader in) { return flat({inverse(in.next(3, 3))}); },       // A -> A^-1
//                          [](FlatReader in) { ... in.next(3, 3) ... in.next(3, 3) ... },      // A, dA -> d(A^-1)
//                          [](FlatReader in) { ... }};                                         // A, X' -> A'
//   const VectorXad X = call(callee_of(f), flat({A}));
//
// Matrices lie one after the other, by columns.  A name has one callee while any graph uses it, so that equal calls
// are one call.
#pragma once

#include <functional>
#include <initializer_list>
#include <memory>
#include <string>

#include <dyntape/autodiff/graph/callee.h>
#include <dyntape/autodiff/record/record.h>

namespace dyntape::detail {

VectorXad flat(std::initializer_list<MatrixXad> matrices);

// Reads the matrices of flat() back.
class FlatReader {
 public:
  explicit FlatReader(const VectorXad& all) : all_(all) {}
  MatrixXad next(Eigen::Index rows, Eigen::Index cols) {
    at_ += rows * cols;
    return all_.segment(at_ - rows * cols, rows * cols).reshaped(rows, cols);
  }

 private:
  const VectorXad& all_;
  Eigen::Index at_ = 0;
};

struct MatrixFunction {
  using Body = std::function<VectorXad(FlatReader in)>;
  std::string name;
  Eigen::Index n_in, n_out;
  Body value;
  Body jvp;  // of arguments and tangents
  Body vjp;  // of arguments and adjoints
};

std::shared_ptr<const Callee> callee_of(const MatrixFunction& function);

// "solve_3x3_1"
std::string sized_name(const char* name, Eigen::Index m, Eigen::Index n, Eigen::Index k);

// The callee of this name.
std::shared_ptr<const Callee> made_once(const std::string& name, const CalleeMaker& make);

}  // namespace dyntape::detail
