// SPDX-License-Identifier: BSD-3-Clause
//
// The content hash of a function: XXH3-128 over its canonical form.
#define XXH_INLINE_ALL
#if defined(__SSE2__)
#define XXH_VECTOR XXH_SSE2  // gcc 12 warns about its own AVX-512 header
#endif
#include <xxhash.h>

#include <bit>
#include <cstdio>
#include <cstring>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <utility>

#include <dyntape/autodiff/graph/callee.h>
#include <dyntape/autodiff/graph/function.h>

namespace dyntape {
namespace {

class Hasher {
 public:
  Hasher() : state_(XXH3_createState()) {
    if (!state_) throw std::bad_alloc();
    XXH3_128bits_reset(state_);
  }
  ~Hasher() { XXH3_freeState(state_); }
  Hasher(const Hasher&) = delete;
  Hasher& operator=(const Hasher&) = delete;

  void add(std::uint64_t value) { append(&value, sizeof value); }
  void add(std::string_view text) {
    add(text.size());
    append(text.data(), text.size());
  }
  std::string digest() {
    flush();
    const XXH128_hash_t h = XXH3_128bits_digest(state_);
    char text[33];
    std::snprintf(text, sizeof text, "%016llx%016llx", static_cast<unsigned long long>(h.high64),
                  static_cast<unsigned long long>(h.low64));
    return text;
  }

 private:
  // Many small things in one go.
  void append(const void* data, std::size_t bytes) {
    if (filled_ + bytes > sizeof buffer_) flush();
    if (bytes > sizeof buffer_) {
      XXH3_128bits_update(state_, data, bytes);
    } else {
      std::memcpy(buffer_ + filled_, data, bytes);
      filled_ += bytes;
    }
  }
  void flush() {
    XXH3_128bits_update(state_, buffer_, filled_);
    filled_ = 0;
  }

  XXH3_state_t* state_;
  char buffer_[4096];
  std::size_t filled_ = 0;
};

// What derive() takes of a callee: a Jacobian is swept forward or in reverse, a Hessian forward over reverse.
struct Sweeps {
  bool derives = true;  // false: only values are asked for, whatever is made of them
  bool forward = false, reverse = false, forward_over_reverse = false;

  static Sweeps of_order(int order) { return {true, order > 0, order > 0, order > 1}; }
  Sweeps of_values() const { return {derives, false, false, false}; }
  Sweeps of_adjoints() const { return {derives, forward_over_reverse, false, false}; }
  int number() const { return derives + 2 * forward + 4 * reverse + 8 * forward_over_reverse; }
};

std::string digest_of(const Function& function, Sweeps sweeps);

void add_pattern(Hasher& hasher, const Pattern& pattern) {
  hasher.add(pattern.rows);
  hasher.add(pattern.cols);
  hasher.add(pattern.nnz());
  for (std::size_t k = 0; k < pattern.nnz(); ++k) {
    hasher.add(pattern.row[k]);
    hasher.add(pattern.col[k]);
  }
}

void add_kernel(Hasher& hasher, const std::string& name, const Kernel& kernel) {
  hasher.add(name);
  hasher.add(kernel.c_body);
  hasher.add(kernel.c_body_of_lanes);
}

// What decides how a caller is derived and printed, besides the values.
void add_treatment(Hasher& hasher, const Callee& callee) {
  hasher.add(callee.dissolves());
  hasher.add(callee.has_poles);
  add_pattern(hasher, callee.pattern);
  const auto operations = callee.kernel() ? callee.kernel()->operations : std::vector<OperationCount>();
  hasher.add(operations.size());
  for (const OperationCount& entry : operations) {
    hasher.add(info(entry.op).name);
    hasher.add(entry.count);
  }
}

std::string digest_of(const std::shared_ptr<const Callee>& callee, Sweeps sweeps);

std::string computed(const std::shared_ptr<const Callee>& callee, Sweeps sweeps) {
  const bool follow = derivatives_follow(*callee);
  Hasher hasher;
  hasher.add(callee->n_in);
  hasher.add(callee->n_out);
  if (sweeps.derives) add_treatment(hasher, *callee);
  const Recorded* const recorded = callee->recorded();
  if (recorded) {
    // Derivatives that follow are those of the recorded function, kernels inside it included.
    hasher.add(digest_of(*recorded->function, follow ? sweeps : sweeps.of_values()));
  } else {
    add_kernel(hasher, callee->name, *callee->kernel());
  }
  if (follow) return hasher.digest();
  const bool derives = recorded && recorded->derivative;
  const bool has_jvp = callee->jvp || derives, has_vjp = callee->vjp || derives;
  if (sweeps.forward) hasher.add(has_jvp ? digest_of(jvp_callee(callee), sweeps.of_values()) : "none");
  if (sweeps.reverse) hasher.add(has_vjp ? digest_of(vjp_callee(callee), sweeps.of_adjoints()) : "none");
  return hasher.digest();
}

// Kept: to make the derivatives that a callee brings along takes milliseconds.
std::string digest_of(const std::shared_ptr<const Callee>& callee, Sweeps sweeps) {
  static std::mutex mutex;
  auto& digests = callee->made.digests;
  {
    const std::scoped_lock lock(mutex);
    if (const auto known = digests.find(sweeps.number()); known != digests.end()) return known->second;
  }
  std::string digest = computed(callee, sweeps);
  const std::scoped_lock lock(mutex);
  return digests.emplace(sweeps.number(), std::move(digest)).first->second;
}

std::string digest_of(const Function& function, Sweeps sweeps) {
  const Function live = compact(function);
  Hasher hasher;
  for (std::size_t n : live.inputs) hasher.add(n);
  // Lists enter with their lengths: no two functions give the same numbers.
  for (std::size_t n :
       {live.graph.callees().size(), live.graph.size(), live.outputs.size(), live.guards.size()})
    hasher.add(n);
  for (const auto& callee : live.graph.callees()) hasher.add(digest_of(callee, sweeps));
  for (NodeId id = 0; id < live.graph.size(); ++id) {
    const Node& node = live.graph[id];
    // Operators enter by name, so that a new row in the table does not change old hashes.
    hasher.add(info(node.op).name);
    if (node.op == Op::Const) {
      hasher.add(std::bit_cast<std::uint64_t>(live.graph.constant_value(id)));
    } else if (node.op == Op::Call) {
      hasher.add(node.a);
      live.graph.for_each_argument(id, [&](NodeId a) { hasher.add(a); });
    } else {
      hasher.add(std::uint64_t(node.a) << 32 | node.b);
      hasher.add(node.c);
    }
  }
  for (NodeId id : live.outputs) hasher.add(id);
  for (const Guard& guard : live.guards) {
    hasher.add(guard.condition);
    hasher.add(guard.expected);
  }
  return hasher.digest();
}

}  // namespace

std::string content_hash(const Function& function) { return digest_of(function, Sweeps{.derives = false}); }

std::string content_hash(const Function& function, int derivatives) {
  return digest_of(function, Sweeps::of_order(derivatives));
}

}  // namespace dyntape
