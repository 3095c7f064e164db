// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/cppad/graph/hessian_products.h>

#include <dyntape/autodiff/graph/function.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/evaluate/interpret.h>

namespace CppAD::inline dyntape_names::detail {

using namespace dyntape;

namespace {

// The gradient of w . f, changing along a direction, in two functions: what is of the point alone, and the rest, whose parameters those are.
struct ProductParts {
  Function point;    // (x, p, w)
  Function product;  // variables: the direction; parameters: results of `point`
};

Function derived_product(const Function& f, std::size_t range) {
  std::vector<std::size_t> results(range);
  for (std::size_t i = 0; i < range; ++i) results[i] = i;
  Function of_results = select_outputs(f, results);
  of_results.guards.clear();  // of the branches that were recorded
  return jvp(vjp(of_results));
}

// Which nodes depend on weights from the place `first` on.
std::vector<bool> nodes_after(const Graph& graph, std::size_t first) {
  std::vector<bool> depends(graph.size(), false);
  for (NodeId id = 0; id < graph.size(); ++id) {
    const Node& node = graph[id];
    if (node.op == Op::Input) {
      depends[id] = static_cast<Block>(node.a) == Block::kWeights && node.b >= first;
    } else {
      graph.for_each_argument(id, [&](NodeId a) { depends[id] = depends[id] || depends[a]; });
    }
  }
  return depends;
}

ProductParts split_product(const Function& f, std::size_t n) {
  const std::size_t first = f.n_w() - n;
  const std::vector<bool> depends = nodes_after(f.graph, first);
  Graph graph;
  std::vector<NodeId> image(f.graph.size(), kNoNode), crossing, outputs;
  const auto here = [&](NodeId id) {
    if (id == kNoNode || image[id] != kNoNode) return id == kNoNode ? kNoNode : image[id];
    if (f.graph.is_constant(id)) return image[id] = graph.constant(f.graph.constant_value(id));
    image[id] = graph.input(Block::kParameters, static_cast<std::uint32_t>(crossing.size()));
    crossing.push_back(id);
    return image[id];
  };
  for (NodeId id = 0; id < f.graph.size(); ++id) {
    if (!depends[id]) continue;
    const Node& node = f.graph[id];
    if (node.op == Op::Input) {
      image[id] = graph.input(Block::kVariables, node.b - static_cast<std::uint32_t>(first));
    } else {
      const NodeId a = here(node.a), b = here(node.b), c = here(node.c);
      image[id] = graph.make(node.op, a, b, c);
    }
  }
  for (NodeId id : f.outputs) outputs.push_back(here(id));
  ProductParts parts{live_part(f.graph, crossing, {}), live_part(graph, outputs, {})};
  parts.point.name = f.name + "_point", parts.product.name = f.name;
  parts.point.inputs = f.inputs, parts.product.inputs = {n, crossing.size(), 0};
  return parts;
}

}  // namespace

struct HessianProducts::State {
  explicit State(ProductParts parts)
      : at_point(std::move(parts.point)), product(std::move(parts.product)), one(at_point) {}
  Interpreter at_point, product;
  Interpreter::Workspace one;
  std::size_t room = 0;  // points that `many` is for
  std::optional<Interpreter::Workspace> many;
};

HessianProducts::HessianProducts(const Function& f, std::size_t range)
    : state_(std::make_unique<State>(split_product(derived_product(f, range), f.n_x()))) {}
HessianProducts::~HessianProducts() = default;

bool HessianProducts::operator()(const std::vector<double>& x, const std::vector<double>& p,
                                 const std::vector<double>& w, const std::vector<double>& directions,
                                 std::vector<double>& products) {
  const std::size_t n = x.size(), points = directions.size() / n;
  if (state_->room < std::min<std::size_t>(points, 2))
    state_->many.emplace(state_->product, state_->room = points);
  std::vector<double> at_point(state_->at_point.function().n_y());
  std::vector<double> weights = w;
  weights.resize(w.size() + n, 0.0);  // nothing of the point follows a direction
  state_->at_point(x.data(), p.data(), weights.data(), at_point.data(), state_->one);
  products.resize(points * n);
  state_->product(
      {.points = points, .x = directions.data(), .p = at_point.data(), .y = products.data(), .stride_p = 0},
      *state_->many);
  return std::all_of(products.begin(), products.end(), [](double v) { return std::isfinite(v); });
}

}  // namespace CppAD::inline dyntape_names::detail
