// SPDX-License-Identifier: BSD-3-Clause
//
// CppAD's names over the graph of this project, in namespace CppAD (dyntape::cppad is the same).  Use this header to
// build a program that was written for CppAD: include it instead of CppAD's headers.  To keep `#include
// <cppad/cppad.hpp>`, use the drop-in folder (drop_in/drop_in.h).
//
//   #include <dyntape/interface/cppad/cppad.h>
//
//   std::vector<CppAD::AD<double>> ax{3.0}, ay(1);
//   CppAD::Independent(ax);
//   ay[0] = pow(ax[0], 2.0) * sin(ax[0]);
//   CppAD::ADFun<double> f(ax, ay);
//   std::vector<double> J = f.Jacobian(std::vector<double>{3.0});
//   CompiledFunction fast = CppAD::to_library(f);                     // library.h: compiled, cached, thread-safe
//
// An AD<Base> is a node of the graph in autodiff/graph: there is no second graph and no second table of operators.
// Taylor series of any order follow from the rows of ops.def.  docs/from_cppad.md lists the differences from CppAD.
#pragma once

#if __cplusplus < 202002L
#error "dyntape's headers are C++20: compile with -std=c++20, or link the CMake target, which says so"
#endif

#include <dyntape/interface/cppad/ad.h>
#include <dyntape/interface/cppad/ad_fun.h>
#include <dyntape/interface/cppad/conditions.h>
#include <dyntape/interface/cppad/eigen.h>
#include <dyntape/interface/cppad/nodes/atomic.h>
#include <dyntape/interface/cppad/nodes/atomic_base.h>
#include <dyntape/interface/cppad/nodes/checkpoint.h>
#include <dyntape/interface/cppad/nodes/vec_ad.h>
#include <dyntape/interface/cppad/sparse.h>
#include <dyntape/interface/cppad/utilities/checks.h>
#include <dyntape/interface/cppad/utilities/error_handler.h>
#include <dyntape/interface/cppad/utilities/gear.h>
#include <dyntape/interface/cppad/utilities/lu.h>
#include <dyntape/interface/cppad/utilities/near_equal.h>
#include <dyntape/interface/cppad/utilities/numeric.h>
#include <dyntape/interface/cppad/utilities/ode.h>
#include <dyntape/interface/cppad/utilities/optimal_value.h>
#include <dyntape/interface/cppad/utilities/testing.h>
#include <dyntape/interface/cppad/utilities/thread_alloc.h>
#include <dyntape/interface/cppad/vector.h>
