// SPDX-License-Identifier: BSD-3-Clause
//
// From a function of the CppAD layer to functions of the project: generated, compiled, cached, evaluated in lanes and threads.
//
//   CodegenOptions options;
//   options.order = Order::kSecond;
//   const CompiledFunction g = to_library(f, options);              // dynamic parameters are its p
//   g.evaluate(Order::kFirst, x, p).jacobian;                       // the non-zeros; compiled_function.h has the rest
//
// Branches that the recording took are guards: an evaluation that leaves one throws GuardViolation with the place of the comparison.
// Functions with atomic or discrete functions of the user are interpreted, for there is no C text of these.
#pragma once

#include <dyntape/codegen/compiled_function.h>
#include <dyntape/interface/cppad/ad_fun.h>

namespace CppAD::inline dyntape_names {

// The recorded function, for generate_source() (codegen/pipeline.h) and whatever else takes one.
dyntape::Function to_function(const ADFun<double>& f);
dyntape::CompiledFunction to_library(const ADFun<double>& f, dyntape::CodegenOptions options = {});

}  // namespace CppAD::inline dyntape_names
