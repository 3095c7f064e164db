// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/print/print_body.h>

#include <algorithm>
#include <string_view>
#include <unordered_map>
#include <unordered_set>

#include <dyntape/codegen/print/c_text.h>
#include <dyntape/codegen/schedule/gather.h>

namespace dyntape::codegen {
namespace {

constexpr char kBlockLetter[] = "xpw";

class BodyPrinter {
 public:
  BodyPrinter(std::string& text, const Function& function, const Schedule& schedule, const Piece& piece,
              const BodyStyle& style)
      : text_(text),
        function_(function),
        graph_(function.graph),
        schedule_(schedule),
        piece_(piece),
        style_(style) {}

  void run() {
    if (!schedule_.calls.empty()) find_read();
    if (style_.dialect.lanes || style_.dialect.device) find_pairs();
    if (style_.dialect.lanes && style_.dialect.functions != Functions::kLibm) find_teams();
    if (!style_.dialect.device) print_inputs();
    print_loads();
    for (std::size_t i = piece_.begin; i < piece_.end; ++i) {
      print_heading(i);
      if (style_.dialect.device) print_inputs_of(schedule_.steps[i]);
      print(schedule_.steps[i]);
    }
  }

 private:
  // What this piece reads: of the results of a long call it may be few.
  void find_read() {
    for (std::size_t i = piece_.begin; i < piece_.end; ++i) {
      const Step& step = schedule_.steps[i];
      if (step.kind == Step::Kind::kStore) read_.insert(function_.outputs[step.index]);
      if (step.kind == Step::Kind::kCheck) read_.insert(function_.guards[step.index].condition);
      if (step.kind != Step::Kind::kCompute || schedule_.long_call(step.index)) continue;
      graph_.for_each_argument(step.index, [&](NodeId a) { read_.insert(a); });
    }
    for (const Crossing& store : piece_.stores) read_.insert(store.node);
  }

  // Sines and cosines of one argument that this piece computes: one call gives both, with the bits of two (print_lanes.cpp).
  void find_pairs() {
    std::unordered_map<NodeId, NodeId> met;  // by argument, the first of the two
    for (std::size_t i = piece_.begin; i < piece_.end; ++i) {
      const Step& step = schedule_.steps[i];
      if (step.kind != Step::Kind::kCompute) continue;
      const Node& node = graph_[step.index];
      if (!is_turn(node.op) || graph_[node.a].op == Op::Const) continue;
      const auto [other, is_first] = met.emplace(node.a, step.index);
      if (!is_first) pairs_[other->second] = step.index, seconds_.insert(step.index);
    }
  }

  // Calls of one portable function, sine and cosine taken for one, that stand side by side and do not depend on each other.
  void find_teams() {
    std::vector<NodeId> calls, arguments;
    const auto close = [&] {
      if (arguments.size() > 1) {
        for (NodeId call : calls) {
          const auto place =
              std::find(arguments.begin(), arguments.end(), graph_[call].a) - arguments.begin();
          members_[call] = {calls[0], static_cast<std::uint32_t>(place)};
        }
        teams_[calls[0]] = arguments;
      }
      calls.clear(), arguments.clear();
    };
    for (std::size_t i = piece_.begin; i < piece_.end; ++i) {
      const Step& step = schedule_.steps[i];
      if (step.kind != Step::Kind::kCompute) continue;
      if (!is_gathered(graph_, step.index, style_.dialect.functions)) {
        close();
        continue;
      }
      const NodeId argument = graph_[step.index].a;
      const auto among = [&](const std::vector<NodeId>& nodes) {
        return std::find(nodes.begin(), nodes.end(), argument) != nodes.end();
      };
      const bool joins = !calls.empty() &&
                         team_operator(graph_[calls[0]].op) == team_operator(graph_[step.index].op) &&
                         !among(calls) && (among(arguments) || arguments.size() < kGathered);
      if (!joins) close();
      if (!among(arguments)) arguments.push_back(argument);
      calls.push_back(step.index);
    }
    close();
  }

  // DT_TURNS(m17, 3, x1, x2, x3, x3, x3, x3, x3, x3): places beyond the last repeat it.
  void print_team(NodeId first, const std::vector<NodeId>& arguments) {
    print(is_turn(graph_[first].op) ? "  DT_TURNS(m" : "  DT_MANY(" + function_of(first) + ", m", first);
    print(", ", arguments.size());
    for (std::size_t i = 0; i < kGathered; ++i) {
      print_name(", ", arguments[std::min(i, arguments.size() - 1)]);
    }
    text_ += ");\n";
  }

  // "m17, 2, x3": of its team, the how manieth, of what.
  void print_member(NodeId id) {
    const auto [team, place] = members_.at(id);
    print("m", team);
    print(", ", place);
    print_name(", ", graph_[id].a);
  }

  std::string function_of(NodeId id) const { return std::string(info(graph_[id].op).function); }

