// SPDX-License-Identifier: BSD-3-Clause
//
// Times of the compilation of a function, or sums for several.
#pragma once

namespace dyntape {

// Seconds of each stage; zero if it was not needed.
struct Timings {
  double record = 0;  // set by callers that record: Collocation, AdFunction
  double hash = 0;    // the cache key: content hash and the compiler's identity
  double derive = 0, schedule = 0, print = 0, compile = 0;
  double load = 0;         // check, load, query
  bool cache_hit = false;  // nothing was derived, printed or compiled; for one function

  Timings& operator+=(const Timings& other) {
    for (double Timings::*stage : {&Timings::record, &Timings::hash, &Timings::derive, &Timings::schedule,
                                   &Timings::print, &Timings::compile, &Timings::load})
      this->*stage += other.*stage;
    return *this;
  }
  double total() const { return record + hash + derive + schedule + print + compile + load; }
};

}  // namespace dyntape
