// SPDX-License-Identifier: BSD-3-Clause
//
// Workspaces for `const` calls from any number of threads, without locks.  Internal.
//
//   auto room = pool.take([&] { return std::make_unique<Room>(...); });   // returned at the end of the scope
//   room->y[0] = ...;
//
// A thread gets the same workspace again unless another thread has taken it in the meantime.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>

namespace dyntape::detail {

template <class Room>
class WorkspacePool {
 public:
  WorkspacePool() = default;
  WorkspacePool(const WorkspacePool&) = delete;
  WorkspacePool& operator=(const WorkspacePool&) = delete;
  ~WorkspacePool() {
    for (auto& slot : slots_) delete slot.load();
  }

  class Lease {
   public:
    Lease(WorkspacePool& pool, std::size_t start, std::unique_ptr<Room> room)
        : pool_(pool), start_(start), room_(std::move(room)) {}
    Lease(const Lease&) = delete;
    Lease& operator=(const Lease&) = delete;
    ~Lease() { pool_.give_back(start_, std::move(room_)); }
    Room* operator->() const { return room_.get(); }
    Room& operator*() const { return *room_; }

   private:
    WorkspacePool& pool_;
    std::size_t start_;
    std::unique_ptr<Room> room_;
  };

  // A free workspace, or a new one from make().
  template <class Make>
  Lease take(Make&& make) {
    const std::size_t start = place_of_thread();
    for (std::size_t i = 0; i < kSlots; ++i) {
      auto& slot = slots_[(start + i) % kSlots];
      if (!slot.load(std::memory_order_relaxed)) continue;
      if (Room* room = slot.exchange(nullptr, std::memory_order_acquire)) {
        return Lease(*this, start, std::unique_ptr<Room>(room));
      }
    }
    return Lease(*this, start, make());
  }

 private:
  static constexpr std::size_t kSlots = 16;

  static std::size_t place_of_thread() {
    static std::atomic<std::size_t> threads{0};
    static thread_local const std::size_t place = threads++ % kSlots;
    return place;
  }

  // A workspace without a free slot is deleted: more threads than slots only cost an allocation.
  void give_back(std::size_t start, std::unique_ptr<Room> room) {
    for (std::size_t i = 0; room && i < kSlots; ++i) {
      Room* empty = nullptr;
      auto& slot = slots_[(start + i) % kSlots];
      if (slot.compare_exchange_strong(empty, room.get(), std::memory_order_release)) room.release();
    }
  }

  std::array<std::atomic<Room*>, kSlots> slots_{};
};

}  // namespace dyntape::detail
