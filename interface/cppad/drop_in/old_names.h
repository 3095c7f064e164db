// SPDX-License-Identifier: BSD-3-Clause
//
// Deprecated names of CppAD that programs still use, and the class of sets that its example of atomic_four uses.
//
//   omp_alloc::set_max_num_threads(2);                        // thread_alloc with the threads of OpenMP
//   double* p = CPPAD_TRACK_NEW_VEC(5, p);                    // arrays of thread_alloc that are counted
//   AD<zdouble> x;                                            // zdouble is double: from_cppad.md
#pragma once

#ifdef _OPENMP
#include <omp.h>
#endif

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <iterator>
#include <set>
#include <vector>

#include <dyntape/interface/cppad/utilities/thread_alloc.h>

namespace CppAD::inline dyntape_names {

using zdouble = double;

class omp_alloc : public thread_alloc {
 public:
  // Returned memory is kept if there are several threads.
  static void set_max_num_threads(std::size_t number) {
#ifdef _OPENMP
    parallel_setup(
        number, [] { return omp_in_parallel() != 0; }, [] { return std::size_t(omp_get_thread_num()); });
#else
    parallel_setup(
        number, [] { return false; }, [] { return std::size_t(0); });
#endif
    hold_memory(number > 1);
  }
  static void max_num_threads(std::size_t number) { set_max_num_threads(number); }
  static std::size_t get_max_num_threads() { return num_threads(); }
  static std::size_t get_thread_num() { return thread_num(); }
};

inline std::atomic<std::size_t> tracked_arrays = 0;

template <class Type>
Type* TrackNewVec(const char*, int, std::size_t length, Type*) {
  ++tracked_arrays;
  return thread_alloc::create_array<Type>(length, length);
}
template <class Type>
void TrackDelVec(const char*, int, Type* array) {
  thread_alloc::delete_array(array);
  --tracked_arrays;
}
// A longer array with the first elements of another one, which is deleted.
template <class Type>
Type* TrackExtend(const char* file, int line, std::size_t length, std::size_t n_copy, Type* array) {
  Type* const longer = TrackNewVec(file, line, length, array);
  if (n_copy > 0) std::copy_n(array, n_copy, longer);
  if (array) TrackDelVec(file, line, array);
  return longer;
}
inline std::size_t TrackCount(const char*, int) { return tracked_arrays; }

namespace local::sparse {

// Sets of integers below `end`; an iterator that is at the end of its set returns `end`.
class list_setvec {
 public:
  void resize(std::size_t n_set, std::size_t end) { sets_.assign(n_set, {}), end_ = end; }
  std::size_t n_set() const { return sets_.size(); }
  std::size_t end() const { return end_; }
  void add_element(std::size_t i, std::size_t element) { sets_[i].insert(element); }
  bool is_element(std::size_t i, std::size_t element) const { return sets_[i].count(element) > 0; }

  class const_iterator {
   public:
    const_iterator(const list_setvec& sets, std::size_t i)
        : set_(&sets.sets_[i]), at_(set_->begin()), end_(sets.end_) {}
    std::size_t operator*() const { return at_ == set_->end() ? end_ : *at_; }
    const_iterator& operator++() {
      if (at_ != set_->end()) ++at_;
      return *this;
    }

   private:
    const std::set<std::size_t>* set_;
    std::set<std::size_t>::const_iterator at_;
    std::size_t end_;
  };

 private:
  std::vector<std::set<std::size_t>> sets_;
  std::size_t end_ = 0;
};

}  // namespace local::sparse

}  // namespace CppAD::inline dyntape_names

#define CPPAD_TRACK_NEW_VEC(length, array) ::CppAD::TrackNewVec(__FILE__, __LINE__, length, array)
#define CPPAD_TRACK_DEL_VEC(array) ::CppAD::TrackDelVec(__FILE__, __LINE__, array)
#define CPPAD_TRACK_EXTEND(length, n_copy, array) \
  ::CppAD::TrackExtend(__FILE__, __LINE__, length, n_copy, array)
#define CPPAD_TRACK_COUNT() ::CppAD::TrackCount(__FILE__, __LINE__)
