// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <map>
#include <numbers>

#include <dyntape/autodiff/graph/callee.h>
#include <dyntape/interface/cppad/bases/tape.h>
#include <dyntape/interface/cppad/conditions.h>
#include <dyntape/interface/cppad/graph/cpp_graph.h>

namespace CppAD::inline dyntape_names::detail {

using graph::graph_op_enum;

namespace {

// Operators that have a row of their own in both.
struct GraphRow {
  Op op;
  graph_op_enum graph;
};
constexpr GraphRow kGraphRows[] = {
    {Op::Abs, graph::abs_graph_op},     {Op::Acos, graph::acos_graph_op},
    {Op::Acosh, graph::acosh_graph_op}, {Op::Add, graph::add_graph_op},
    {Op::Asin, graph::asin_graph_op},   {Op::Asinh, graph::asinh_graph_op},
    {Op::Atan, graph::atan_graph_op},   {Op::Atanh, graph::atanh_graph_op},
    {Op::Azmul, graph::azmul_graph_op}, {Op::Cos, graph::cos_graph_op},
    {Op::Cosh, graph::cosh_graph_op},   {Op::Div, graph::div_graph_op},
    {Op::Erf, graph::erf_graph_op},     {Op::Erfc, graph::erfc_graph_op},
    {Op::Exp, graph::exp_graph_op},     {Op::Expm1, graph::expm1_graph_op},
    {Op::Log1p, graph::log1p_graph_op}, {Op::Log, graph::log_graph_op},
    {Op::Mul, graph::mul_graph_op},     {Op::Neg, graph::neg_graph_op},
    {Op::Pow, graph::pow_graph_op},     {Op::Sign, graph::sign_graph_op},
    {Op::Sin, graph::sin_graph_op},     {Op::Sinh, graph::sinh_graph_op},
    {Op::Sqrt, graph::sqrt_graph_op},   {Op::Sub, graph::sub_graph_op},
    {Op::Tan, graph::tan_graph_op},     {Op::Tanh, graph::tanh_graph_op},
    {Op::Lt, graph::cexp_lt_graph_op},  {Op::Le, graph::cexp_le_graph_op},
    {Op::Eq, graph::cexp_eq_graph_op},
};

class GraphWriter {
 public:
  GraphWriter(const Recording<double>& recording, cpp_graph& graph)
      : recording_(recording), function_(*recording.function), from_(function_.graph), graph_(graph) {}

  void write() {
    graph_.initialize();
    graph_.n_dynamic_ind_set(function_.n_p());
    graph_.n_variable_ind_set(function_.n_x());
    nodes_ = function_.n_p() + function_.n_x();
    write_constants();
    for (NodeId id = 0; id < from_.size(); ++id) write_node(id);
    for (std::size_t k = 0; k < function_.guards.size(); ++k) {
      const std::size_t count = recording_.guard_counts.empty() ? 1 : recording_.guard_counts[k];
      for (std::size_t repeat = 0; repeat < count; ++repeat) write_guard(function_.guards[k]);
    }
    for (const Print& print : recording_.prints) {
      GraphUse use{graph::print_graph_op};
      use.name = text(print.before), use.after = text(print.after), use.n_result = 0;
      use.nodes = {image_[function_.outputs[print.flag]], image_[function_.outputs[print.value]]};
      append_use(graph_, use);
    }
    for (std::size_t i = 0; i < recording_.range; ++i)
      graph_.dependent_vec_push_back(image_[function_.outputs[i]]);
  }

