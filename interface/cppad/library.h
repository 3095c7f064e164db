// SPDX-License-Identifier: BSD-3-Clause
//
// Turns an ADFun<double> into a function of this project: generated, compiled, cached, evaluated in lanes and
// threads.  Use it for speed, or to evaluate one function in several threads.
//
//   CodegenOptions options;
//   options.order = Order::kSecond;
//   const CompiledFunction g = to_library(f, options);              // dynamic parameters become its p
//   g.evaluate(Order::kFirst, x, p).jacobian;                       // the non-zeros; see compiled_function.h
//
// Branches that the recording took are guards: an evaluation that leaves a branch throws GuardViolation with the
// place of the comparison.  Functions with atomic or discrete functions of the user are interpreted, because these
// have no C text.
#pragma once

#include <dyntape/codegen/compiled_function.h>
#include <dyntape/interface/cppad/ad_fun.h>

namespace CppAD::inline dyntape_names {

// The recorded function, for generate_source() (codegen/pipeline.h) and other calls that take a Function.
dyntape::Function to_function(const ADFun<double>& f);
dyntape::CompiledFunction to_library(const ADFun<double>& f, dyntape::CodegenOptions options = {});

}  // namespace CppAD::inline dyntape_names
