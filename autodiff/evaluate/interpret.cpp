// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/evaluate/interpret.h>

#include <algorithm>
#include <memory>
#include <mutex>

#include <dyntape/autodiff/error.h>

namespace dyntape {

Interpreter::Interpreter(Function function, Functions functions)
    : function_(std::move(function)), functions_(functions) {
  check(function_);
  std::map<const Callee*, std::size_t> known;
  link(function_, known);
}

// Appends the programs of the recorded callees, each once, and that of the function; its number.
std::size_t Interpreter::link(const Function& function, std::map<const Callee*, std::size_t>& known) {
  std::vector<std::size_t> callees;
  std::size_t call_space = 0;
  for (const auto& callee : function.graph.callees()) {
    call_space = std::max(call_space, callee->n_in + callee->n_out);
    auto found = known.find(callee.get());
    if (found == known.end()) {
      const Recorded* const recorded = callee->recorded();
      const std::size_t number = recorded ? link(*recorded->function, known) : detail::LinkedProgram::kKernel;
      found = known.emplace(callee.get(), number).first;
    }
    callees.push_back(found->second);
  }
  programs_.push_back({detail::Program(function), std::move(callees), call_space});
  return programs_.size() - 1;
}

Interpreter::Workspace::Workspace(const Interpreter& interpreter, std::size_t points)
    : one_(interpreter.programs_.begin(), interpreter.programs_.end()) {
  if (points > 1) many_ = {interpreter.programs_.begin(), interpreter.programs_.end()};
}

std::uint32_t Interpreter::operator()(const double* x, const double* p, const double* w, double* y,
                                      Workspace& workspace) const {
  const detail::LaneView<const double> inputs[kBlocks] = {{x, 1, 0}, {p, 1, 0}, {w, 1, 0}};
  std::uint32_t status = 0;
  detail::run<1>(functions_, programs_, programs_.size() - 1, inputs, {y, 1, 0}, workspace.one_, 1, &status);
  return status;
}

namespace {

// Below so many points it is cheaper to take them one by one than to fill up the lanes.
constexpr std::size_t kWorthLanes = 3;

std::size_t stride(std::size_t given, std::size_t entries) {
  return given == PointRange::kDense ? entries : given;
}

template <class T>
T* advanced(T* data, std::size_t by) {
  return data ? data + by : nullptr;
}

}  // namespace

void Interpreter::operator()(const PointRange& range, Workspace& workspace) const {
  std::size_t i = 0;
  while (!workspace.many_.empty() && range.points - i >= kWorthLanes) {
    const std::size_t lanes = std::min<std::size_t>(range.points - i, detail::kLanes);
    run_lanes(range, i, static_cast<int>(lanes), workspace.many_);
    i += lanes;
  }
  for (; i < range.points; ++i) run_lanes(range, i, 1, workspace.one_);
}

template <int N>
void Interpreter::run_lanes(const PointRange& range, std::size_t first, int lanes,
                            std::vector<detail::LaneRoom<N>>& rooms) const {
  const std::size_t x = stride(range.stride_x, function_.n_x()), p = stride(range.stride_p, function_.n_p()),
                    w = stride(range.stride_w, function_.n_w()), y = stride(range.stride_y, function_.n_y());
  const detail::LaneView<const double> inputs[kBlocks] = {{advanced(range.x, first * x), 1, x},
                                                          {advanced(range.p, first * p), 1, p},
                                                          {advanced(range.w, first * w), 1, w}};
  std::uint32_t status[N];
  detail::run<N>(functions_, programs_, programs_.size() - 1, inputs, {advanced(range.y, first * y), 1, y},
                 rooms, lanes, status);
  if (range.status) std::copy_n(status, lanes, range.status + first);
}

std::string describe_guard(const Function& function, std::uint32_t status) {
  const Guard& guard = function.guards.at(status - 1);
  return "\"" + function.name + "\": the comparison at " + guard.file + ":" + std::to_string(guard.line) +
         " was " + (guard.expected ? "true" : "false") + " when recorded and is " +
         (guard.expected ? "false" : "true") +
         " now; record again at a point of this branch, or record both branches: select(condition, a, b), "
         "numpy.where in Python";
}

void detail::check_sizes(const Function& function, std::size_t x, std::size_t p, std::size_t w) {
  const std::size_t given[] = {x, p, w};
  const char* const blocks[] = {"x", "p", "w"};
  for (int b = 0; b < kBlocks; ++b) {
    if (given[b] != function.inputs[b]) {
      throw ArgumentError(std::string("evaluate: ") + blocks[b] + " has " + std::to_string(given[b]) +
                          " entries, function \"" + function.name + "\" expects " +
                          std::to_string(function.inputs[b]));
    }
  }
}

std::shared_ptr<const Function> detail::recorded_form(const Callee& callee) {
  if (const Recorded* recorded = callee.recorded()) return recorded->function;
  const auto& unrolled = callee.kernel()->unrolled;
  return unrolled ? unrolled() : nullptr;
}

std::vector<double> evaluate(const Function& function, Numbers x, Numbers p, Numbers w) {
  detail::check_sizes(function, x.size(), p.size(), w.size());
  const Interpreter run(function);
  Interpreter::Workspace workspace(run);
  std::vector<double> y(function.n_y());
  const std::uint32_t status = run(x.data(), p.data(), w.data(), y.data(), workspace);
  if (status) throw GuardViolation(describe_guard(function, status));
  return y;
}

void evaluate(const Callee& callee, const double* in, double* out) {
  if (const Kernel* kernel = callee.kernel()) return kernel->evaluate(in, out);
  static std::mutex mutex;
  std::shared_ptr<const Interpreter> run;
  {
    const std::scoped_lock lock(mutex);
    auto& program = callee.made.program;
    if (!program) program = std::make_shared<Interpreter>(*callee.recorded()->function);
    run = program;
  }
  Interpreter::Workspace workspace(*run);
  (*run)(in, nullptr, nullptr, out, workspace);
}

}  // namespace dyntape
