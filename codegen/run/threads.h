// SPDX-License-Identifier: BSD-3-Clause
//
// The threads of the process: made once, when they are first needed.
//
//   run_tasks(4, [&](std::size_t k) { ... });       task 0 to 3, each once, the calling thread helps
//
// The pool has thread_count() - 1 threads besides those that call: a call from within a task, or while another
// thread's tasks are running, does all its tasks itself.  Where the system gives fewer threads, or none, those there are
// do the work.  A forked child makes a pool of its own when it needs one.
#pragma once

#include <cstddef>
#include <functional>

namespace dyntape::codegen {

// $DYNTAPE_THREADS, else what the processor has; ArgumentError if the variable is not a number from 1 to 1024.
unsigned thread_count();

// Returns when all are done; throws what the first that failed threw.
void run_tasks(std::size_t n, const std::function<void(std::size_t)>& task);

}  // namespace dyntape::codegen
