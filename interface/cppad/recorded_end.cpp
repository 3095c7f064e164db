// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/cppad/detail/tape.h>

namespace dyntape::cppad {

template <class Base>
void AD<Base>::abort_recording() {
  detail::set_open_tape<Base>(nullptr);
}

namespace detail {

namespace {

template <class Base>
void check_independents(const Tape<Base>& tape, const AD<Base>* x, std::size_t n_x) {
  if (n_x != tape.variables.size()) {
    refuse("ADFun: x has " + std::to_string(n_x) + " entries, Independent had " +
           std::to_string(tape.variables.size()));
  }
  for (std::size_t i = 0; i < n_x; ++i) {
    if (x[i].tape() == tape.serial && tape.graph[x[i].id()] == Node{Op::Input, 0, NodeId(i), kNoNode})
      continue;
    refuse("ADFun: x[" + std::to_string(i) +
           "] is not the independent variable that Independent made of it: it has been assigned since");
  }
}

template <class Base>
RecordingSizes sizes_of(const Function& function, const std::vector<Print>& prints) {
  Tape<Base> kinds;  // of the nodes that are left
  kinds.graph = function.graph;
  RecordingSizes sizes;
  for (NodeId id = 0; id < function.graph.size(); ++id) {
    const Kind kind = kinds.kind(id);
    const Op op = function.graph[id].op;
    std::size_t arguments = 0;
    function.graph.for_each_argument(id, [&](NodeId) { ++arguments; });
    sizes.constants += op == Op::Const;
    sizes.operations += kind == Kind::kVariable;
    sizes.variables += kind == Kind::kVariable && op != Op::Call;
    sizes.dynamics += kind == Kind::kDynamic;
    (kind == Kind::kDynamic ? sizes.dynamic_arguments : sizes.arguments) += arguments;
  }
  sizes.dynamics = std::max(sizes.dynamics, function.n_p());
  sizes.variables = std::max(sizes.variables, function.n_x());
  sizes.operations = std::max(sizes.operations, function.n_x());
  for (const Print& print : prints) sizes.text += print.before.size() + print.after.size() + 2;
  return sizes;
}

}  // namespace

template <class Base>
RecordingSizes count_sizes(const Function& function, const std::vector<Print>& prints) {
  return sizes_of<Base>(function, prints);
}

template <class Base>
std::shared_ptr<const Recording<Base>> end_recording(const AD<Base>* x, std::size_t n_x, const AD<Base>* y,
                                                     std::size_t n_y) {
  auto& open = open_tape<Base>();
  if (!open) refuse_recording("ADFun: this thread has no recording open; Independent begins one");
  if (x) check_independents(*open, x, n_x);
  if (n_y == 0) refuse("ADFun: there are no dependent variables, expected at least one");
  const std::unique_ptr<Tape<Base>> tape = std::move(open);
  set_open_tape<Base>(nullptr);
  auto recording = std::make_shared<Recording<Base>>();
  std::vector<NodeId> outputs;
  for (std::size_t i = 0; i < n_y; ++i) {
    outputs.push_back(tape->node(y[i]));
    recording->output_is_parameter.push_back(tape->kind(outputs.back()) != Kind::kVariable);
  }
  for (const auto& print : tape->prints) {
    recording->prints.push_back({outputs.size(), outputs.size() + 1, print.before, print.after});
    outputs.insert(outputs.end(), {print.flag, print.value});
  }
  Function function = live_part(tape->graph, outputs, tape->guards);
  function.name = "cppad";
  function.inputs = {tape->variables.size(), tape->dynamics.size(), tape->captured.size()};
  recording->sizes = sizes_of<Base>(function, recording->prints);
  recording->function = std::make_shared<const Function>(std::move(function));
  recording->range = n_y;
  recording->kernels = std::move(tape->kernels);
  recording->captured = std::move(tape->captured);
  recording->variables = std::move(tape->variables);
  recording->dynamics = std::move(tape->dynamics);
  return recording;
}

#define DYNTAPE_CPPAD_BASE(Base)                                                              \
  template RecordingSizes count_sizes<Base>(const Function&, const std::vector<Print>&);      \
  template std::shared_ptr<const Recording<Base>> end_recording(const AD<Base>*, std::size_t, \
                                                                const AD<Base>*, std::size_t);
DYNTAPE_CPPAD_BASE(float)
DYNTAPE_CPPAD_BASE(double)
DYNTAPE_CPPAD_BASE(AD<double>)
DYNTAPE_CPPAD_BASE(AD<AD<double>>)

}  // namespace detail

template void AD<float>::abort_recording();
template void AD<double>::abort_recording();
template void AD<AD<double>>::abort_recording();
template void AD<AD<AD<double>>>::abort_recording();

}  // namespace dyntape::cppad
