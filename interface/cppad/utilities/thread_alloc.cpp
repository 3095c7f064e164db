// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/cppad/utilities/thread_alloc.h>

#include <bit>
#include <cstdlib>
#include <map>
#include <mutex>
#include <string>

#include <dyntape/interface/cppad/vector.h>

namespace CppAD::inline dyntape_names {

namespace {

// In front of each block.
struct alignas(std::max_align_t) BlockHeader {
  std::size_t bytes, thread, length;
};

struct ThreadBlocks {
  std::size_t inuse = 0, available = 0;
  std::multimap<std::size_t, BlockHeader*> kept;  // by size
};

struct BlockPool {
  std::mutex mutex;
  std::size_t threads = 1;
  bool (*in_parallel)() = nullptr;
  std::size_t (*thread_num)() = nullptr;
  bool holds = false;
  std::map<std::size_t, ThreadBlocks> of_thread;
};

BlockPool& pool() {
  static BlockPool* const the_pool = new BlockPool;  // outlives blocks in static objects
  return *the_pool;
}

BlockHeader* header_of(void* block) { return static_cast<BlockHeader*>(block) - 1; }

void free_kept(ThreadBlocks& blocks) {
  for (const auto& entry : blocks.kept) std::free(entry.second);
  blocks.kept.clear();
  blocks.available = 0;
}

}  // namespace

void thread_alloc::parallel_setup(std::size_t threads, bool (*in_parallel)(), std::size_t (*thread_num)()) {
  if (threads == 0) detail::refuse("parallel_setup: there are 0 threads, expected at least one");
  if (threads > 1 && (!in_parallel || !thread_num))
    detail::refuse("parallel_setup: of " + std::to_string(threads) +
                   " threads, expected functions that say which of them asks");
  pool().threads = threads, pool().in_parallel = in_parallel, pool().thread_num = thread_num;
}
std::size_t thread_alloc::num_threads() { return pool().threads; }
bool thread_alloc::in_parallel() { return pool().in_parallel && pool().in_parallel(); }
std::size_t thread_alloc::thread_num() { return pool().thread_num ? pool().thread_num() : 0; }
void thread_alloc::hold_memory(bool yes) { pool().holds = yes; }

void* thread_alloc::get_memory(std::size_t min_bytes, std::size_t& cap_bytes) {
  cap_bytes = std::bit_ceil(min_bytes < 64 ? std::size_t(64) : min_bytes);
  const std::size_t thread = thread_num();
  const std::scoped_lock lock(pool().mutex);
  ThreadBlocks& blocks = pool().of_thread[thread];
  BlockHeader* header;
  if (const auto kept = blocks.kept.find(cap_bytes); kept != blocks.kept.end()) {
    header = kept->second;
    blocks.kept.erase(kept);
    blocks.available -= cap_bytes;
  } else {
    header = static_cast<BlockHeader*>(std::malloc(sizeof(BlockHeader) + cap_bytes));
    if (!header) throw std::bad_alloc();
  }
  *header = {cap_bytes, thread, 0};
  blocks.inuse += cap_bytes;
  return header + 1;
}

void thread_alloc::return_memory(void* block) {
  BlockHeader* const header = header_of(block);
  const std::scoped_lock lock(pool().mutex);
  ThreadBlocks& blocks = pool().of_thread[header->thread];
  blocks.inuse -= header->bytes;
  if (!pool().holds) return std::free(header);
  blocks.available += header->bytes;
  blocks.kept.emplace(header->bytes, header);
}

void thread_alloc::free_available(std::size_t thread) {
  const std::scoped_lock lock(pool().mutex);
  free_kept(pool().of_thread[thread]);
}

bool thread_alloc::free_all() {
  const std::scoped_lock lock(pool().mutex);
  bool none_in_use = true;
  for (auto& [thread, blocks] : pool().of_thread) {
    free_kept(blocks);
    none_in_use = none_in_use && blocks.inuse == 0;
  }
  return none_in_use;
}

std::size_t thread_alloc::inuse(std::size_t thread) {
  const std::scoped_lock lock(pool().mutex);
  return pool().of_thread[thread].inuse;
}
std::size_t thread_alloc::available(std::size_t thread) {
  const std::scoped_lock lock(pool().mutex);
  return pool().of_thread[thread].available;
}

std::size_t& thread_alloc::length_of(void* block) { return header_of(block)->length; }

}  // namespace CppAD::inline dyntape_names
