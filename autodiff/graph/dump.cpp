// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/graph/dump.h>

#include <charconv>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/graph/callee.h>

namespace dyntape {
namespace {

// The shortest digits that read back as the same number, whatever the locale.
std::string number(double value) {
  char text[40];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

std::string input_name(const Function& f, const Node& node) {
  const char* const letters[] = {"x", "p", "w"};
  const auto& names = f.input_names[node.a];
  return node.b < names.size() ? names[node.b] : letters[node.a] + ("[" + std::to_string(node.b) + "]");
}

std::string output_name(const Function& f, std::size_t i) {
  return i < f.output_names.size() ? f.output_names[i] : "y[" + std::to_string(i) + "]";
}

// What a node is, without its arguments.
std::string title(const Function& f, NodeId id) {
  const Node& node = f.graph[id];
  switch (node.op) {
    case Op::Const:
      return number(f.graph.constant_value(id));
    case Op::Input:
      return input_name(f, node);
    case Op::Call:
      return "Call " + f.graph.callees()[node.a]->name;
    case Op::Result:
      return "Result " + std::to_string(node.b);
    default:
      return std::string(info(node.op).name);
  }
}

std::string name_of(NodeId id) { return "n" + std::to_string(id); }

std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += c;
  }
  return result + "\"";
}

}  // namespace

std::string to_text(const Function& function) {
  const Function f = compact(function);
  std::string out = f.name + ": " + std::to_string(f.n_x()) + " variables, " + std::to_string(f.n_p()) +
                    " parameters, " + std::to_string(f.n_w()) + " weights -> " + std::to_string(f.n_y()) +
                    " outputs\n";
  for (NodeId id = 0; id < f.graph.size(); ++id) {
    out += "  " + name_of(id) + " = " + title(f, id);
    const char* separator = " ";
    f.graph.for_each_argument(id, [&](NodeId a) {
      out += separator + name_of(a);
      separator = ", ";
    });
    out += "\n";
  }
  for (std::size_t i = 0; i < f.n_y(); ++i)
    out += "  " + output_name(f, i) + " = " + name_of(f.outputs[i]) + "\n";
  for (const Guard& guard : f.guards) {
    out += "  guard " + name_of(guard.condition) + (guard.expected ? " != 0" : " == 0") + "  (" + guard.file +
           ":" + std::to_string(guard.line) + ")\n";
  }
  return out;
}

std::string to_dot(const Function& function, std::size_t most) {
  const Function f = compact(function);
  if (f.graph.size() > most) {
    throw ArgumentError("to_dot: \"" + f.name + "\" has " + std::to_string(f.graph.size()) +
                        " nodes, more than the " + std::to_string(most) + " asked for");
  }
  std::string out = "digraph " + quoted(f.name) + " {\n  rankdir=BT;\n";
  for (NodeId id = 0; id < f.graph.size(); ++id) {
    const bool leaf = f.graph[id].op == Op::Input || f.graph[id].op == Op::Const;
    out += "  " + name_of(id) + " [label=" + quoted(title(f, id)) + (leaf ? ", shape=box" : "") + "];\n";
    f.graph.for_each_argument(id, [&](NodeId a) { out += "  " + name_of(a) + " -> " + name_of(id) + ";\n"; });
  }
  for (std::size_t i = 0; i < f.n_y(); ++i) {
    const std::string y = "y" + std::to_string(i);
    out += "  " + y + " [label=" + quoted(output_name(f, i)) + ", shape=box, style=bold];\n";
    out += "  " + name_of(f.outputs[i]) + " -> " + y + ";\n";
  }
  return out + "}\n";
}

}  // namespace dyntape
