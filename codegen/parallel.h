// SPDX-License-Identifier: BSD-3-Clause
//
// Many points in several threads.
//
//   auto workspaces = make_workspaces(f);                           // one a thread
//   check(run_parallel(f, Order::kFirst, points, workspaces));      // CompiledFunction::run, and the same bits
//
// The points are cut into as many parts as there are workspaces, at multiples of f.lane_width(); the parts run on
// the threads of the process (threads.h), of which there are $DYNTAPE_THREADS or what the processor has.  A point's
// result does not depend on the number of parts or threads.  Nothing is allocated.
#pragma once

#include <vector>

#include <dyntape/codegen/compiled_function.h>

namespace dyntape {

// `threads` of 0: thread_count().
std::vector<CompiledFunction::Workspace> make_workspaces(const CompiledFunction& function,
                                                         unsigned threads = 0);

// The violation of the first point that has one.  ArgumentError: no workspace, or one of another function.
[[nodiscard]] Violation run_parallel(const CompiledFunction& function, Order order, const Points& points,
                                     std::vector<CompiledFunction::Workspace>& workspaces);

}  // namespace dyntape
