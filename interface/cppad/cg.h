// SPDX-License-Identifier: BSD-3-Clause
//
// CppADCodeGen's names: libraries of models, compiled and loaded by the pipeline of this project.  Use this header
// to build a program that was written for CppADCodeGen.
//
//   using CG = CppAD::cg::CG<double>;
//   std::vector<CppAD::AD<CG>> x(2), y(1);
//   CppAD::Independent(x);
//   y[0] = x[0] / 2.0 + x[1] * x[1];
//   CppAD::ADFun<CG> f(x, y);
//
//   CppAD::cg::ModelCSourceGen<double> source(f, "model");
//   source.setCreateSparseJacobian(true);
//   CppAD::cg::ModelLibraryCSourceGen<double> sources(source);
//   CppAD::cg::DynamicModelLibraryProcessor<double> processor(sources);
//   CppAD::cg::GccCompiler<double> compiler;
//   auto library = processor.createDynamicLibrary(compiler);      // from the cache, if it is there
//   auto model = library->model("model");
//   model->SparseJacobian(point, values, rows, cols);
//
// CG<Base> is AD<Base>: CppADCodeGen records a second time, dyntape has the graph already.  One kernel computes
// value, Jacobian and Hessian together.  Branches of the recording are guards; an evaluation that leaves a branch
// throws GuardViolation.  Several threads may use a model at the same time.
#pragma once

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/cppad/cg/atomic_fun.h>
#include <dyntape/interface/cppad/cg/code_handler.h>
#include <dyntape/interface/cppad/cg/library_gen.h>
#include <dyntape/interface/cppad/cg/model.h>
#include <dyntape/interface/cppad/cppad.h>

namespace CppAD::inline dyntape_names::cg {
using CGException = dyntape::Error;  // base class of all errors
}  // namespace CppAD::inline dyntape_names::cg