 private:
  std::size_t text(const std::string& text) {
    const std::size_t i = graph_.print_text_vec_find(text);
    if (i == graph_.print_text_vec_size()) graph_.print_text_vec_push_back(text);
    return i;
  }
  void write_constants() {
    const auto enter = [&](double value) {
      graph_.constant_vec_push_back(value);
      return ++nodes_;
    };
    for (NodeId id = 0; id < from_.size(); ++id) {
      if (from_.is_constant(id)) image_[id] = enter(from_.constant_value(id));
      if (from_[id].op == Op::Log10 || from_[id].op == Op::Log2 || from_[id].op == Op::Exp2) {
        const double factor = from_[id].op == Op::Log10  ? 1 / std::numbers::ln10
                              : from_[id].op == Op::Log2 ? 1 / std::numbers::ln2
                                                         : std::numbers::ln2;
        if (!factor_of_.count(from_[id].op)) factor_of_[from_[id].op] = enter(factor);
      }
    }
  }
  std::size_t use(graph_op_enum op, std::initializer_list<std::size_t> nodes) {
    GraphUse one{op};
    one.nodes = nodes;
    append_use(graph_, one);
    return ++nodes_;
  }
  void write_node(NodeId id) {
    const Node& node = from_[id];
    if (node.op == Op::Const || (node.op >= Op::Lt && node.op <= Op::Ne)) return;
    if (node.op == Op::Input) {
      const bool variable = node.a == static_cast<NodeId>(Block::kVariables);
      image_[id] = 1 + node.b + (variable ? function_.n_p() : 0);
    } else if (node.op == Op::Call) {
      write_call(id);
    } else if (node.op == Op::Result) {
      image_[id] = first_of_call_[node.a] + node.b;
    } else if (node.op == Op::Select) {
      image_[id] = write_select(node);
    } else {
      image_[id] = write_operator(node);
    }
  }
  std::size_t write_select(const Node& node) {
    const Node& condition = from_[node.a];
    const std::size_t left = image_[condition.a], right = image_[condition.b], yes = image_[node.b],
                      no = image_[node.c];
    if (condition.op == Op::Ne) return use(graph::cexp_eq_graph_op, {left, right, no, yes});
    for (const GraphRow& row : kGraphRows) {
      if (row.op == condition.op) return use(row.graph, {left, right, yes, no});
    }
    return missing(condition);
  }
  std::size_t write_operator(const Node& node) {
    const std::size_t x = image_[node.a], y = info(node.op).arity > 1 ? image_[node.b] : 0;
    for (const GraphRow& row : kGraphRows) {
      if (row.op != node.op) continue;
      return info(node.op).arity == 1 ? use(row.graph, {x}) : use(row.graph, {x, y});
    }
    switch (node.op) {
      case Op::Log10:
      case Op::Log2:
        return use(graph::mul_graph_op, {factor_of_[node.op], use(graph::log_graph_op, {x})});
      case Op::Exp2:
        return use(graph::exp_graph_op, {use(graph::mul_graph_op, {factor_of_[node.op], x})});
      case Op::Min:
        return use(graph::cexp_lt_graph_op, {y, x, y, x});
      case Op::Max:
        return use(graph::cexp_lt_graph_op, {x, y, y, x});
      case Op::Hypot: {
        const std::size_t squares =
            use(graph::add_graph_op, {use(graph::mul_graph_op, {x, x}), use(graph::mul_graph_op, {y, y})});
        return use(graph::sqrt_graph_op, {squares});
      }
      case Op::Fma:
        return use(graph::add_graph_op, {use(graph::mul_graph_op, {x, y}), image_[node.c]});
      default:
        return missing(node);
    }
  }
  [[noreturn]] std::size_t missing(const Node& node) const {
    refuse("to_graph: CppAD's graphs have no operator for " + std::string(info(node.op).name) +
           ", which the function \"" + function_.name + "\" has");
  }
  void write_call(NodeId id) {
    const Callee& callee = *from_.callees()[from_[id].a];
    const auto kernel = recording_.kernels.find(&callee);
    const KernelName name = kernel == recording_.kernels.end() ? KernelName() : kernel->second->called();
    GraphUse call{graph::discrete_graph_op};
    if (name.kind == KernelName::kAtomicThree) call.op = graph::atom_graph_op;
    if (name.kind == KernelName::kAtomicFour) call.op = graph::atom4_graph_op;
    if (name.kind == KernelName::kOther)
      refuse("to_graph: CppAD's graphs have no operator for a call of \"" + callee.name + "\"");
    auto& names = call.op;
    call.name = names == graph::discrete_graph_op ? graph_.discrete_name_vec_find(name.name)
                                                  : graph_.atomic_name_vec_find(name.name);
    if (names == graph::discrete_graph_op) {
      if (call.name == graph_.discrete_name_vec_size()) graph_.discrete_name_vec_push_back(name.name);
    } else if (call.name == graph_.atomic_name_vec_size()) {
      graph_.atomic_name_vec_push_back(name.name);
    }
    call.call_id = name.call_id;
    call.n_result = callee.n_out;
    from_.for_each_argument(id, [&](NodeId a) { call.nodes.push_back(image_[a]); });
    append_use(graph_, call);
    first_of_call_[id] = nodes_ + 1;
    nodes_ += callee.n_out;
  }
  // What was false is written as the opposite that was true.
  void write_guard(const Guard& guard) {
    const Node& node = from_[guard.condition];
    GraphUse use{graph::comp_eq_graph_op};
    use.n_result = 0;
    use.nodes = {image_[node.a], image_[node.b]};
    const bool is_order = node.op == Op::Lt || node.op == Op::Le;
    if (!is_order && node.op != Op::Eq && node.op != Op::Ne) missing(node);
    if (is_order) {
      use.op = (node.op == Op::Lt) == guard.expected ? graph::comp_lt_graph_op : graph::comp_le_graph_op;
      if (!guard.expected) std::swap(use.nodes[0], use.nodes[1]);
    } else if ((node.op == Op::Eq) != guard.expected) {
      use.op = graph::comp_ne_graph_op;
    }
    append_use(graph_, use);
  }

