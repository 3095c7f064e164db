// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/record/tape.h>

#include <atomic>
#include <random>
#include <utility>

#include <dyntape/autodiff/error.h>

namespace dyntape::detail {
namespace {

// The memory of this thread's last recording; a large one is given back.
constexpr std::size_t kSpareBytes = std::size_t{1} << 24;
constinit thread_local bool spare_is_gone = false;
struct Spare {
  ~Spare() { spare_is_gone = true; }
  Graph graph;
  LivePartMemory memory;
};
thread_local Spare spare;

// Serial numbers begin at random, so that two copies of this library in one process do not take each other's values for their own.
std::uint32_t next_serial() {
  static std::atomic<std::uint32_t> next{std::random_device{}()};
  std::uint32_t serial = next++;
  while (serial == 0) serial = next++;
  return serial;
}

}  // namespace

Tape::Tape() : serial(next_serial()) {
  if (spare_is_gone) return;
  std::swap(graph, spare.graph);
  std::swap(memory, spare.memory);
}

Tape::~Tape() {
  if (spare_is_gone || graph.bytes() > kSpareBytes || graph.bytes() < spare.graph.bytes()) return;
  graph.clear();
  std::swap(graph, spare.graph);
  std::swap(memory, spare.memory);
}

void Tape::guard(NodeId condition, bool expected, const char* file, int line) {
  if (guarded.insert(condition).second) guards.push_back({condition, expected, file, line});
}

// The sign of a NaN is no result (graph.h): a constant one would be folded to either.
void refuse_sign_of_nan() {
  throw RecordingError("copysign: the second argument is NaN, whose sign is not defined; expected a number");
}

}  // namespace dyntape::detail
