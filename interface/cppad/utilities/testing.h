// SPDX-License-Identifier: BSD-3-Clause
//
// CppAD's functions for programs that measure speed and report tests.
//
//   double seconds = time_test(test, 0.1);                 // void test(size_t repeat): seconds of one repetition
//   vector<size_t> rates = speed_test(test, sizes, 0.1);   // void test(size_t size, size_t repeat): repetitions a second, of each size
//   test_boolofvoid run("group", 20);                      // bool test(): run(test, "name"), run.summary(memory_leak() == false)
#pragma once

#include <cstddef>
#include <iostream>
#include <string>

#include <dyntape/interface/cppad/utilities/thread_alloc.h>
#include <dyntape/interface/cppad/vector.h>

namespace CppAD::inline dyntape_names {

// Seconds since the first call.
double elapsed_seconds();

namespace detail {
// Repetitions are doubled until they take time_min seconds together: seconds of one.
template <class Repeat>
double seconds_of(Repeat&& repeat, double time_min, std::size_t& count) {
  double seconds = 0;
  for (count = 1;; count *= 2) {
    const double start = elapsed_seconds();
    repeat(count);
    seconds = elapsed_seconds() - start;
    if (seconds >= time_min) break;
  }
  return seconds / double(count);
}
}  // namespace detail

template <class Test>
double time_test(Test test, double time_min) {
  std::size_t count;
  return detail::seconds_of(test, time_min, count);
}
template <class Test>
double time_test(Test test, double time_min, std::size_t size) {
  std::size_t count;
  return detail::seconds_of([&](std::size_t n) { test(size, n); }, time_min, count);
}
template <class Test>
double time_test(Test test, double time_min, std::size_t size, std::size_t& repeat_out) {
  return detail::seconds_of([&](std::size_t n) { test(size, n); }, time_min, repeat_out);
}

template <class SizeVector>
SizeVector speed_test(void (*test)(std::size_t size, std::size_t repeat), const SizeVector& sizes,
                      double time_min) {
  SizeVector rates(sizes.size());
  for (std::size_t i = 0; i < std::size_t(sizes.size()); ++i)
    rates[i] = static_cast<std::size_t>(0.5 + 1 / time_test(test, time_min, sizes[i]));
  return rates;
}

// Prints the rates of sizes first, first + inc, ... to last; the test returns its name.
inline void SpeedTest(std::string (*test)(std::size_t size, std::size_t repeat), std::size_t first, int inc,
                      std::size_t last) {
  for (auto size = long(first); inc > 0 ? size <= long(last) : size >= long(last); size += inc) {
    std::string name;
    std::size_t count;
    const double seconds =
        detail::seconds_of([&](std::size_t n) { name = test(std::size_t(size), n); }, 1, count);
    if (size == long(first)) std::cout << name << "\n";
    std::cout << "size = " << size << " rate = " << std::size_t(0.5 + 1 / seconds) << std::endl;
    if (inc == 0) break;
  }
}

class test_boolofvoid {
 public:
  test_boolofvoid(const std::string& group, std::size_t width) : width_(width) {
    std::cout << "Begin test group " << group << std::endl;
  }
  // Runs a test and prints a line; whether it was ok.
  bool operator()(bool test(), const std::string& name) { return report(test(), name); }
  std::size_t n_ok() const { return n_ok_; }
  std::size_t n_error() const { return n_error_; }
  // Prints the counts; whether all tests were ok, and memory is.
  bool summary(bool memory_ok) {
    report(memory_ok, "memory_leak");
    if (n_error_ == 0) std::cout << "All " << n_ok_ << " tests passed." << std::endl;
    if (n_error_ != 0) std::cout << n_error_ << " tests failed." << std::endl;
    return n_error_ == 0;
  }

 private:
  bool report(bool ok, const std::string& name) {
    std::cout << name << std::string(name.size() < width_ ? width_ - name.size() : 1, ' ')
              << (ok ? "OK" : "Error") << std::endl;
    ++(ok ? n_ok_ : n_error_);
    return ok;
  }
  std::size_t width_, n_ok_ = 0, n_error_ = 0;
};

// Whether more than add_static bytes of thread_alloc are in use by this thread; available ones are freed.
inline bool memory_leak(std::size_t add_static = 0) {
  thread_alloc::free_all();
  return thread_alloc::inuse(0) > add_static;
}

}  // namespace CppAD::inline dyntape_names
