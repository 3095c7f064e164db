// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/compiled_function.h>

#include <algorithm>
#include <functional>
#include <mutex>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/run/threads.h>
#include <dyntape/codegen/tiers.h>

namespace dyntape {
namespace {

using codegen::Kernels;
using codegen::Place;

constexpr const char* kOrderNames[] = {"values", "a Jacobian", "a Hessian"};

// In as many parts as there are places, at multiples of `width`; the violation of the first point that has one.
// Nothing is allocated.
Violation run_in_threads(Order order, const Points& points, const Strides& strides, std::size_t width,
                         const std::vector<std::unique_ptr<Place>>& places) {
  const std::size_t blocks = (points.count + width - 1) / width,
                    parts = std::clamp<std::size_t>(blocks, 1, places.size());
  std::mutex mutex;
  Violation first;
  const auto run_part = [&](std::size_t k) {
    const auto bound = [&](std::size_t part) {
      return std::min(blocks * part / parts * width, points.count);
    };
    const std::size_t begin = bound(k), end = bound(k + 1);
    Place::Room& now = places[k]->now();
    Violation found = now.kernels.run(order, codegen::part_of(points, strides, begin, end - begin), now.room);
    if (!found) return;
    found.point += begin;
    const std::scoped_lock lock(mutex);
    if (!first || found.point < first.point) first = found;
  };
  codegen::run_tasks(parts, std::ref(run_part));  // a reference: nothing is allocated
  return first;
}

// Without gaps, also those of blocks side by side.
Strides dense(Strides sizes, std::size_t width) {
  for (std::size_t* n : {&sizes.x, &sizes.p, &sizes.w, &sizes.y, &sizes.jacobian, &sizes.hessian})
    *n *= width;
  return sizes;
}

}  // namespace

CompiledFunction CompiledFunction::make(const Function& function, const CodegenOptions& options) {
  auto [tiers, builder] = codegen::make_tiers(function, options);
  return CompiledFunction(std::move(tiers), std::move(builder));
}

CompiledFunction::Workspace::Workspace(const CompiledFunction& function, unsigned threads) {
  if (threads == 0) threads = codegen::thread_count();
  if (threads > 1)
    codegen::run_tasks(threads, [](std::size_t) {});  // they are made now, not by the first evaluation
  for (unsigned k = 0; k < threads; ++k) places_.push_back(std::make_unique<Place>(function.tiers_));
}

CompiledFunction::Workspace::~Workspace() = default;
CompiledFunction::Workspace::Workspace(Workspace&&) noexcept = default;
CompiledFunction::Workspace& CompiledFunction::Workspace::operator=(Workspace&&) noexcept = default;

void CompiledFunction::require_fit(const Points& points, const Workspace& workspace) const {
  if (workspace.places_.empty() || !workspace.places_.front()->is_of(*tiers_))
    throw ArgumentError("\"" + name() + "\" is evaluated with the workspace of another function");
  const std::size_t width = points.side_by_side;
  if (width == 1) return;
  if (width != lane_width() || points.count % width != 0)
    throw ArgumentError("run: " + std::to_string(points.count) + " points, " + std::to_string(width) +
                        " side by side; \"" + name() + "\" expects a multiple of its " +
                        std::to_string(lane_width()) + " lanes");
}

// A call of one point takes tens of nanoseconds: what is refused is looked for here, and said elsewhere.
Violation CompiledFunction::run(Order order, const Points& points, Workspace& workspace) const {
  const auto& places = workspace.places_;
  if (order > tiers_->first().order) require(order, "evaluated");
  if (points.side_by_side != 1 || places.empty() || !places.front()->is_of(*tiers_))
    require_fit(points, workspace);
  Place::Room& now = places.front()->now();
  if (places.size() == 1 || points.count < 2) return now.kernels.run(order, points, now.room);
  const Strides strides =
      points.strides ? *points.strides : dense(now.kernels.sizes(order), points.side_by_side);
  return run_in_threads(order, points, strides, now.kernels.lane_width(), places);
}

bool CompiledFunction::run_without_workspace(Order order, const Points& point, Violation& violation) const {
  if (order > tiers_->first().order) require(order, "evaluated");
  return !builder_ && tiers_->first().run_on_stack(order, point, violation);
}

dyntape_run CompiledFunction::kernel_without_workspace(Order order) const {
  require(order, "evaluated");
  return builder_ ? nullptr : tiers_->first().kernel_on_stack(order);
}

void CompiledFunction::check(const Violation& violation, std::size_t points) const {
  if (!violation) return;
  throw GuardViolation(describe_guard(function(), violation.guard) +
                       (points > 1 ? " (at point " + std::to_string(violation.point) + ")" : ""));
}

void CompiledFunction::value(const double* x, const double* p, double* y, Workspace& workspace) const {
  if (function().n_w() != 0) require_no_weights("value");
  const Violation violation = run(Order::kValue, {.x = x, .p = p, .y = y}, workspace);
  if (violation) check(violation);
}

void CompiledFunction::first_order(const double* x, const double* p, double* y, double* jacobian,
                                   Workspace& workspace) const {
  if (function().n_w() != 0) require_no_weights("first_order");
  const Violation violation = run(Order::kFirst, {.x = x, .p = p, .y = y, .jacobian = jacobian}, workspace);
  if (violation) check(violation);
}

void CompiledFunction::second_order(const double* x, const double* p, const double* w, double* y,
                                    double* jacobian, double* hessian, Workspace& workspace) const {
  check(run(Order::kSecond, {.x = x, .p = p, .w = w, .y = y, .jacobian = jacobian, .hessian = hessian},
            workspace));
}

CompiledFunction::Evaluation CompiledFunction::evaluate(Order order, Numbers x, Numbers p, Numbers w) const {
  require(order, "evaluated");
  const Strides n = tiers_->first().sizes(order);
  const auto expect = [&](const char* block, std::size_t found, std::size_t expected) {
    if (found != expected)
      throw ArgumentError(std::string("evaluate: ") + block + " has " + std::to_string(found) +
                          " entries, function \"" + name() + "\" expects " + std::to_string(expected));
  };
  expect("x", x.size(), n.x);
  expect("p", p.size(), n.p);
  expect("w", w.size(), n.w);
  Evaluation r{std::vector<double>(n.y), std::vector<double>(n.jacobian), std::vector<double>(n.hessian)};
  Workspace workspace(*this);
  check(run(order,
            {.x = x.data(),
             .p = p.data(),
             .w = w.data(),
             .y = r.y.data(),
             .jacobian = r.jacobian.data(),
             .hessian = r.hessian.data()},
            workspace));
  return r;
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
Order CompiledFunction::order() const { return tiers_->first().order; }
const Function& CompiledFunction::function() const { return tiers_->first().product.function; }
const std::string& CompiledFunction::name() const { return tiers_->first().name; }

const Pattern& CompiledFunction::jacobian_pattern() const {
  require(Order::kFirst, "asked");
  return tiers_->first().jacobian;
}

const Pattern& CompiledFunction::hessian_pattern() const {
  require(Order::kSecond, "asked");
  return tiers_->first().hessian;
}

// Of the first tier: what points are kept in does not change while they are kept.
std::size_t CompiledFunction::lane_width() const { return tiers_->first().lane_width(); }

Route CompiledFunction::route() const {
  switch (tiers_->serving().tier()) {
    case Tier::kInterpreted:
      return Route::kInterpreter;
    case Tier::kMachineCode:
      return Route::kMachineCode;
    default:
      return Route::kCompiled;
  }
}
const Timings& CompiledFunction::timings() const { return tiers_->serving().product.timings; }
const std::string& CompiledFunction::source_path() const { return tiers_->serving().product.source_path; }
const std::string& CompiledFunction::compiler() const { return tiers_->serving().product.compiler; }

std::size_t CompiledFunction::operations(Order wanted) const {
  require(wanted, "asked");
  return tiers_->serving().operations[static_cast<std::size_t>(wanted)];
}

Tier CompiledFunction::tier() const { return tiers_->tier(); }
bool CompiledFunction::is_settled() const { return tiers_->is_settled(); }
void CompiledFunction::wait() const { tiers_->wait(); }
std::string CompiledFunction::trouble() const { return tiers_->trouble(); }

}  // namespace dyntape
