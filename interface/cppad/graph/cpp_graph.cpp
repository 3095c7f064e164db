// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/cppad/graph/cpp_graph.h>

#include <iomanip>
#include <map>
#include <nlohmann/json.hpp>

namespace CppAD::inline dyntape_names {

using graph::graph_op_enum;
using Json = nlohmann::ordered_json;

namespace detail {

const GraphOp& graph_op(graph_op_enum op) {
#define DYNTAPE_CPPAD_GRAPH_OP(name, n_arg) {#name, n_arg},
  static constexpr GraphOp kOps[] = {DYNTAPE_CPPAD_GRAPH_OPS(DYNTAPE_CPPAD_GRAPH_OP)};
#undef DYNTAPE_CPPAD_GRAPH_OP
  return kOps[op];
}

namespace {
bool compares(graph_op_enum op) { return op >= graph::comp_eq_graph_op && op <= graph::comp_ne_graph_op; }
bool calls(graph_op_enum op) { return op == graph::atom_graph_op || op == graph::atom4_graph_op; }
}  // namespace

GraphUse read_use(const cpp_graph& graph, std::size_t op, std::size_t& place, std::size_t n_nodes) {
  GraphUse use{graph.operator_vec_get(op)};
  const auto where = [&] { return "graph: operator " + std::to_string(op) + ", " + graph_op(use.op).name; };
  const auto next = [&] {
    if (place >= graph.operator_arg_size()) refuse(where() + ": its arguments are not all there");
    return graph.operator_arg_get(place++);
  };
  std::size_t n = graph_op(use.op).n_arg;
  if (use.op == graph::print_graph_op) use.name = next(), use.after = next(), use.n_result = 0, n = 2;
  if (compares(use.op)) use.n_result = 0, n = 2;
  if (use.op == graph::sum_graph_op) n = next();
  if (use.op == graph::discrete_graph_op) use.name = next(), n = 1;
  if (calls(use.op)) {
    use.name = next();
    if (use.op == graph::atom4_graph_op) use.call_id = next();
    use.n_result = next(), n = next();
  }
  for (std::size_t k = 0; k < n; ++k) {
    use.nodes.push_back(next());
    if (use.nodes[k] == 0 || use.nodes[k] > n_nodes)
      refuse(where() + ": argument " + std::to_string(k) + " is node " + std::to_string(use.nodes[k]) +
             ", expected one of 1 to " + std::to_string(n_nodes));
  }
  return use;
}

void append_use(cpp_graph& graph, const GraphUse& use) {
  graph.operator_vec_push_back(use.op);
  const auto put = [&](std::size_t argument) { graph.operator_arg_push_back(argument); };
  if (use.op == graph::print_graph_op) put(use.name), put(use.after);
  if (use.op == graph::sum_graph_op) put(use.nodes.size());
  if (use.op == graph::discrete_graph_op) put(use.name);
  if (calls(use.op)) {
    put(use.name);
    if (use.op == graph::atom4_graph_op) put(use.call_id);
    put(use.n_result), put(use.nodes.size());
  }
  for (std::size_t node : use.nodes) put(node);
}

namespace {

// The names in front of the arguments of a use in JSON.
Json names_of(const cpp_graph& graph, const GraphUse& use) {
  if (use.op == graph::discrete_graph_op) return {graph.discrete_name_vec_get(use.name)};
  if (calls(use.op)) return {graph.atomic_name_vec_get(use.name)};
  if (use.op == graph::print_graph_op)
    return {graph.print_text_vec_get(use.name), graph.print_text_vec_get(use.after)};
  return Json::array();
}

Json use_as_json(const cpp_graph& graph, const GraphUse& use, std::size_t code) {
  Json json = {code}, nodes = Json::array();
  for (std::size_t node : use.nodes) nodes.push_back(node);
  if (graph_op(use.op).n_arg > 0) {
    for (const auto& node : nodes) json.push_back(node);
    return json;
  }
  for (const auto& name : names_of(graph, use)) json.push_back(name);
  if (use.op == graph::atom4_graph_op) json.push_back(use.call_id);
  json.push_back(use.n_result), json.push_back(nodes.size()), json.push_back(nodes);
  return json;
}

// The index of a name, which is added where it is new.
#define DYNTAPE_CPPAD_NAME(vec)                                        \
  std::size_t place_in_##vec(cpp_graph& graph, const std::string& s) { \
    const std::size_t i = graph.vec##_find(s);                         \
    if (i == graph.vec##_size()) graph.vec##_push_back(s);             \
    return i;                                                          \
  }
DYNTAPE_CPPAD_NAME(atomic_name_vec)
DYNTAPE_CPPAD_NAME(discrete_name_vec)
DYNTAPE_CPPAD_NAME(print_text_vec)
#undef DYNTAPE_CPPAD_NAME

GraphUse use_from_json(cpp_graph& graph, graph_op_enum op, const Json& json) {
  GraphUse use{op};
  std::size_t k = 1;
  if (graph_op(op).n_arg > 0) {
    for (; k < json.size(); ++k) use.nodes.push_back(json.at(k).get<std::size_t>());
    return use;
  }
  const auto text = [&] { return json.at(k++).get<std::string>(); };
  if (op == graph::discrete_graph_op) use.name = place_in_discrete_name_vec(graph, text());
  if (calls(op)) use.name = place_in_atomic_name_vec(graph, text());
  if (op == graph::print_graph_op) {
    use.name = place_in_print_text_vec(graph, text());
    use.after = place_in_print_text_vec(graph, text());
  }
  if (op == graph::atom4_graph_op) use.call_id = json.at(k++).get<std::size_t>();
  use.n_result = json.at(k).get<std::size_t>();
  for (const auto& node : json.at(k + 2)) use.nodes.push_back(node.get<std::size_t>());
  return use;
}

std::map<std::string, graph_op_enum> ops_by_name() {
  std::map<std::string, graph_op_enum> ops;
  for (int op = 0; op < graph::n_graph_op; ++op) ops[graph_op(graph_op_enum(op)).name] = graph_op_enum(op);
  return ops;
}

// In CppAD's format a string is all characters up to the next quote, with neither escapes nor quotes, and numbers may begin with +.
std::string with_escapes(const std::string& text) {
  std::string escaped;
  bool inside = false;
  for (char c : text) {
    inside = inside != (c == '"');
    const bool in_exponent = !escaped.empty() && (escaped.back() == 'e' || escaped.back() == 'E');
    if (!inside && c == '+' && !in_exponent) continue;
    if (inside && c == '\n') {
      escaped += "\\n";
    } else if (inside && c == '\t') {
      escaped += "\\t";
    } else {
      if (inside && c == '\\') escaped += c;
      escaped += c;
    }
  }
  return escaped;
}
std::string without_escapes(const std::string& text) {
  std::string plain;
  for (std::size_t k = 0; k < text.size(); ++k) {
    const bool escapes = text[k] == '\\' && k + 1 < text.size();
    if (escapes) ++k;
    plain += escapes && text[k] == 'n' ? '\n' : escapes && text[k] == 't' ? '\t' : text[k];
  }
  return plain;
}

// [n, [...]]
const Json& list_of(const Json& json, const char* key) {
  const Json& pair = json.at(key);
  if (pair.at(0).get<std::size_t>() != pair.at(1).size())
    refuse("from_json: \"" + std::string(key) + "\" has " + std::to_string(pair.at(1).size()) +
           " entries, and says " + pair.at(0).dump());
  return pair.at(1);
}

}  // namespace
}  // namespace detail

void cpp_graph::print(std::ostream& out) const {
  using std::setw;
  std::size_t node = 0, place = 0;
  const auto line = [&](std::size_t number) -> std::ostream& {
    if (number == 0) return out << setw(11) << "";
    return out << setw(11) << number;
  };
  out << function_name_ << "\n";
  for (Size j = 0; j < n_dynamic_ind_; ++j)
    line(++node) << setw(10) << "p[" + std::to_string(j) + "]"
                 << "\n";
  for (Size j = 0; j < n_variable_ind_; ++j)
    line(++node) << setw(10) << "x[" + std::to_string(j) + "]"
                 << "\n";
  for (double c : constant_vec_) line(++node) << setw(10) << c << "\n";
  for (Size op = 0; op < operator_vec_.size(); ++op) {
    const detail::GraphUse use = detail::read_use(*this, op, place, node);
    line(use.n_result ? node + 1 : 0) << setw(10) << detail::graph_op(use.op).name;
    for (const auto& name : detail::names_of(*this, use)) out << " " << name;
    for (Size argument : use.nodes) out << setw(5) << argument;
    out << "\n";
    for (Size k = 1; k < use.n_result; ++k) line(node + 1 + k) << "\n";
    node += use.n_result;
  }
  out << "y nodes = ";
  for (Size i = 0; i < dependent_vec_.size(); ++i) out << (i ? ", " : "") << dependent_vec_[i];
  out << "\n";
}

std::string cpp_graph::to_json() const {
  Json json, defined = Json::array(), uses = Json::array();
  std::map<graph_op_enum, std::size_t> codes;
  std::size_t place = 0, n_nodes = n_dynamic_ind_ + n_variable_ind_ + constant_vec_.size();
  for (Size op = 0; op < operator_vec_.size(); ++op) {
    const detail::GraphUse use = detail::read_use(*this, op, place, n_nodes);
    const auto [code, added] = codes.try_emplace(use.op, codes.size() + 1);
    if (added) {
      const detail::GraphOp& row = detail::graph_op(use.op);
      Json definition = {{"op_code", code->second}, {"name", row.name}};
      if (row.n_arg > 0) definition["n_arg"] = row.n_arg;
      defined.push_back(definition);
    }
    uses.push_back(detail::use_as_json(*this, use, code->second));
    n_nodes += use.n_result;
  }
  const auto listed = [](const Json& list) { return Json{list.size(), list}; };
  json["function_name"] = function_name_;
  json["op_define_vec"] = listed(defined);
  json["n_dynamic_ind"] = n_dynamic_ind_;
  json["n_variable_ind"] = n_variable_ind_;
  json["constant_vec"] = listed(Json(std::vector<double>(constant_vec_.begin(), constant_vec_.end())));
  json["op_usage_vec"] = listed(uses);
  json["dependent_vec"] = listed(Json(std::vector<Size>(dependent_vec_.begin(), dependent_vec_.end())));
  return detail::without_escapes(json.dump(1)) + "\n";
}

cpp_graph cpp_graph::from_json(const std::string& text) {
  static const std::map<std::string, graph_op_enum> ops = detail::ops_by_name();
  cpp_graph graph;
  try {
    const Json json = Json::parse(detail::with_escapes(text));
    graph.function_name_ = json.at("function_name").get<std::string>();
    graph.n_dynamic_ind_ = json.at("n_dynamic_ind").get<Size>();
    graph.n_variable_ind_ = json.at("n_variable_ind").get<Size>();
    for (const auto& c : detail::list_of(json, "constant_vec"))
      graph.constant_vec_.push_back(c.get<double>());
    std::map<Size, graph_op_enum> defined;
    for (const auto& row : detail::list_of(json, "op_define_vec")) {
      const auto found = ops.find(row.at("name").get<std::string>());
      if (found == ops.end()) detail::refuse("from_json: there is no operator " + row.at("name").dump());
      defined[row.at("op_code").get<Size>()] = found->second;
    }
    for (const auto& use : detail::list_of(json, "op_usage_vec")) {
      const auto found = defined.find(use.at(0).get<Size>());
      if (found == defined.end())
        detail::refuse("from_json: op_code " + use.at(0).dump() + " is not in op_define_vec");
      detail::append_use(graph, detail::use_from_json(graph, found->second, use));
    }
    for (const auto& node : detail::list_of(json, "dependent_vec"))
      graph.dependent_vec_.push_back(node.get<Size>());
  } catch (const nlohmann::json::exception& error) {
    detail::refuse("from_json: " + std::string(error.what()));
  }
  return graph;
}

}  // namespace CppAD::inline dyntape_names