  void print_pair(NodeId first, NodeId second) {
    print_name("  real ", first);
    print_name(", ", second);
    if (members_.count(first)) {
      text_ += ";\n  DT_TURN(";
      print_member(first);
    } else {
      text_ += ";\n  dt_sincos(";
      name(graph_[first].a);
    }
    const bool is_sine = graph_[first].op == Op::Sin;
    print_name(", &", is_sine ? first : second);
    print_name(", &", is_sine ? second : first);
    text_ += ");\n";
  }

  void print_inputs() {
    for (int block = 0; block < kBlocks; ++block) {
      if (!piece_.inputs[block].empty()) heading("inputs: " + style_.inputs[block]);
      for (std::uint32_t index : piece_.inputs[block]) print_input(block, index);
    }
  }

  void print_input(int block, std::uint32_t index) {
    const auto& names = function_.input_names[block];
    text_ += "  const real ";
    text_ += kBlockLetter[block];
    append_integer(text_, index);
    const bool fills = style_.constant_parameters && block == static_cast<int>(Block::kParameters);
    text_ += fills ? " = DT_ALL(" : " = ";
    print(style_.inputs[block] + "[", index);
    text_ += style_.read.stride;
    text_ += fills ? "]);" : "];";
    if (index < names.size() && !names[index].empty()) text_ += " /* " + c_comment(names[index]) + " */";
    text_ += '\n';
  }

  // For a device an input is read where it is used first.
  void print_inputs_of(const Step& step) {
    const auto read = [&](NodeId a) {
      const Node& node = graph_[a];
      if (node.op == Op::Input && inputs_.insert(a).second) print_input(node.a, node.b);
    };
    if (step.kind == Step::Kind::kStore) return read(function_.outputs[step.index]);
    if (step.kind == Step::Kind::kCheck) return read(function_.guards[step.index].condition);
    if (graph_[step.index].op != Op::Result) graph_.for_each_argument(step.index, read);
  }

  void print_loads() {
    if (!piece_.loads.empty()) heading("from earlier pieces");
    for (const Crossing& load : piece_.loads) {
      print_name("  const real ", load.node);
      print(" = work[", load.slot);
      text_ += "];\n";
    }
  }

  void heading(const std::string& what) { text_ += "  /* --- " + what + " --- */\n"; }

  void print_heading(std::size_t step) {
    for (const Section& section : schedule_.sections) {
      const bool starts = section.begin == step, continues = step == piece_.begin && section.begin < step;
      if (!(starts || continues) || section.end <= step) continue;
      const std::string count = std::to_string(section.end - section.begin);
      heading(section.group == Section::kShared ? "shared (" + count + " steps)"
                                                : style_.outputs[section.group].heading);
    }
  }

  void print(const Step& step) {
    switch (step.kind) {
      case Step::Kind::kCompute:
        print_compute(step.index);
        break;
      case Step::Kind::kStore: {
        const OutputArray& array = array_of(step.index);
        print("  " + array.name + "[", array.place(step.index));
        text_ += style_.written.stride;
        text_ += "] = ";
        value(function_.outputs[step.index]);
        text_ += ";\n";
        break;
      }
      case Step::Kind::kCheck:
        print_check(step.index);
    }
  }

  void print_compute(NodeId id) {
    const Node& node = graph_[id];
    if (node.op == Op::Call) return print_call(id);
    const CallPlace* place = node.op == Op::Result ? schedule_.long_call(node.a) : nullptr;
    if (place && !read_.count(id)) return;
    if (const auto team = teams_.find(id); team != teams_.end()) print_team(id, team->second);
    if (const auto pair = pairs_.find(id); pair != pairs_.end())
      print_pair(id, pair->second);
    else if (!seconds_.count(id))
      print_definition(id, node, place);
    auto store = std::lower_bound(piece_.stores.begin(), piece_.stores.end(), id,
                                  [](const Crossing& c, NodeId key) { return c.node < key; });
    for (; store != piece_.stores.end() && store->node == id; ++store) print_work(store->slot, id);
  }

  void print_definition(NodeId id, const Node& node, const CallPlace* place) {
    print_name("  const real ", id);
    text_ += " = ";
    if (place) {
      print("work[", place->out + node.b);
      text_ += ']';
    } else if (node.op == Op::Result) {
      print("c", node.a);
      print("[", node.b);
      text_ += ']';
    } else if (members_.count(id)) {
      text_ += "DT_OF(" + function_of(id) + ", ";
      print_member(id);
      text_ += ')';
    } else {
      expression(node);
    }
    text_ += ";\n";
  }

  void print_work(std::uint32_t slot, NodeId id) {
    print("  work[", slot);
    text_ += "] = ";
    value(id);
    text_ += ";\n";
  }

  // The operator's spelling with the names of the arguments put in.
  void expression(const Node& node) {
    const std::string_view spelling = info(node.op).c;
    for (std::size_t i = 0; i < spelling.size(); ++i) {
      if (spelling[i] == '$') {
        name(node.argument(spelling[++i] - '0'));
      } else {
        text_ += spelling[i];
        // Its constants are small integers written as 1.0.
        if (style_.dialect.single && spelling.substr(i).starts_with(".0"))
          text_ += spelling[++i], text_ += 'f';
      }
    }
  }

