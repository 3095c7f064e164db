// SPDX-License-Identifier: BSD-3-Clause
//
// The content hash of a function: XXH3-128 over its canonical form.
#define XXH_INLINE_ALL
#define XXH_VECTOR XXH_SSE2  // gcc 12 warns about its own AVX-512 header
#include <xxhash.h>

#include <bit>
#include <cstdio>
#include <cstring>
#include <stdexcept>

#include <dyntape/autodiff/callee.h>
#include <dyntape/autodiff/function.h>

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

void add_callee(Hasher& hasher, const std::shared_ptr<const Callee>& callee, int derivatives) {
  hasher.add(callee->n_in);
  hasher.add(callee->n_out);
  if (callee->recorded) {  // its derivatives follow from it, but for kernels inside
    hasher.add(content_hash(*callee->recorded, derivatives));
    return;
  }
  hasher.add(callee->name);
  hasher.add(callee->c_body);
  hasher.add(callee->c_body_of_lanes);
  if (derivatives == 0) return;
  if (callee->jvp) add_callee(hasher, jvp_callee(callee), derivatives - 1);
  if (callee->vjp) add_callee(hasher, vjp_callee(callee), derivatives - 1);
}

}  // namespace

std::string content_hash(const Function& function, int derivatives) {
  const Function live = compact(function);
  Hasher hasher;
  for (std::size_t n : live.inputs) hasher.add(n);
  for (const auto& callee : live.graph.callees()) add_callee(hasher, callee, derivatives);
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

}  // namespace dyntape
