// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/compiled_function.h>

#include <algorithm>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/lane_widths.h>

namespace dyntape {

struct CompiledFunction::Kernels {
  codegen::Product product;
  CodegenOptions options;
  std::string name;
  Pattern jacobian, hessian;
  std::vector<Interpreter> interpreters;  // by order; empty if compiled
  std::vector<dyntape_kernel> compiled;   // by order; empty if interpreted
  std::vector<dyntape_kernel> wide;       // the same of several lanes; empty if there are none
  std::vector<std::size_t> operations;    // by order

  bool is_compiled() const { return !compiled.empty(); }
  void take_kernels(const dyntape_descriptor& descriptor);
  codegen::PointSizes sizes(std::size_t order) const;
  Violation run_compiled(std::size_t order, const Points& points, Workspace& workspace, bool in_lanes) const;
  Violation run_interpreted(std::size_t order, const Points& points, Workspace& workspace) const;
};

namespace {

constexpr std::size_t kInterpretedTogether = 8;  // points

constexpr const char* kOrderNames[] = {"values", "a Jacobian", "a Hessian"};

Pattern pattern_from(const dyntape_pattern& p) {
  return {p.rows, p.cols, {p.row, p.row + p.nnz}, {p.col, p.col + p.nnz}};
}

// Distances in doubles from one point to the next where there are no gaps.
Strides dense(const codegen::PointSizes& n) { return {n.x, n.p, n.w, n.y, n.jacobian, n.hessian}; }

void copy_out(const double*& from, std::size_t n, double* to) {
  if (to) std::copy(from, from + n, to);
  from += n;
}

template <class T>
T* advanced(T* pointer, std::size_t by) {
  return pointer ? pointer + by : nullptr;
}

}  // namespace

CompiledFunction CompiledFunction::make(const Function& function, const CodegenOptions& options) {
  return from(codegen::produce(function, options), options);
}

CompiledFunction CompiledFunction::from(codegen::Product product, const CodegenOptions& options) {
  auto kernels = std::make_shared<Kernels>();
  kernels->product = std::move(product);
  kernels->options = options;
  kernels->name = options.label.empty() ? kernels->product.function.name : options.label;
  if (const auto& library = kernels->product.library) {
    const dyntape_descriptor& d = library->descriptor();
    kernels->take_kernels(d);
    kernels->jacobian = pattern_from(d.jacobian);
    kernels->hessian = pattern_from(d.hessian);
    for (const dyntape_kernel& kernel : kernels->compiled) kernels->operations.push_back(kernel.operations);
  } else {
    for (Derivatives& d : kernels->product.interpreted) {
      kernels->operations.push_back(total_operations(d.function));
      kernels->jacobian = d.jacobian;
      kernels->hessian = d.hessian;
      kernels->interpreters.emplace_back(std::move(d.function), options.functions);
    }
    kernels->product.interpreted.clear();
  }
  return CompiledFunction(std::move(kernels));
}

// Those of one point, and of the most lanes that the processor has.
void CompiledFunction::Kernels::take_kernels(const dyntape_descriptor& descriptor) {
  for (const dyntape_kernel* k = descriptor.kernels; k != descriptor.kernels + descriptor.n_kernels; ++k) {
    if (k->lane_width == 1) {
      compiled.push_back(*k);
    } else if (k->lane_width <= options.widest_lanes && codegen::has_lanes(k->lane_width)) {
      if (!wide.empty() && wide.back().lane_width < k->lane_width) wide.clear();
      wide.push_back(*k);
    }
  }
  const auto orders = static_cast<std::size_t>(options.order) + 1;
  if (compiled.size() == orders && (wide.empty() || wide.size() == orders)) return;
  throw ToolError("a library of \"" + name + "\" has " + std::to_string(descriptor.n_kernels) + " kernels");
}

codegen::PointSizes CompiledFunction::Kernels::sizes(std::size_t order) const {
  const Function& f = product.function;
  return {f.n_x(),
          f.n_p(),
          f.n_w() + (order > 1 ? f.n_y() : 0),
          f.n_y(),
          order > 0 ? jacobian.nnz() : 0,
          order > 1 ? hessian.nnz() : 0};
}

CompiledFunction::Workspace::Workspace(const CompiledFunction& function) : owner_(function.kernels_) {
  const Kernels& kernels = *function.kernels_;
  std::size_t work = 0, lanes = 0;
  for (const dyntape_kernel& kernel : kernels.compiled) work = std::max(work, kernel.work);
  for (const dyntape_kernel& kernel : kernels.wide)
    lanes = std::max(lanes, codegen::room_for_lanes(kernel, kernels.sizes(kernel.order)));
  for (const Interpreter& interpreter : kernels.interpreters) {
    work = std::max(work, interpreter.function().n_y() * kInterpretedTogether);
    interpreters_.emplace_back(interpreter, kInterpretedTogether);
  }
  work_.resize(work);
  lanes_.resize(lanes);
}

// `in_lanes`: the points lie in blocks already.  Otherwise a single point, also one that is left over, goes
// through the kernel of one.
Violation CompiledFunction::Kernels::run_compiled(std::size_t order, const Points& points,
                                                  Workspace& workspace, bool in_lanes) const {
  std::uint32_t one = 0;
  std::uint32_t* status = points.status;
  const bool guarded = !product.function.guards.empty();
  if (!status && guarded) {
    if (points.lanes > workspace.status_.size() && points.lanes > 1) workspace.status_.resize(points.lanes);
    status = points.lanes > 1 ? workspace.status_.data() : &one;
  }
  const auto run = [&](const dyntape_kernel& kernel, std::size_t first, std::size_t count, const Strides& s,
                       double* work) {
    kernel.run(advanced(points.x, first * s.x), advanced(points.p, first * s.p),
               advanced(points.w, first * s.w), advanced(points.y, first * s.y),
               advanced(points.jacobian, first * s.jacobian), advanced(points.hessian, first * s.hessian),
               work, count, points.strides, advanced(status, first));
  };
  const codegen::PointSizes n = sizes(order);
  const Strides s = points.strides ? *points.strides : dense(n);
  if (in_lanes && !wide.empty()) {
    run(wide[order], 0, points.lanes, s, workspace.lanes_.data());
  } else {
    const std::size_t width = wide.empty() ? 1 : wide[order].lane_width,
                      together = width == 1 ? 0 : points.lanes - (points.lanes % width == 1);
    if (together) {
      codegen::run_in_lanes(wide[order], n,
                            {points.x, points.p, points.w, points.y, points.jacobian, points.hessian}, s,
                            together, workspace.lanes_.data(), status);
    }
    if (together < points.lanes)
      run(compiled[order], together, points.lanes - together, s, workspace.work_.data());
  }
  if (!guarded) return {};
  const auto* found =
      std::find_if(status, status + points.lanes, [](std::uint32_t word) { return word != 0; });
  if (found == status + points.lanes) return {};
  return {*found, static_cast<std::size_t>(found - status)};
}

Violation CompiledFunction::Kernels::run_interpreted(std::size_t order, const Points& points,
                                                     Workspace& workspace) const {
  const codegen::PointSizes n = sizes(order);
  const Interpreter& interpreter = interpreters[order];
  const Strides s = points.strides ? *points.strides : dense(n);
  Violation first;
  for (std::size_t i = 0; i < points.lanes; i += kInterpretedTogether) {
    std::uint32_t status[kInterpretedTogether];
    PointRange range;
    range.points = std::min(points.lanes - i, kInterpretedTogether);
    range.x = advanced(points.x, i * s.x), range.stride_x = s.x;
    range.p = advanced(points.p, i * s.p), range.stride_p = s.p;
    range.w = advanced(points.w, i * s.w), range.stride_w = s.w;
    range.y = workspace.work_.data();
    range.status = status;
    interpreter(range, workspace.interpreters_[order]);
    const double* out = workspace.work_.data();
    for (std::size_t k = i; k < i + range.points; ++k) {
      copy_out(out, n.y, advanced(points.y, k * s.y));
      copy_out(out, n.jacobian, advanced(points.jacobian, k * s.jacobian));
      copy_out(out, n.hessian, advanced(points.hessian, k * s.hessian));
      if (points.status) points.status[k] = status[k - i];
      if (status[k - i] && !first) first = {status[k - i], k};
    }
  }
  return first;
}

Violation CompiledFunction::run(Order order, const Points& points, Workspace& workspace) const {
  require(order, "evaluated");
  if (workspace.owner_ != kernels_)
    throw ArgumentError("\"" + name() + "\" is evaluated with the workspace of another function");
  const auto k = static_cast<std::size_t>(order);
  return kernels_->is_compiled() ? kernels_->run_compiled(k, points, workspace, false)
                                 : kernels_->run_interpreted(k, points, workspace);
}

Violation CompiledFunction::run_in_lanes(Order order, const Points& points, Workspace& workspace) const {
  const std::size_t width = lane_width();
  if (width == 1) return run(order, points, workspace);
  require(order, "evaluated");
  if (workspace.owner_ != kernels_)
    throw ArgumentError("\"" + name() + "\" is evaluated with the workspace of another function");
  if (points.lanes % width != 0)
    throw ArgumentError("run_in_lanes: " + std::to_string(points.lanes) + " points, \"" + name() +
                        "\" expects a multiple of its " + std::to_string(width) + " lanes");
  return kernels_->run_compiled(static_cast<std::size_t>(order), points, workspace, true);
}

void CompiledFunction::check(const Violation& violation, std::size_t lanes) const {
  if (!violation) return;
  throw GuardViolation(describe_guard(function(), violation.guard) +
                       (lanes > 1 ? " (at point " + std::to_string(violation.lane) + ")" : ""));
}

void CompiledFunction::value(const double* x, const double* p, double* y, Workspace& workspace) const {
  require_no_weights("value");
  check(run(Order::kValue, {1, x, p, nullptr, y, nullptr, nullptr, nullptr, nullptr}, workspace));
}

void CompiledFunction::first_order(const double* x, const double* p, double* y, double* jacobian,
                                   Workspace& workspace) const {
  require_no_weights("first_order");
  check(run(Order::kFirst, {1, x, p, nullptr, y, jacobian, nullptr, nullptr, nullptr}, workspace));
}

void CompiledFunction::second_order(const double* x, const double* p, const double* w, double* y,
                                    double* jacobian, double* hessian, Workspace& workspace) const {
  check(run(Order::kSecond, {1, x, p, w, y, jacobian, hessian, nullptr, nullptr}, workspace));
}

CompiledFunction::Evaluation CompiledFunction::evaluate(Order order, const std::vector<double>& x,
                                                        const std::vector<double>& p,
                                                        const std::vector<double>& w) const {
  require(order, "evaluated");
  const auto expect = [&](const char* block, std::size_t found, std::size_t expected) {
    if (found != expected)
      throw ArgumentError(std::string("evaluate: ") + block + " has " + std::to_string(found) +
                          " entries, function \"" + name() + "\" expects " + std::to_string(expected));
  };
  expect("x", x.size(), n_x());
  expect("p", p.size(), n_p());
  expect("w", w.size(), n_w() + (order == Order::kSecond ? n_y() : 0));
  Evaluation result;
  result.y.resize(n_y());
  if (order >= Order::kFirst) result.jacobian.resize(kernels_->jacobian.nnz());
  if (order >= Order::kSecond) result.hessian.resize(kernels_->hessian.nnz());
  Workspace workspace(*this);
  check(run(order,
            {1, x.data(), p.data(), w.data(), result.y.data(), result.jacobian.data(), result.hessian.data(),
             nullptr, nullptr},
            workspace));
  return result;
}

void CompiledFunction::require(Order wanted, const char* what) const {
  if (wanted <= order()) return;
  throw ArgumentError("\"" + name() + "\" was made for order " + std::to_string(static_cast<int>(order())) +
                      " (" + kOrderNames[static_cast<int>(order())] + ") and is " + what + " for order " +
                      std::to_string(static_cast<int>(wanted)) + " (" +
                      kOrderNames[static_cast<int>(wanted)] +
                      "); make it with options.order = " + std::to_string(static_cast<int>(wanted)));
}

void CompiledFunction::require_no_weights(const char* what) const {
  if (n_w() == 0) return;
  throw ArgumentError(std::string(what) + ": \"" + name() + "\" has " + std::to_string(n_w()) +
                      " weights of its own; use run(), which takes them");
}

std::size_t CompiledFunction::n_x() const { return function().n_x(); }
std::size_t CompiledFunction::n_p() const { return function().n_p(); }
std::size_t CompiledFunction::n_w() const { return function().n_w(); }
std::size_t CompiledFunction::n_y() const { return function().n_y(); }
Order CompiledFunction::order() const { return kernels_->options.order; }
const Function& CompiledFunction::function() const { return kernels_->product.function; }
const std::string& CompiledFunction::name() const { return kernels_->name; }

const Pattern& CompiledFunction::jacobian_pattern() const {
  require(Order::kFirst, "asked");
  return kernels_->jacobian;
}

const Pattern& CompiledFunction::hessian_pattern() const {
  require(Order::kSecond, "asked");
  return kernels_->hessian;
}

std::size_t CompiledFunction::lane_width() const {
  return kernels_->wide.empty() ? 1 : kernels_->wide.front().lane_width;
}

Route CompiledFunction::route() const {
  return kernels_->is_compiled() ? Route::kCompiled : Route::kInterpreter;
}
const Timings& CompiledFunction::timings() const { return kernels_->product.timings; }
const std::string& CompiledFunction::source_path() const { return kernels_->product.source_path; }
const std::string& CompiledFunction::compiler() const { return kernels_->product.compiler; }

std::size_t CompiledFunction::operations(Order wanted) const {
  require(wanted, "asked");
  return kernels_->operations[static_cast<std::size_t>(wanted)];
}

}  // namespace dyntape
