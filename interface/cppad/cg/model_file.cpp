// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/cppad/cg/detail/model_file.hxx>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

namespace CppAD::inline dyntape_names::cg {

namespace {

using Json = nlohmann::ordered_json;

constexpr char kFormat[] = "dyntape models 1";

Json json_of(double x) {
  if (std::isfinite(x)) return x;
  return std::isnan(x) ? "nan" : x > 0 ? "inf" : "-inf";
}

double number_from(const Json& json) {
  if (!json.is_string()) return json.get<double>();
  const double infinity = std::numeric_limits<double>::infinity();
  const auto& word = json.get_ref<const std::string&>();
  return word == "inf" ? infinity : word == "-inf" ? -infinity : std::numeric_limits<double>::quiet_NaN();
}

Json json_of(const std::vector<double>& values) {
  Json list = Json::array();
  for (double x : values) list.push_back(json_of(x));
  return list;
}

std::vector<double> numbers_from(const Json& json) {
  std::vector<double> values;
  for (const Json& x : json) values.push_back(number_from(x));
  return values;
}

// A node is its operator's name with its arguments: ["Const", 0.5], ["Input", block, index], ["Mul", 3, 4].
Json json_of_node(const Graph& graph, NodeId id) {
  const Node& node = graph[id];
  Json json = {std::string(info(node.op).name)};
  if (node.op == Op::Const) {
    json.push_back(json_of(graph.constant_value(id)));
  } else if (node.op == Op::Input) {
    json.push_back(node.a), json.push_back(node.b);
  } else {
    for (int i = 0; i < info(node.op).arity; ++i) json.push_back(node.argument(i));
  }
  return json;
}

std::optional<Op> op_named(const std::string& name) {
  for (int k = 0; k < static_cast<int>(kTableOps); ++k) {
    if (info(static_cast<Op>(k)).name == name) return static_cast<Op>(k);
  }
  return {};
}

NodeId node_from(const Json& json, Graph& graph, const std::vector<NodeId>& nodes) {
  const std::string name = json.at(0);
  if (name == "Const") return graph.constant(number_from(json.at(1)));
  if (name == "Input") {
    const auto block = json.at(1).get<std::uint8_t>();
    if (block >= kBlocks) throw FileError("there is no block " + std::to_string(block) + " of inputs");
    return graph.input(static_cast<Block>(block), json.at(2));
  }
  const auto op = op_named(name);
  if (!op) throw FileError("there is no operator \"" + name + "\"");
  NodeId arguments[3] = {kNoNode, kNoNode, kNoNode};
  for (int i = 0; i < info(*op).arity; ++i) arguments[i] = nodes.at(json.at(i + 1).get<std::size_t>());
  return graph.make(*op, arguments[0], arguments[1], arguments[2]);
}

Json json_of(const Function& function) {
  Json json = {{"inputs", function.inputs}, {"nodes", Json::array()}, {"outputs", function.outputs}};
  for (NodeId id = 0; id < function.graph.size(); ++id)
    json["nodes"].push_back(json_of_node(function.graph, id));
  Json guards = Json::array();
  for (const Guard& guard : function.guards)
    guards.push_back({guard.condition, guard.expected, guard.file, guard.line});
  json["guards"] = guards;
  return json;
}

Function function_from(const Json& json) {
  Function function;
  json.at("inputs").get_to(function.inputs);
  std::vector<NodeId> nodes;
  for (const Json& node : json.at("nodes")) nodes.push_back(node_from(node, function.graph, nodes));
  const auto node_at = [&](const Json& id) { return nodes.at(id.get<std::size_t>()); };
  for (const Json& id : json.at("outputs")) function.outputs.push_back(node_at(id));
  for (const Json& guard : json.at("guards"))
    function.guards.push_back({node_at(guard.at(0)), guard.at(1).get<bool>(), guard.at(2).get<std::string>(),
                               guard.at(3).get<int>()});
  check(function);
  return function;
}

Json json_of(const ModelChoice& c) {
  return {{"created",
           {c.forward_zero, c.jacobian, c.hessian, c.sparse_jacobian, c.sparse_hessian, c.forward_one,
            c.reverse_one, c.reverse_two}},
          {"jacobian", {c.jacobian_rows, c.jacobian_cols}},
          {"hessian", {c.hessian_rows, c.hessian_cols}}};
}

ModelChoice choice_from(const Json& json) {
  ModelChoice c;
  const Json& created = json.at("created");
  std::size_t k = 0;
  for (bool* flag : {&c.forward_zero, &c.jacobian, &c.hessian, &c.sparse_jacobian, &c.sparse_hessian,
                     &c.forward_one, &c.reverse_one, &c.reverse_two})
    *flag = created.at(k++);
  json.at("jacobian").at(0).get_to(c.jacobian_rows), json.at("jacobian").at(1).get_to(c.jacobian_cols);
  json.at("hessian").at(0).get_to(c.hessian_rows), json.at("hessian").at(1).get_to(c.hessian_cols);
  return c;
}

Json json_of(const ModelState& model) {
  const Function& function = model.function.function();
  return {{"name", model.name},
          {"order", static_cast<int>(model.function.order())},
          {"choice", json_of(model.choice)},
          {"variables", json_of(model.recording->variables)},
          {"dynamics", json_of(model.recording->dynamics)},
          {"function", json_of(function)},
          {"hash", content_hash(function)}};
}

std::shared_ptr<const ModelState> model_from(const Json& json, CodegenOptions how) {
  Function function = function_from(json.at("function"));
  if (content_hash(function) != json.at("hash").get<std::string>())
    throw FileError("its functions have been changed");
  function.name = json.at("name").get<std::string>();
  how.order = static_cast<Order>(json.at("order").get<int>());
  auto recording = std::make_shared<detail::Recording<double>>();
  recording->function = std::make_shared<const Function>(function);
  recording->range = function.n_y();
  for (const Guard& guard : function.guards) recording->guard_places.push_back(guard.condition);
  recording->variables = numbers_from(json.at("variables"));
  recording->dynamics = numbers_from(json.at("dynamics"));
  if (recording->variables.size() != function.n_x() || recording->dynamics.size() != function.n_p())
    throw FileError("its sizes do not match");
  const std::string name = function.name;
  return std::make_shared<const ModelState>(name, choice_from(json.at("choice")),
                                            CompiledFunction::make(std::move(function), how), recording);
}

bool is_of_this_kind(const std::string& path) {
  try {
    return std::filesystem::is_regular_file(path) && read_file(path).find(kFormat) != std::string::npos;
  } catch (const Error&) {
    return false;
  }
}

}  // namespace

void write_models(const std::string& path, const Models& models, const CodegenOptions& how) {
  for (const auto& [name, model] : models) {
    if (model->recording->kernels.empty() && model->function.function().graph.callees().empty()) continue;
    if (is_of_this_kind(path)) std::filesystem::remove(path);
    return;
  }
  Json json = {
      {"format", kFormat}, {"compiler", how.compiler}, {"flags", how.flags}, {"models", Json::array()}};
  for (const auto& [name, model] : models) json["models"].push_back(json_of(*model));
  write_file_atomically(path, json.dump() + "\n");
}

Models models_of_file(const std::string& path) {
  const std::string text = read_file(path);
  try {
    const Json json = Json::parse(text);
    if (json.at("format") != kFormat) throw FileError("it has another format");
    CodegenOptions how;
    how.compiler = json.at("compiler").get<std::string>();
    json.at("flags").get_to(how.flags);
    Models models;
    for (const Json& model : json.at("models")) {
      auto state = model_from(model, how);
      models[state->name] = state;
    }
    return models;
  } catch (const ToolError&) {
    throw;
  } catch (const std::exception& e) {
    const bool ours = dynamic_cast<const Error*>(&e) != nullptr;
    throw FileError(path + ": this is no library of models that createDynamicLibrary wrote" +
                    (ours ? std::string(": ") + e.what() : "") + "; create it again");
  }
}

}  // namespace CppAD::inline dyntape_names::cg