  const Recording<double>& recording_;
  const Function& function_;
  const Graph& from_;
  cpp_graph& graph_;
  std::size_t nodes_ = 0;  // so far
  std::map<NodeId, std::size_t> image_, first_of_call_;
  std::map<Op, std::size_t> factor_of_;
};

}  // namespace

void write_graph(const Recording<double>& recording, cpp_graph& graph) {
  GraphWriter(recording, graph).write();
}

namespace {

template <class Base>
class GraphReader {
 public:
  using S = AD<Base>;
  explicit GraphReader(const cpp_graph& graph) : graph_(graph) {}

  std::shared_ptr<const Recording<Base>> read(const vector<bool>& to_variable,
                                              const vector<bool>& to_dynamic) {
    std::vector<S> variables, dynamics;
    std::vector<std::pair<bool, std::size_t>> places;  // of p and x: whether a variable, and which
    const auto enter = [&](bool variable) {
      auto& block = variable ? variables : dynamics;
      places.push_back({variable, block.size()});
      block.push_back(S(0));
    };
    check("from_graph: the size of dyn2var", to_variable.size(), graph_.n_dynamic_ind_get());
    check("from_graph: the size of var2dyn", to_dynamic.size(), graph_.n_variable_ind_get());
    for (std::size_t j = 0; j < graph_.n_dynamic_ind_get(); ++j)
      enter(to_variable.size() > 0 && to_variable[j]);
    for (std::size_t j = 0; j < graph_.n_variable_ind_get(); ++j)
      enter(to_dynamic.size() == 0 || !to_dynamic[j]);
    begin_recording(variables.data(), variables.size(), dynamics.data(), dynamics.size(), Begin());
    try {
      for (const auto& [variable, place] : places)
        nodes_.push_back(variable ? variables[place] : dynamics[place]);
      return record(variables);
    } catch (...) {
      S::abort_recording();
      throw;
    }
  }