  // Its arguments and results are in their places, but for what no piece computes.
  void print_long_call(NodeId id, const CallPlace& place) {
    const Callee& callee = *graph_.callees()[graph_[id].a];
    std::uint32_t slot = place.in;
    const std::size_t end = slot + stored_arguments(graph_, id);
    std::string constants;
    std::size_t count = 0;
    graph_.for_each_argument(id, [&](NodeId a) {
      if (slot == end) {
        constants += constants.empty() ? "" : count % 8 ? ", " : ",\n      ";
        ++count;
        append_number(constants, graph_.constant_value(a));
        return;
      }
      if (graph_[a].op == Op::Const || graph_[a].op == Op::Input) print_work(slot, a);
      ++slot;
    });
    if (count) {
      print("  static const double k", id);
      text_ += '[' + std::to_string(count) + "] = {" + constants + "};\n";
    }
    print("  " + called(callee) + "(work + ", place.in);
    if (place.outputs == CallPlace::kInWork) {
      print(", work + ", place.out);
    } else {
      const OutputArray& array = array_of(place.outputs);
      print(", " + array.name + " + ", place.outputs - array.begin);
    }
    if (count) print(", k", id);
    for (const OutputRun& run : place.runs) {
      const OutputArray& array = array_of(run.first);
      print(", " + array.name + " + ", run.first - array.begin);
    }
    close_call(callee);
  }

  std::string called(const Callee& callee) const {
    const std::string& function = style_.callees.at(&callee).name;
    return style_.dialect.lanes ? "DT_NAME(" + function + ")" : function;
  }

  // The callee's work array lies behind the caller's own slots.
  void close_call(const Callee& callee) {
    if (style_.callees.at(&callee).work) print(", work + ", schedule_.work);
    text_ += ");\n";
  }

  const OutputArray& array_of(std::size_t k) const {
    return *std::find_if(style_.outputs.begin(), style_.outputs.end(),
                         [&](const OutputArray& a) { return k >= a.begin && k < a.end; });
  }

  void append_constant(double constant) {
    if (style_.dialect.single) return append_single(text_, constant);
    append_number(text_, constant);
  }

  void print_call(NodeId id) {
    if (const CallPlace* place = schedule_.long_call(id)) return print_long_call(id, *place);
    const Callee& callee = *graph_.callees()[graph_[id].a];
    print("  real c", id);
    text_ += '[' + std::to_string(std::max<std::size_t>(callee.n_out, 1)) + "];\n";
    if (callee.n_in) {
      print("  const real a", id);
      text_ += '[' + std::to_string(callee.n_in) + "] = {";
      bool first = true;
      graph_.for_each_argument(id, [&](NodeId a) {
        if (!first) text_ += ", ";
        first = false;
        value(a);
      });
      text_ += "};\n";
    }
    print("  " + called(callee) + "(" + (callee.n_in ? "a" + std::to_string(id) : "0") + ", c", id);
    close_call(callee);
  }

  // Of several violated guards the first is reported, in whatever order they are met.
  void print_check(std::uint32_t k) {
    const Guard& guard = function_.guards[k];
    text_ += "  DT_CHECK(";
    value(guard.condition);
    text_ += guard.expected ? " == " : " != ";
    append_constant(0);
    text_ += ", " + std::to_string(k + 1) + "u); /* " + c_comment(guard.file) + ":" +
             std::to_string(guard.line) + " */\n";
  }

  // A constant by itself has to fill the lanes; in an expression C does that.
  void value(NodeId id) {
    const bool is_constant = style_.dialect.lanes && graph_[id].op == Op::Const;
    if (is_constant) text_ += "DT_ALL(";
    name(id);
    if (is_constant) text_ += ')';
  }

  void print(std::string_view words, std::uint64_t number) {
    text_ += words;
    append_integer(text_, number);
  }

  void print_name(std::string_view words, NodeId id) {
    text_ += words;
    name(id);
  }

  void name(NodeId id) {
    const Node& node = graph_[id];
    if (node.op == Op::Const) return append_constant(graph_.constant_value(id));
    text_ += node.op == Op::Input ? kBlockLetter[node.a] : 't';
    append_integer(text_, node.op == Op::Input ? node.b : id);
  }

  std::string& text_;
  const Function& function_;
  const Graph& graph_;
  const Schedule& schedule_;
  const Piece& piece_;
  const BodyStyle& style_;
  std::unordered_set<NodeId> read_;    // where there are long calls
  std::unordered_set<NodeId> inputs_;  // of a device: those that are printed
  std::unordered_map<NodeId, NodeId> pairs_;
  std::unordered_set<NodeId> seconds_;                     // of the pairs
  std::unordered_map<NodeId, std::vector<NodeId>> teams_;  // arguments, by the first call
  std::unordered_map<NodeId, std::pair<NodeId, std::uint32_t>>
      members_;  // the first of its team, and which argument
};

}  // namespace

void append_piece(std::string& text, const Function& function, const Schedule& schedule, std::size_t piece,
                  const BodyStyle& style) {
  BodyPrinter(text, function, schedule, schedule.pieces[piece], style).run();
}

}  // namespace dyntape::codegen
