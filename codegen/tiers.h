// SPDX-License-Identifier: BSD-3-Clause
//
// The tiers of a function; each serves until a better tier exists.  Copies of a CompiledFunction and their
// workspaces share them.  Internal.
//
//   auto [tiers, builder] = make_tiers(recorded, options);   tiered: back before a compiler has started
//   Place place(tiers);                                      where one thread evaluates
//   Place::Room& now = place.now();
//   now.kernels.run(order, points, now.room);                by the interpreter, and some day by compiled code
//
// A new tier replaces the old one between two evaluations of a place, by one pointer: evaluations never wait and
// never allocate.
#pragma once

#include <sys/types.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <dyntape/codegen/kernels.h>

namespace dyntape::codegen {

inline constexpr std::size_t kTiers = 4;

class Tiers;

// The background thread fills a room and then points to it; the evaluating thread only reads the pointer.  Rooms
// live as long as the place, because an evaluation may use any of them.
class Place {
 public:
  struct Room {
    explicit Room(const Kernels& k) : kernels(k), room(k) {}
    const Kernels& kernels;
    Kernels::Room room;
  };

  explicit Place(std::shared_ptr<Tiers> tiers);
  ~Place();
  Place(const Place&) = delete;
  Place& operator=(const Place&) = delete;

  Room& now() { return *now_.load(std::memory_order_acquire); }
  bool is_of(const Tiers& tiers) const { return tiers_.get() == &tiers; }

 private:
  friend class Tiers;
  void move_to(Tier tier, const Kernels& kernels);

  std::shared_ptr<Tiers> tiers_;
  std::atomic<Room*> now_{nullptr};
  std::array<std::unique_ptr<Room>, kTiers> rooms_;
};

class Tiers {
 public:
  // `settled`: there will be no other tier.
  Tiers(std::unique_ptr<const Kernels> first, bool settled);

  // Sizes, patterns and name, which are the same in all tiers.
  const Kernels& first() const { return first_; }
  // The best tier now.  It stays valid after a better tier exists.
  const Kernels& serving() const;
  Tier tier() const;
  bool is_settled() const;
  void wait() const;
  std::string trouble() const;

  void publish(Tier tier, std::unique_ptr<const Kernels> kernels);
  void settle(std::exception_ptr failure);

 private:
  friend class Place;

  mutable std::mutex mutex_;  // of all below
  mutable std::condition_variable changed_;
  std::array<std::unique_ptr<const Kernels>, kTiers> kernels_;
  Tier tier_;
  bool settled_;
  std::exception_ptr failure_;
  std::vector<Place*> places_;  // that there are
  const Kernels& first_;
  const pid_t process_ = getpid();  // whose thread makes the others
};

// Makes the other tiers in a thread of its own; the destructor ends a running compiler.
class TierBuilder;

// The builder is null if there is only one tier.
std::pair<std::shared_ptr<Tiers>, std::shared_ptr<TierBuilder>> make_tiers(const Function& function,
                                                                           const CodegenOptions& options);

}  // namespace dyntape::codegen