 private:
  static void check(const char* what, std::size_t got, std::size_t expected) {
    if (got != 0) check_size(what, got, expected);
  }
  std::shared_ptr<const Recording<Base>> record(const std::vector<S>& variables) {
    for (std::size_t k = 0; k < graph_.constant_vec_size(); ++k)
      nodes_.push_back(S(Base(graph_.constant_vec_get(k))));
    std::size_t place = 0;
    for (std::size_t op = 0; op < graph_.operator_vec_size(); ++op)
      apply_use(read_use(graph_, op, place, nodes_.size()));
    std::vector<S> y;
    for (std::size_t i = 0; i < graph_.dependent_vec_size(); ++i) {
      const std::size_t node = graph_.dependent_vec_get(i);
      if (node == 0 || node > nodes_.size())
        refuse("from_graph: result " + std::to_string(i) + " is node " + std::to_string(node) +
               ", expected one of 1 to " + std::to_string(nodes_.size()));
      y.push_back(nodes_[node - 1]);
    }
    return end_recording(variables.data(), variables.size(), y.data(), y.size());
  }
  const S& node(const GraphUse& use, std::size_t k) const { return nodes_[use.nodes[k] - 1]; }

  void apply_use(const GraphUse& use) {
    switch (use.op) {
      case graph::print_graph_op:
        return record_print(node(use, 0), graph_.print_text_vec_get(use.name), node(use, 1),
                            graph_.print_text_vec_get(use.after));
      case graph::comp_eq_graph_op:
        return record_guard(Row::Eq, node(use, 0), node(use, 1));
      case graph::comp_le_graph_op:
        return record_guard(Row::Le, node(use, 0), node(use, 1));
      case graph::comp_lt_graph_op:
        return record_guard(Row::Lt, node(use, 0), node(use, 1));
      case graph::comp_ne_graph_op:
        return record_guard(Row::Ne, node(use, 0), node(use, 1));
      case graph::sum_graph_op: {
        S sum(0);
        for (std::size_t k = 0; k < use.nodes.size(); ++k) sum += node(use, k);
        return nodes_.push_back(sum);
      }
      case graph::discrete_graph_op:
        return nodes_.push_back(discrete_by_name(graph_.discrete_name_vec_get(use.name), node(use, 0)));
      case graph::atom_graph_op:
      case graph::atom4_graph_op:
        return apply_call(use);
      default:
        return apply_row(use);
    }
  }
  void apply_row(const GraphUse& use) {
    for (const GraphRow& row : kGraphRows) {
      if (row.graph != use.op) continue;
      const Row table = static_cast<Row>(row.op);
      const S &x = node(use, 0), &y = node(use, use.nodes.size() > 1 ? 1 : 0);
      const S value = apply(table, x, y, y);
      return nodes_.push_back(use.nodes.size() < 4 ? value
                                                   : apply(Row::Select, value, node(use, 2), node(use, 3)));
    }
  }
  void apply_call(const GraphUse& use) {
    std::vector<S> x;
    for (std::size_t k = 0; k < use.nodes.size(); ++k) x.push_back(node(use, k));
    for (const S& y : atomic_by_name(graph_.atomic_name_vec_get(use.name), use.call_id, x, use.n_result))
      nodes_.push_back(y);
  }

  const cpp_graph& graph_;
  std::vector<S> nodes_;
};

}  // namespace

template <class Base>
std::shared_ptr<const Recording<Base>> read_graph(const cpp_graph& graph,
                                                  const vector<bool>& dynamic_to_variable,
                                                  const vector<bool>& variable_to_dynamic) {
  return GraphReader<Base>(graph).read(dynamic_to_variable, variable_to_dynamic);
}
#define DYNTAPE_READ_GRAPH(Base)                                                                    \
  template std::shared_ptr<const Recording<Base>> read_graph(const cpp_graph&, const vector<bool>&, \
                                                             const vector<bool>&);
DYNTAPE_READ_GRAPH(float)
DYNTAPE_READ_GRAPH(double)
DYNTAPE_READ_GRAPH(AD<double>)

}  // namespace CppAD::inline dyntape_names::detail
