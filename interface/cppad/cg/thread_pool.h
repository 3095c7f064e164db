// SPDX-License-Identifier: BSD-3-Clause
//
// CppADCodeGen's pool of threads (<cppad/cg/model/threadpool/pthread_pool.h>), over the threads of the process.
// For programs that call it themselves: models run in the thread of their caller.
//
//   cppadcg_thpool_add_job(job, argument, nullptr, nullptr);      job(argument)
//   cppadcg_thpool_wait();                                        runs the jobs that were added, in parallel
//
// Schedules are stored and have no effect; a disabled pool runs a job when it is added.
#pragma once

#include <algorithm>
#include <chrono>
#include <mutex>
#include <utility>
#include <vector>

#include <dyntape/codegen/run/threads.h>

struct Array {
  void* data;
  unsigned long size;
  int sparse;
  const unsigned long* idx;
  unsigned long nnz;
};
struct LangCAtomicFun {
  void* libModel;
  int (*forward)(void* libModel, int atomicIndex, int q, int p, const Array tx[], Array* ty);
  int (*reverse)(void* libModel, int atomicIndex, int p, const Array tx[], Array* px, const Array py[]);
};

enum ScheduleStrategy { SCHED_STATIC = 1, SCHED_DYNAMIC = 2, SCHED_GUIDED = 3 };
enum ElapsedTimeReference { ELAPSED_TIME_AVG, ELAPSED_TIME_MIN };
using cppadcg_thpool_function_type = void (*)(void*);

namespace CppAD::inline dyntape_names::cg {
struct PoolJob {
  cppadcg_thpool_function_type function;
  void* argument;
  float* elapsed;  // seconds; or null
  void operator()() const {
    const auto start = std::chrono::steady_clock::now();
    function(argument);
    if (elapsed) *elapsed = std::chrono::duration<float>(std::chrono::steady_clock::now() - start).count();
  }
};
struct PoolState {
  int threads = int(dyntape::codegen::thread_count()), verbose = 0, disabled = 0;
  ScheduleStrategy strategy = SCHED_DYNAMIC;
  float guided_work = 1;
  unsigned measurements = 10;
  ElapsedTimeReference reference = ELAPSED_TIME_AVG;
  std::mutex mutex;
  std::vector<PoolJob> jobs;
};
inline PoolState& pool_state() {
  static PoolState state;
  return state;
}
}  // namespace CppAD::inline dyntape_names::cg

#define DYNTAPE_POOL_SETTING(type, get, set, member)                 \
  inline type get() { return type(CppAD::cg::pool_state().member); } \
  inline void set(type value) { CppAD::cg::pool_state().member = value; }
DYNTAPE_POOL_SETTING(int, cppadcg_thpool_get_threads, cppadcg_thpool_set_threads, threads)
DYNTAPE_POOL_SETTING(int, cppadcg_thpool_is_verbose, cppadcg_thpool_set_verbose, verbose)
DYNTAPE_POOL_SETTING(int, cppadcg_thpool_is_disabled, cppadcg_thpool_set_disabled, disabled)
DYNTAPE_POOL_SETTING(ScheduleStrategy, cppadcg_thpool_get_scheduler_strategy,
                     cppadcg_thpool_set_scheduler_strategy, strategy)
DYNTAPE_POOL_SETTING(float, cppadcg_thpool_get_guided_maxgroupwork, cppadcg_thpool_set_guided_maxgroupwork,
                     guided_work)
DYNTAPE_POOL_SETTING(unsigned, cppadcg_thpool_get_n_time_meas, cppadcg_thpool_set_n_time_meas, measurements)
DYNTAPE_POOL_SETTING(ElapsedTimeReference, cppadcg_thpool_get_time_meas_ref, cppadcg_thpool_set_time_meas_ref,
                     reference)
#undef DYNTAPE_POOL_SETTING

inline void cppadcg_thpool_prepare() {}
inline void cppadcg_thpool_add_job(cppadcg_thpool_function_type function, void* argument,
                                   const float* /*expected seconds*/, float* elapsed) {
  auto& pool = CppAD::cg::pool_state();
  const CppAD::cg::PoolJob job{function, argument, elapsed};
  if (pool.disabled) return job();
  const std::scoped_lock lock(pool.mutex);
  pool.jobs.push_back(job);
}
// In the order of `order`, which may be null.
inline void cppadcg_thpool_add_jobs(cppadcg_thpool_function_type functions[], void* arguments[],
                                    const float[] /*expected seconds*/, float elapsed[], const int order[],
                                    int[] /*threads*/, int n, int /*last times changed*/) {
  for (int k = 0; k < n; ++k) {
    const int i = order ? order[k] : k;
    cppadcg_thpool_add_job(functions[i], arguments[i], nullptr, elapsed ? elapsed + i : nullptr);
  }
}
inline void cppadcg_thpool_wait() {
  auto& pool = CppAD::cg::pool_state();
  std::vector<CppAD::cg::PoolJob> jobs;
  {
    const std::scoped_lock lock(pool.mutex);
    jobs.swap(pool.jobs);
  }
  dyntape::codegen::run_tasks(jobs.size(), [&](std::size_t k) { jobs[k](); });
}
// Adds a measurement to the reference times, and sorts the jobs by them, the longest first.
inline void cppadcg_thpool_update_order(float reference[], unsigned earlier, const float elapsed[],
                                        int order[], int n) {
  if (!reference || !elapsed || !order) return;
  const bool average = CppAD::cg::pool_state().reference == ELAPSED_TIME_AVG;
  for (int i = 0; i < n; ++i) {
    if (average)
      reference[i] = (reference[i] * float(earlier) + elapsed[i]) / float(earlier + 1);
    else
      reference[i] = earlier == 0 ? elapsed[i] : std::min(reference[i], elapsed[i]);
    order[i] = i;
  }
  std::stable_sort(order, order + n, [&](int a, int b) { return reference[a] > reference[b]; });
}
inline void cppadcg_thpool_shutdown() {}
