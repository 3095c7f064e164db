// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/passes/fuse.h>

#include <algorithm>

#include <dyntape/autodiff/graph/callee.h>
#include <dyntape/codegen/passes/rewrite.h>

namespace dyntape::codegen {
namespace {

bool is_sum(Op op) { return op == Op::Add || op == Op::Sub; }

// Knows the sums that are parts of others, and of which nodes somebody may see the sign: outputs, what is compared, divided
// by, a function's argument, and factors of such; not of what is but added to something.
class SumRewriter : public Rewriter {
 public:
  SumRewriter(const Function& source, std::size_t pinned_outputs)
      : Rewriter(source, pinned_outputs), in_sum_(graph_.size(), 0), is_seen_(graph_.size(), 0) {
    for (NodeId output : source.outputs) is_seen_[output] = 1;
    for (auto id = static_cast<NodeId>(graph_.size()); id-- > 0;) {
      const Node& node = graph_[id];
      if (is_sum(node.op)) {
        if (!is_pinned(id)) in_sum_[node.a] = in_sum_[node.b] = 1;
      } else if (node.op == Op::Mul || node.op == Op::Neg) {
        graph_.for_each_argument(id, [&](NodeId a) { is_seen_[a] |= is_seen_[id]; });
      } else {
        graph_.for_each_argument(id, [&](NodeId a) { is_seen_[a] = 1; });
      }
    }
  }

 protected:
  // A sum that another sum uses, and nobody else.
  bool is_inner(NodeId id) const { return is_sum(graph_[id].op) && is_used_once(id) && in_sum_[id]; }

  // x y - z w whose sign is seen: nobody expects one where the products are equal, so both are rounded.  And any x x - y y.
  bool is_kept_difference(NodeId id) const {
    const Node& node = graph_[id];
    if (node.op != Op::Sub || graph_[node.a].op != Op::Mul || graph_[node.b].op != Op::Mul) return false;
    const auto is_square = [&](NodeId product) { return graph_[product].a == graph_[product].b; };
    return is_seen_[id] || (is_square(node.a) && is_square(node.b));
  }

 private:
  std::vector<std::uint8_t> in_sum_;  // whether a sum uses it
  std::vector<std::uint8_t> is_seen_;
};

// Sums of sums as chains, where a chain has more places to fuse products into.
class Chains : public SumRewriter {
 public:
  using SumRewriter::SumRewriter;

 private:
  struct Term {
    NodeId node;
    bool negative;
  };

  NodeId instead_of(NodeId id, const Node& node) override {
    if (!is_sum(node.op) || is_inner(id)) return kNoNode;
    collect(id);
    const auto is_plain = [&](const Term& t) { return !is_product(t.node); };
    const auto first_product = std::stable_partition(terms_.begin(), terms_.end(), is_plain);
    const auto products = static_cast<std::size_t>(terms_.end() - first_product);
    // A positive term in front, if there is one, needs no negation.
    const auto front_end = first_product == terms_.begin() ? terms_.end() : first_product;
    const auto front =
        std::find_if(terms_.begin(), front_end, [](const Term& term) { return !term.negative; });
    if (front != front_end) std::rotate(terms_.begin(), front, front + 1);
    if (is_kept_difference(id) || std::min(products, terms_.size() - 1) <= places_) return kNoNode;
    NodeId sum = image_[terms_[0].node];
    if (terms_[0].negative) sum = target_.make(Op::Neg, sum);
    for (std::size_t i = 1; i < terms_.size(); ++i)
      sum = target_.make(terms_[i].negative ? Op::Sub : Op::Add, sum, image_[terms_[i].node]);
    return sum;
  }

  bool is_product(NodeId id) const { return graph_[id].op == Op::Mul && is_used_once(id); }
  // The terms of a sum and of the sums in it, and how many of these sums can take a product as they are.
  void collect(NodeId root) {
    terms_.clear();
    places_ = 0;
    stack_.assign(1, {root, false});
    while (!stack_.empty()) {
      const auto [id, negative] = stack_.back();
      stack_.pop_back();
      if (id != root && !is_inner(id)) {
        terms_.push_back({id, negative});
        continue;
      }
      const Node& node = graph_[id];
      places_ += (is_product(node.a) || is_product(node.b)) && !is_kept_difference(id);
      stack_.push_back({node.b, negative != (node.op == Op::Sub)});
      stack_.push_back({node.a, negative});
    }
  }

  std::vector<Term> terms_, stack_;
  std::size_t places_ = 0;
};

class Fusion : public SumRewriter {
 public:
  Fusion(const Function& source, std::size_t pinned_outputs)
      : SumRewriter(source, pinned_outputs), product_(graph_.size(), kNoNode) {
    find_users();
    // Products with one user first: each saves an operation and takes one place only.
    std::vector<NodeId> products;
    for (NodeId id = 0; id < graph_.size(); ++id) {
      if (graph_[id].op == Op::Mul && !is_pinned(id) && users_end(id) - first_user_[id] == uses_[id])
        products.push_back(id);
    }
    std::stable_sort(products.begin(), products.end(),
                     [&](NodeId a, NodeId b) { return uses_[a] < uses_[b]; });
    for (NodeId product : products) {
      const auto *begin = users_.data() + first_user_[product], *end = users_.data() + users_end(product);
      if (std::all_of(begin, end, [&](NodeId user) { return product_[user] == kNoNode; }))
        std::for_each(begin, end, [&](NodeId user) { product_[user] = product; });
    }
  }

 private:
  // The sums that use a node: users_[first_user_[id]] and on, up to users_end(id).
  void find_users() {
    first_user_.assign(graph_.size() + 1, 0);
    const auto for_each_use = [&](auto&& visit) {
      for (NodeId id = 0; id < graph_.size(); ++id) {
        const Node& node = graph_[id];
        if (!is_sum(node.op) || is_pinned(id) || node.a == node.b || is_kept_difference(id)) continue;
        visit(node.a, id);
        visit(node.b, id);
      }
    };
    for_each_use([&](NodeId a, NodeId) { ++first_user_[a + 1]; });
    for (std::size_t i = 1; i < first_user_.size(); ++i) first_user_[i] += first_user_[i - 1];
    users_.resize(first_user_.back());
    std::vector<std::uint32_t> next(first_user_.begin(), first_user_.end() - 1);
    for_each_use([&](NodeId a, NodeId user) { users_[next[a]++] = user; });
  }
  std::uint32_t users_end(NodeId id) const { return first_user_[id + 1]; }

  std::shared_ptr<const Callee> callee_instead_of(const std::shared_ptr<const Callee>& callee) override {
    const Kernel* const kernel = callee->kernel();
    return kernel && kernel->fused ? kernel->fused() : callee;
  }

  NodeId instead_of(NodeId id, const Node& node) override {
    if (product_[id] == kNoNode) return kNoNode;
    const bool is_right = product_[id] == node.b;
    const Node& product = graph_[product_[id]];
    const Op op = node.op == Op::Add ? Op::Fma : is_right ? Op::Fnma : Op::Fms;
    return target_.make(op, image_[product.a], image_[product.b], image_[is_right ? node.a : node.b]);
  }

  std::vector<std::uint32_t> first_user_;
  std::vector<NodeId> users_;
  std::vector<NodeId> product_;  // that a sum takes in
};

}  // namespace

Function fused(const Function& function, std::size_t pinned_outputs) {
  return Fusion(Chains(function, pinned_outputs).run(), pinned_outputs).run();
}

}  // namespace dyntape::codegen
