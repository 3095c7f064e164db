// SPDX-License-Identifier: BSD-3-Clause
// A model of a function in a dynamic library of its own.
#pragma once

#include <functional>
#include <memory>

#include <dyntape/interface/cppad/cg.h>

namespace cg_tests {

using CGD = CppAD::cg::CG<double>;
using Source = CppAD::cg::ModelCSourceGen<double>;

inline void everything(Source& source) {
  source.setCreateJacobian(true), source.setCreateHessian(true);
  source.setCreateSparseJacobian(true), source.setCreateSparseHessian(true);
  source.setCreateForwardOne(true), source.setCreateReverseOne(true), source.setCreateReverseTwo(true);
}

struct Library {
  explicit Library(std::unique_ptr<CppAD::ADFun<CGD>> function,
                   const std::function<void(Source&)>& choose = everything)
      : f(std::move(function)), source(*f, "model") {
    choose(source);
    CppAD::cg::ModelLibraryCSourceGen<double> sources(source);
    CppAD::cg::DynamicModelLibraryProcessor<double> processor(sources);
    CppAD::cg::GccCompiler<double> compiler;
    library = processor.createDynamicLibrary(compiler);
    model = library->model("model");
  }
  std::unique_ptr<CppAD::ADFun<CGD>> f;
  Source source;
  std::unique_ptr<CppAD::cg::DynamicLib<double>> library;
  std::unique_ptr<CppAD::cg::GenericModel<double>> model;
};

}  // namespace cg_tests
