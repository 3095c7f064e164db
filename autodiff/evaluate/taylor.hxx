// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <utility>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/evaluate/interpret.h>

namespace dyntape {

namespace detail {

// A recorded callee, with the function's own rules.
template <class T>
class RecordedSeries : public SeriesKernel<T> {
 public:
  using Many = std::vector<Series<T>>;
  RecordedSeries(std::shared_ptr<const Function> function, SeriesKernels<T> kernels)
      : function_(std::move(function)), kernels_(std::move(kernels)) {}
  Many forward(const Many& in) const override {
    Taylor<T> run(function_, kernels_);
    run.forward(in);
    Many out;
    for (std::size_t i = 0; i < function_->n_y(); ++i) out.push_back(run.output(i));
    return out;
  }
  Many reverse(const Many& in, const Many&, const Many& adjoints) const override {
    Taylor<T> run(function_, kernels_);
    run.forward(in);
    return run.reverse(adjoints);
  }

 private:
  std::shared_ptr<const Function> function_;
  SeriesKernels<T> kernels_;
};

}  // namespace detail

// Whether an adjoint passes as a number: not where zero differs from nothing.
constexpr bool passes_numbers(Op op) {
  return op != Op::Azmul && op != Op::Gate && op != Op::Min && op != Op::Max && op != Op::Select;
}

template <class T>
Taylor<T>::Taylor(std::shared_ptr<const Function> function, SeriesKernels<T> kernels)
    : function_(std::move(function)), kernels_(std::move(kernels)) {}

template <class T>
void Taylor<T>::evaluate_at_point(const T* const* blocks) {
  const Graph& graph = function_->graph;
  const auto n = static_cast<NodeId>(graph.size());
  is_at_point_ = true, moves_ = false;
  point_.resize(n);
  T* const values = point_.data();
  for (NodeId id = 0; id < n; ++id) {
    const Node& node = graph[id];
    if (node.op == Op::Mul) {
      values[id] = values[node.a] * values[node.b];
    } else if (node.op == Op::Add) {
      values[id] = values[node.a] + values[node.b];
    } else if (node.op == Op::Sub) {
      values[id] = values[node.a] - values[node.b];
    } else if (node.op == Op::Const) {
      values[id] = T(graph.constants()[node.a]);
    } else if (node.op == Op::Input) {
      values[id] = blocks[node.a][node.b];
    } else {
      const int arity = info(node.op).arity;
      values[id] = SeriesNumber<T>::evaluate(node.op, values[node.a], values[arity > 1 ? node.b : node.a],
                                             values[arity > 2 ? node.c : node.a]);
    }
  }
}

template <class T>
void Taylor<T>::forward_at(const std::vector<T>& x, const std::vector<T>& p, const std::vector<T>& w) {
  detail::check_sizes(*function_, x.size(), p.size(), w.size());
  if constexpr (kKnown) {
    if (function_->graph.callees().empty()) {
      const T* const blocks[] = {x.data(), p.data(), w.data()};
      return evaluate_at_point(blocks);
    }
  }
  const auto constants = [](const std::vector<T>& numbers) {
    Many series;
    for (const T& number : numbers) series.push_back(Series<T>::constant(number));
    return series;
  };
  forward(constants(x), constants(p), constants(w));
}

template <class T>
void Taylor<T>::forward(const Many& x, const Many& p, const Many& w) {
  detail::check_sizes(*function_, x.size(), p.size(), w.size());
  const Many* const blocks[] = {&x, &p, &w};
  const Graph& graph = function_->graph;
  values_.resize(graph.size());
  moves_ = is_at_point_ = false;
  for (const Many* block : blocks) {
    for (const Series<T>& input : *block) moves_ = moves_ || input.moves();
  }
  for (NodeId id = 0; id < graph.size(); ++id) {
    const Node& node = graph[id];
    switch (node.op) {
      case Op::Const:
        values_[id] = Series<T>(graph.constants()[node.a]);
        break;
      case Op::Input:
        values_[id] = (*blocks[node.a])[node.b];
        break;
      case Op::Call:
        forward_call(id);
        break;
      case Op::Result:
        values_[id] = results_[graph[node.a].c][node.b];
        break;
      default: {
        const int n = info(node.op).arity;
        const Series<T>&x = values_[node.a], &y = values_[n > 1 ? node.b : node.a],
              &z = values_[n > 2 ? node.c : node.a];
        if (!moves_) {
          values_[id].become(SeriesNumber<T>::evaluate(node.op, x[0], y[0], z[0]));
          break;
        }
        if (arithmetic(node.op, x, y, values_[id])) break;
        values_[id] = evaluate_series(node.op, x, y, z);
        if (values_[id].is_nothing()) values_[id] = Series<T>(0.0);  // a closed gate
      }
    }
  }
}

template <class T>
std::vector<Series<T>> Taylor<T>::arguments_of(NodeId call) const {
  Many arguments;
  function_->graph.for_each_argument(call, [&](NodeId a) { arguments.push_back(values_[a]); });
  return arguments;
}

template <class T>
std::shared_ptr<const SeriesKernel<T>> Taylor<T>::kernel_of(NodeId call) const {
  const Callee& callee = *function_->graph.callees()[function_->graph[call].a];
  if (kernels_) {
    if (auto kernel = kernels_(callee)) return kernel;
  }
  if (const auto recorded = detail::recorded_form(callee))
    return std::make_shared<detail::RecordedSeries<T>>(recorded, kernels_);
  throw ArgumentError("Taylor: kernel \"" + callee.name + "\" of \"" + function_->name +
                      "\" is not known in series; pass a SeriesKernel for it");
}

template <class T>
void Taylor<T>::forward_call(NodeId id) {
  const std::size_t number = function_->graph[id].c;
  values_[id] = Series<T>(0.0);
  results_.resize(std::max<std::size_t>(results_.size(), number + 1));
  results_[number] = kernel_of(id)->forward(arguments_of(id));
}

template <class T>
std::size_t Taylor<T>::violated_guard(std::size_t first) const {
  for (std::size_t i = first; i < function_->guards.size(); ++i) {
    const Guard& guard = function_->guards[i];
    if (SeriesNumber<T>::is_zero(value(guard.condition)) == guard.expected) return i;
  }
  return SIZE_MAX;
}

template <class T>
void Taylor<T>::reverse_call(NodeId call, const Many& of_results, std::size_t orders, Many& adjoints) const {
  const Graph& graph = function_->graph;
  const auto lowest = [orders](const Many& all) {
    Many some;
    for (const Series<T>& series : all) some.push_back(series.first(orders));
    return some;
  };
  const Many in = kernel_of(call)->reverse(lowest(arguments_of(call)), lowest(results_[graph[call].c]),
                                           lowest(of_results));
  std::size_t i = 0;
  graph.for_each_argument(call, [&](NodeId a) {
    adjoints[a] = detail::sum(adjoints[a], in[i], false);
    ++i;
  });
}

// + - * / of series of numbers, in place; false: another operator.
template <class T>
bool Taylor<T>::arithmetic(Op op, const Series<T>& x, const Series<T>& y, Series<T>& r) {
  if constexpr (!kKnown) return false;
  if (op != Op::Add && op != Op::Sub && op != Op::Mul) return false;
  const std::size_t n = detail::common_size(x, y);
  r.become(T(0));
  r.resize(n);
  if (op == Op::Mul) {
    for (std::size_t k = 0; k < n; ++k) {
      const std::size_t first = y.moves() ? 0 : k, last = x.moves() ? k : 0;
      T sum = x[first] * y[k - first];
      for (std::size_t j = first + 1; j <= last; ++j) sum = sum + x[j] * y[k - j];
      r[k] = sum;
    }
    return true;
  }
  for (std::size_t k = 0; k < n; ++k) {
    const bool in_x = k < x.size(), in_y = k < y.size();
    r[k] = !in_y ? x[k] : op == Op::Add ? (in_x ? x[k] + y[k] : y[k]) : in_x ? x[k] - y[k] : -y[k];
  }
  return true;
}

template <class T>
void Taylor<T>::add_to(Series<T>& sum, const Series<T>& more, bool minus) {
  if constexpr (kKnown) {
    if (sum.size() == more.size()) {
      for (std::size_t k = 0; k < more.size(); ++k) sum[k] = minus ? sum[k] - more[k] : sum[k] + more[k];
      return;
    }
  }
  sum = detail::sum(sum, more, minus);
}

template <class T>
void Taylor<T>::reverse_node(NodeId id, Many& adjoints) const {
  const Node& node = function_->graph[id];
  const Series<T>& v = adjoints[id];
  const int n = info(node.op).arity;
  const Series<T>&x = values_[node.a], &y = values_[n > 1 ? node.b : node.a],
        &z = values_[n > 2 ? node.c : node.a];
  if (node.op == Op::Add || node.op == Op::Sub) {
    add_to(adjoints[node.a], v, false);
    return add_to(adjoints[node.b], v, node.op == Op::Sub);
  }
  for (int i = 0; i < n; ++i) {
    if (!has_slope(node.op, i) || function_->graph.is_constant(node.argument(i))) continue;
    add_to(adjoints[node.argument(i)], slope<Series<T>>(node.op, i, x, y, z, values_[id], v), false);
  }
}

// All values are numbers, and so are the adjoints.
template <class T>
void Taylor<T>::reverse_numbers(const Many& of_outputs, Many& of_variables) const {
  const Graph& graph = function_->graph;
  numbers_.resize(graph.size());
  is_met_.assign(graph.size(), 0);
  const auto pass = [&](NodeId to, const T& v) {
    numbers_[to] = is_met_[to] ? T(numbers_[to] + v) : v;
    is_met_[to] = 1;
  };
  for (std::size_t i = 0; i < function_->n_y(); ++i) {
    if (!of_outputs[i].is_nothing()) pass(function_->outputs[i], of_outputs[i][0]);
  }
  for (auto id = static_cast<NodeId>(graph.size()); id-- > 0;) {
    if (!is_met_[id]) continue;
    const Node& node = graph[id];
    const T v = numbers_[id];
    if (node.op == Op::Mul) {
      pass(node.a, v * point_[node.b]), pass(node.b, v * point_[node.a]);
    } else if (node.op == Op::Add || node.op == Op::Sub) {
      pass(node.a, v), pass(node.b, node.op == Op::Add ? v : -v);
    } else if (node.op == Op::Input) {
      if (node.a == static_cast<NodeId>(Block::kVariables)) of_variables[node.b] = Series<T>::constant(v);
    } else if (node.op != Op::Const) {
      const int n = info(node.op).arity;
      const T x = point_[node.a], y = point_[n > 1 ? node.b : node.a], z = point_[n > 2 ? node.c : node.a];
      const bool as_number = passes_numbers(node.op) && v != T(0);
      for (int i = 0; i < n; ++i) {
        if (!has_slope(node.op, i) || graph.is_constant(node.argument(i))) continue;
        if (as_number) {
          pass(node.argument(i), slope<T>(node.op, i, x, y, z, point_[id], v));
          continue;
        }
        using S = Series<T>;
        const auto s = slope<S>(node.op, i, S::constant(x), S::constant(y), S::constant(z),
                                S::constant(point_[id]), S::constant(v));
        if (!s.is_nothing()) pass(node.argument(i), s[0]);
      }
    }
  }
}

template <class T>
std::vector<Series<T>> Taylor<T>::reverse(const Many& of_outputs, std::size_t orders) const {
  const Graph& graph = function_->graph;
  Many of_variables(function_->n_x());
  if constexpr (kKnown) {
    const auto moves = [](const Series<T>& adjoint) { return adjoint.moves(); };
    if (is_at_point_ && std::none_of(of_outputs.begin(), of_outputs.end(), moves))
      return reverse_numbers(of_outputs, of_variables), of_variables;
  }
  if (is_at_point_) {
    values_.resize(graph.size());
    for (NodeId id = 0; id < graph.size(); ++id) values_[id].become(point_[id]);
  }
  Many& adjoints = adjoints_;
  adjoints.resize(graph.size());
  for (Series<T>& adjoint : adjoints) adjoint.become_nothing();
  std::map<NodeId, Many> of_calls;  // adjoints of the results of calls
  for (std::size_t i = 0; i < function_->n_y(); ++i) {
    if (of_outputs[i].is_nothing()) continue;
    Series<T>& adjoint = adjoints[function_->outputs[i]];
    adjoint = detail::sum(adjoint, of_outputs[i], false).gated(!kKnown);
  }
  for (auto id = static_cast<NodeId>(graph.size()); id-- > 0;) {
    const Node& node = graph[id];
    if (node.op == Op::Call) {
      if (const auto found = of_calls.find(id); found != of_calls.end())
        reverse_call(id, found->second, orders, adjoints);
      continue;
    }
    if (adjoints[id].is_nothing()) continue;
    if (node.op == Op::Input) {
      if (node.a == static_cast<NodeId>(Block::kVariables)) of_variables[node.b] = adjoints[id];
    } else if (node.op == Op::Result) {
      auto& of_call = of_calls[node.a];
      of_call.resize(graph.callees()[graph[node.a].a]->n_out);
      of_call[node.b] = adjoints[id];
    } else if (node.op != Op::Const) {
      reverse_node(id, adjoints);
    }
  }
  return of_variables;
}

}  // namespace dyntape
