// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/print/print_pieces.h>

#include <algorithm>

#include <dyntape/codegen/print/c_text.h>

namespace dyntape::codegen {
namespace {

// All callees that the kernels reach, each after those it calls itself.  An explicit stack: calls nest.
std::vector<const Callee*> collect_callees(const std::vector<KernelPlan>& kernels) {
  std::vector<const Callee*> order, stack;
  std::map<const Callee*, bool> done;
  const auto push_all = [&](const Graph& graph) {
    for (const auto& callee : graph.callees()) stack.push_back(callee.get());
  };
  for (const KernelPlan& kernel : kernels) push_all(kernel.derivatives.function.graph);
  while (!stack.empty()) {
    const Callee* callee = stack.back();
    const auto [entry, is_new] = done.emplace(callee, false);
    if (is_new && callee->recorded()) {
      push_all(callee->recorded()->function->graph);
      continue;
    }
    stack.pop_back();
    if (!entry->second) order.push_back(callee);
    entry->second = true;
  }
  return order;
}

}  // namespace

std::vector<OutputArray> outputs_of(const Derivatives& d) {
  const auto heading = [](const char* what, const Pattern& pattern, std::size_t places) {
    return std::string(what) + " (" + std::to_string(pattern.nnz()) + " of " + std::to_string(places) +
           " entries)";
  };
  const std::size_t j = d.n_y, h = j + d.jacobian.nnz(), end = h + d.hessian.nnz();
  std::vector<OutputArray> outputs = {{kOutputNames[0], "value (" + std::to_string(d.n_y) + ")", 0, j}};
  if (d.order >= Order::kFirst)
    outputs.push_back(
        {kOutputNames[1], heading("Jacobian", d.jacobian, d.jacobian.rows * d.jacobian.cols), j, h});
  if (d.order >= Order::kSecond)
    outputs.push_back(
        {kOutputNames[2],
         heading("lower triangle of the Hessian", d.hessian, d.hessian.rows * (d.hessian.rows + 1) / 2), h,
         end});
  return outputs;
}

PieceFunctions::PieceFunctions(const std::vector<KernelPlan>& kernels, std::size_t piece_statements,
                               Dialect dialect)
    : piece_statements_(piece_statements), dialect_(dialect), callees_(collect_callees(kernels)) {
  // The number stands in front, where no other name of the text has one: a callee may be called anything.
  for (std::size_t k = 0; k < callees_.size(); ++k)
    texts_[callees_[k]].name = "dt_" + std::to_string(k + 1) + "_" + c_identifier(callees_[k]->name);
  for (const KernelPlan& kernel : kernels) {
    const Graph& graph = kernel.derivatives.function.graph;
    for (const CallPlace& place : kernel.schedule.calls)
      runs_[graph.callees()[graph[place.call].a].get()] = place.runs;
  }
  for (const Callee* callee : callees_) add_callee(*callee);
}

std::string PieceFunctions::named(const std::string& name) const {
  return dialect_.lanes ? "DT_NAME(" + name + ")" : name;
}

void PieceFunctions::add(const std::string& declaration, Definition definition) {
  definition.declaration = "DT_PIECE " + declaration;
  if (definition.head.empty()) definition.head = definition.declaration;
  definitions_.push_back(std::move(definition));
}

std::size_t PieceFunctions::work(const Function& function, const Schedule& schedule) const {
  std::size_t most = 0;
  for (const auto& callee : function.graph.callees()) most = std::max(most, texts_.at(callee.get()).work);
  return schedule.work + most;
}

void PieceFunctions::add_callee(const Callee& callee) {
  auto& [name, callee_work] = texts_.at(&callee);
  Definition d;
  d.body = "  (void)in;\n  (void)out;\n";
  const std::string type = dialect_.lanes ? "reals" : "real";
  std::string parameters = "\n    const " + type + "* DT_RESTRICT in, " + type + "* DT_RESTRICT out";
  auto& [values, frames] = depth_[&callee];
  const Kernel* const kernel = callee.kernel();
  if (!kernel) {
    const Function& function = *callee.recorded()->function;
    const std::vector<OutputArray> outputs = outputs_of_part(callee);
    const Schedule s = schedule(function, {{0, function.n_y()}}, piece_statements_, dialect_.functions,
                                dialect_.device ? StatementOrder::kFewLive : StatementOrder::kRecorded);
    const BodyStyle style{{"in", "constants", ""}, outputs, texts_, dialect_, callee.is_part()};
    if (function.n_p()) {
      parameters += ", const double* constants";
      d.body += "  (void)constants;\n";
    }
    for (const OutputArray& array : outputs) {
      if (array.places.empty()) continue;
      parameters += ", " + type + "* DT_RESTRICT " + array.name;
    }
    const std::size_t first = definitions_.size();
    callee_work = work(function, s);
    if (s.pieces.size() == 1) {
      const Definition alone = measured(function, s.pieces[0], s);
      d.values = alone.values, d.frames = alone.frames;
      append_piece(d.body, function, s, 0, style);
    } else {
      d.body += add_pieces(name, function, s, style, "", "  ");
      for (std::size_t k = first; k < definitions_.size(); ++k) {
        d.values = std::max(d.values, definitions_[k].values);
        d.frames = std::max(d.frames, definitions_[k].frames + 1);
      }
    }
  } else if (dialect_.lanes && !kernel->c_body_of_lanes.empty()) {
    d.body += "#if DYNTAPE_LANES == 1\n" + kernel->c_body + "#else\n" + kernel->c_body_of_lanes + "#endif\n";
  } else if (dialect_.device && !kernel->c_body_of_lanes.empty()) {
    d.body += kernel->c_body_of_lanes;
  } else {
    d.body += kernel->c_body + "\n";
    d.head =
        "DT_KERNEL(" + name + ", " + std::to_string(callee.n_in) + ", " + std::to_string(callee.n_out) + ")";
    // In lanes, which are two at least, the arguments and results of one of them.
    if (dialect_.lanes) callee_work = (callee.n_in + callee.n_out) / 2 + 1;
  }
  if (callee_work) parameters += ", " + type + "* DT_RESTRICT work";
  values = d.values, frames = d.frames;
  d.statements = static_cast<std::size_t>(std::count(d.body.begin(), d.body.end(), '\n'));
  add("void " + named(name) + "(" + parameters + ")", std::move(d));
}

// What is written through `out` and, of a part, what through a pointer to outputs.
std::vector<OutputArray> PieceFunctions::outputs_of_part(const Callee& callee) const {
  std::vector<OutputArray> arrays;
  const auto found = runs_.find(&callee);
  if (found != runs_.end()) {
    for (const OutputRun& run : found->second)
      arrays.push_back(
          {"y_" + std::to_string(arrays.size() + 1), "results", run.begin, run.end, run.offsets});
  }
  arrays.push_back({"out", "results", 0, callee.n_out, {}});
  return arrays;
}

std::string PieceFunctions::add_pieces(const std::string& name, const Function& function, const Schedule& s,
                                       const BodyStyle& style, const std::string& suffix,
                                       const std::string& indent) {
  std::string calls;
  for (std::size_t k = 0; k < s.pieces.size(); ++k) {
    const std::string piece = named(name + "_" + std::to_string(k + 1));
    Definition d = measured(function, s.pieces[k], s);
    append_piece(d.body, function, s, k, style);
    d.statements = s.pieces[k].end - s.pieces[k].begin;
    const auto [parameters, arguments] = signature(function, s, s.pieces[k], style, suffix);
    add("void " + piece + "(" + parameters + ")", std::move(d));
    calls += indent + piece + "(" + arguments + ");\n";
  }
  return calls;
}

// Parameters of the function for a piece, and what its caller passes: only what it uses.
std::pair<std::string, std::string> PieceFunctions::signature(const Function& function,
                                                              const Schedule& schedule, const Piece& piece,
                                                              const BodyStyle& style,
                                                              const std::string& suffix) const {
  const std::string type = dialect_.lanes ? "reals" : "real";
  std::string parameters, arguments;
  const auto add = [&](const std::string& kind, const std::string& name, const std::string& argument) {
    parameters += (parameters.empty() ? "\n    " : ", ") + kind + name;
    arguments += (arguments.empty() ? "" : ", ") + argument;
  };
  for (int block = 0; block < kBlocks; ++block) {
    const bool is_plain = style.constant_parameters && block == static_cast<int>(Block::kParameters);
    if (!piece.inputs[block].empty())
      add(style.read.space + "const " + (is_plain ? "double" : type) + "* DT_RESTRICT ", style.inputs[block],
          style.inputs[block] + suffix);
  }
  const std::size_t strided = style.read.stride.empty() ? 0 : parameters.size();
  std::vector<bool> writes(style.outputs.size(), false);
  bool checks = false, works = !piece.loads.empty() || !piece.stores.empty();
  for (std::size_t i = piece.begin; i < piece.end; ++i) {
    const Step& step = schedule.steps[i];
    checks = checks || step.kind == Step::Kind::kCheck;
    const CallPlace* place = step.kind == Step::Kind::kCompute ? schedule.long_call(step.index) : nullptr;
    const bool calls = step.kind == Step::Kind::kCompute && function.graph[step.index].op == Op::Call;
    works = works || place ||
            (calls && texts_.at(function.graph.callees()[function.graph[step.index].a].get()).work);
    const auto written = [&](std::size_t output) {
      for (std::size_t g = 0; g < writes.size(); ++g) {
        if (output < style.outputs[g].begin || output >= style.outputs[g].end) continue;
        writes[g] = true;
        return;
      }
    };
    if (step.kind == Step::Kind::kStore) written(step.index);
    if (place) {
      written(place->outputs);
      for (const OutputRun& run : place->runs) written(run.first);
    }
  }
  for (std::size_t g = 0; g < writes.size(); ++g) {
    if (writes[g])
      add(style.written.space + type + "* DT_RESTRICT ", style.outputs[g].name,
          style.outputs[g].name + suffix);
  }
  const bool is_written = std::find(writes.begin(), writes.end(), true) != writes.end();
  if (strided || (is_written && !style.written.stride.empty())) add("const dt_count ", "count", "count");
  if (works) add(type + "* DT_RESTRICT ", "work", "work" + suffix);
  if (checks) add("dt_words* ", "guard", "&guard");
  return {parameters.empty() ? "void" : parameters, arguments};
}

PieceFunctions::Definition PieceFunctions::measured(const Function& function, const Piece& piece,
                                                    const Schedule& schedule) const {
  Definition d;
  std::size_t values = 0, frames = 0;  // of the deepest callee
  for (const auto& inputs : piece.inputs) d.values += inputs.size();
  d.values += piece.loads.size();
  for (std::size_t i = piece.begin; i < piece.end; ++i) {
    const Step& step = schedule.steps[i];
    if (step.kind != Step::Kind::kCompute) continue;
    ++d.values;
    const Node& node = function.graph[step.index];
    if (node.op != Op::Call) continue;
    const Callee& callee = *function.graph.callees()[node.a];
    if (!schedule.long_call(step.index)) d.values += callee.n_in + callee.n_out;
    values = std::max(values, depth_.at(&callee).first);
    frames = std::max(frames, depth_.at(&callee).second);
  }
  d.values += values;
  d.frames += frames;
  return d;
}

}  // namespace dyntape::codegen
