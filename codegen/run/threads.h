// SPDX-License-Identifier: BSD-3-Clause
//
// The thread pool of the process, created at its first use.  Use it to run independent tasks in parallel.
//
//   run_tasks(4, [&](std::size_t k) { ... });       task 0 to 3, each once; the calling thread takes part
//
// The pool has thread_count() - 1 threads besides the callers.
//
// - A call from within a task, or during the tasks of another thread, runs all its tasks in the calling thread.
// - If the system provides fewer threads, or none, the available threads do the work.
// - A forked child makes its own pool at its first use.
#pragma once

#include <cstddef>
#include <functional>

namespace dyntape::codegen {

// $DYNTAPE_THREADS, or the processor's threads.  ArgumentError if the variable is not a number from 1 to 1024.
unsigned thread_count();

// Returns when all tasks are done; rethrows the exception of the first task that failed.
void run_tasks(std::size_t n, const std::function<void(std::size_t)>& task);

}  // namespace dyntape::codegen
