// SPDX-License-Identifier: BSD-3-Clause
//
// CppAD's memory for threads: counts blocks by thread, and keeps freed blocks for later requests if a program asks
// for it.
//
//   thread_alloc::parallel_setup(4, in_parallel, thread_number);     // recording does not need this call
//   size_t length;
//   double* work = thread_alloc::create_array<double>(100, length);  // length >= 100 elements, constructed
//   thread_alloc::delete_array(work);
//
// The rest of dyntape does not use this memory.
#pragma once

#include <cstddef>
#include <new>

#ifndef CPPAD_MAX_NUM_THREADS
#define CPPAD_MAX_NUM_THREADS 48
#endif

namespace CppAD::inline dyntape_names {

class thread_alloc {
 public:
  // How many threads count, whether they run, and which one asks; (1, null, null) as at the start.
  static void parallel_setup(std::size_t threads, bool (*in_parallel)(), std::size_t (*thread_num)());
  static std::size_t num_threads();
  static bool in_parallel();
  static std::size_t thread_num();

  // A block of at least min_bytes; cap_bytes: how large it is.  It belongs to the thread that asks, whoever returns it.
  static void* get_memory(std::size_t min_bytes, std::size_t& cap_bytes);
  static void return_memory(void* block);
  // Whether returned blocks are kept as available.
  static void hold_memory(bool yes);
  static void free_available(std::size_t thread);
  // Frees what is available; returns whether nothing is in use.
  static bool free_all();
  // Bytes of the thread.
  static std::size_t inuse(std::size_t thread);
  static std::size_t available(std::size_t thread);

  // An array of at least size_min elements, default constructed; size_out: how many.
  template <class Type>
  static Type* create_array(std::size_t size_min, std::size_t& size_out) {
    std::size_t bytes;
    Type* const array = static_cast<Type*>(get_memory(size_min * sizeof(Type), bytes));
    size_out = bytes / sizeof(Type);
    length_of(array) = size_out;
    for (std::size_t i = 0; i < size_out; ++i) new (array + i) Type();
    return array;
  }
  template <class Type>
  static void delete_array(Type* array) {
    for (std::size_t i = length_of(array); i-- > 0;) array[i].~Type();
    return_memory(array);
  }

 private:
  static std::size_t& length_of(void* block);
};

template <class Base>
void parallel_ad() {}

}  // namespace CppAD::inline dyntape_names
