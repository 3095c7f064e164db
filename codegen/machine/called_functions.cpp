// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/machine/called_functions.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <utility>

#include <dyntape/autodiff/evaluate/interpret.h>

namespace dyntape::codegen {
namespace {

// Of this thread's evaluation: exceptions do not go through machine code.
thread_local std::exception_ptr thrown;

// Written by hand: one lane after the other, where it does not say otherwise.
template <int lanes>
void run_by_hand(const Callee& callee, const double* in, double* out, double* work) {
  if (callee.kernel()->evaluate_lanes) return callee.kernel()->evaluate_lanes(in, out, lanes);
  double* const result = work + callee.n_in;
  for (int l = 0; l < lanes; ++l) {
    for (std::size_t i = 0; i < callee.n_in; ++i) work[i] = in[i * lanes + l];
    callee.kernel()->evaluate(work, result);
    for (std::size_t i = 0; i < callee.n_out; ++i) out[i * lanes + l] = result[i];
  }
}

template <int lanes>
void call_by_hand(const void* of, const double* in, double* out, double* work) {
  const Callee& callee = *static_cast<const CalleeOfKernel*>(of)->callee;
  if (thrown) return void(std::fill_n(out, callee.n_out * lanes, std::nan("")));  // the evaluation has ended
  try {
    run_by_hand<lanes>(callee, in, out, work);
  } catch (...) {
    thrown = std::current_exception();
    std::fill_n(out, callee.n_out * lanes, std::nan(""));
  }
}

template <int lanes>
void call_recorded(const void* of, const double* in, double* out, double* work) {
  const CalleeOfKernel& called = *static_cast<const CalleeOfKernel*>(of);
  called.kernel->kernel.run(in, nullptr, nullptr, out, nullptr, nullptr, work, lanes, nullptr, nullptr);
}

template <int lanes>
CalleeFunction* callee_function(const CalleeOfKernel& called) {
  return called.kernel ? call_recorded<lanes> : call_by_hand<lanes>;
}

}  // namespace

CalleeFunction* callee_function(const CalleeOfKernel& called, int lanes) {
  switch (lanes) {
    case 1:
      return callee_function<1>(called);
    case 2:
      return callee_function<2>(called);
    case 4:
      return callee_function<4>(called);
    default:
      return callee_function<8>(called);
  }
}

std::size_t work_of(const CalleeOfKernel& called) {
  return called.kernel ? called.kernel->kernel.work : called.callee->n_in + called.callee->n_out;
}

void rethrow_thrown() {
  if (const std::exception_ptr what = std::exchange(thrown, nullptr)) std::rethrow_exception(what);
}

}  // namespace dyntape::codegen
