// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/transcription/point_function.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/parallel.h>

namespace dyntape {

namespace {

CodegenOptions unless_empty(const Function& function, CodegenOptions options) {
  if (function.n_y() == 0) options.route = Route::kInterpreter;  // there is nothing to compile
  return options;
}

const Pattern kNoPattern;

}  // namespace

void BuildReport::add(const BuildReport& other) {
  derive += other.derive;
  print += other.print;
  compile += other.compile;
  load += other.load;
  compiled += other.compiled;
  from_cache += other.from_cache;
  interpreted += other.interpreted;
  sources.insert(sources.end(), other.sources.begin(), other.sources.end());
}

struct PointFunction::Routes {
  Routes(const Function& function, const CodegenOptions& options, unsigned threads)
      : compiled(CompiledFunction::make(function, unless_empty(function, options))),
        workspaces(make_workspaces(compiled, threads)) {
    const Timings& t = compiled.timings();
    build.derive = t.derive;
    build.print = t.schedule + t.print;
    build.compile = t.compile;
    build.load = t.hash + t.load;
    const bool interpreted = compiled.route() == Route::kInterpreter;
    build.interpreted = interpreted && function.n_y() > 0;
    build.from_cache = t.cache_hit;
    build.compiled = !interpreted && !t.cache_hit;
    if (!compiled.source_path().empty()) build.sources.push_back(compiled.source_path());
  }

  Routes(const CompiledFunction& ready, unsigned threads)
      : compiled(ready), workspaces(make_workspaces(compiled, threads)) {}

  bool evaluate(Order order, const Points& points) {
    violation = run_parallel(compiled, order, points, workspaces);
    lanes = points.lanes;
    return !violation;
  }

  CompiledFunction compiled;
  std::vector<CompiledFunction::Workspace> workspaces;  // one a thread
  BuildReport build;
  Violation violation;
  std::size_t lanes = 0;
};

PointFunction::PointFunction(const Function& function, std::size_t points, const CodegenOptions& options,
                             unsigned threads)
    : routes_(std::make_unique<Routes>(function, options, threads)), points_(points), n_y_(function.n_y()) {}

PointFunction::PointFunction(const PointFunction& ready, std::size_t points, unsigned threads)
    : routes_(std::make_unique<Routes>(ready.routes_->compiled, threads)),
      points_(points),
      n_y_(ready.n_y_) {}

PointFunction::~PointFunction() = default;
PointFunction::PointFunction(PointFunction&&) noexcept = default;

const Pattern& PointFunction::jacobian() const { return routes_->compiled.jacobian_pattern(); }
const Pattern& PointFunction::hessian() const {
  return routes_->compiled.order() == Order::kSecond ? routes_->compiled.hessian_pattern() : kNoPattern;
}
const BuildReport& PointFunction::build() const { return routes_->build; }

bool PointFunction::values(const double* z, const double* p, double* y) {
  return routes_->evaluate(Order::kValue, {.lanes = points_, .x = z, .p = p, .y = y});
}

bool PointFunction::first(const double* z, const double* p, double* y, double* jacobian) {
  return routes_->evaluate(Order::kFirst, {.lanes = points_, .x = z, .p = p, .y = y, .jacobian = jacobian});
}

bool PointFunction::second(const double* z, const double* p, const double* w, double* y, double* jacobian,
                           double* hessian) {
  return routes_->evaluate(
      Order::kSecond,
      {.lanes = points_, .x = z, .p = p, .w = w, .y = y, .jacobian = jacobian, .hessian = hessian});
}

std::string PointFunction::complaint() const {
  try {
    routes_->compiled.check(routes_->violation, routes_->lanes);
  } catch (const GuardViolation& e) {
    return e.what();
  }
  return "";
}

std::string PointFunction::first_not_finite(std::size_t i, const double* z, const double* p) const {
  const Function& f = routes_->compiled.function();
  return dyntape::first_not_finite(f, z + i * f.n_x(), p + i * f.n_p(), nullptr);
}

}  // namespace dyntape
