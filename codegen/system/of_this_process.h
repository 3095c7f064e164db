// SPDX-License-Identifier: BSD-3-Clause
//
// Objects that the threads of one process share, mainly locks.
//
//   struct Known { std::mutex mutex; std::set<std::string> said; };
//   of_this_process<Known>().mutex
//
// A forked child does not have its parent's threads, and a lock may be held at the fork.  Therefore the child does
// not touch the parent's objects and makes new ones.  Objects are never destroyed, because static objects may still
// use them.
#pragma once

#include <pthread.h>

#include <atomic>
#include <memory>

namespace dyntape::codegen {

// One T for each type, made at its first use.
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
