// SPDX-License-Identifier: BSD-3-Clause
//
// What the threads of one process share, locks above all.
//
//   struct Known { std::mutex mutex; std::set<std::string> said; };
//   of_this_process<Known>().mutex
//
// A forked child has none of its parent's threads, and their locks as they happened to be: it leaves what they shared
// where it is, and begins anew.  Nothing is ever destroyed: static objects may still need it.
#pragma once

#include <pthread.h>

#include <atomic>
#include <memory>

namespace dyntape::codegen {

// One T for each type, made when it is first needed.
template <class T>
T& of_this_process() {
  static std::atomic<T*> current = nullptr;
  [[maybe_unused]] static const int forgotten = pthread_atfork(nullptr, nullptr, [] { current = nullptr; });
  T* found = current;
  if (found) return *found;
  auto made = std::make_unique<T>();
  return current.compare_exchange_strong(found, made.get()) ? *made.release() : *found;
}

}  // namespace dyntape::codegen
