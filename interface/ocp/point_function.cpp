// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/ocp/point_function.h>

#include <algorithm>
#include <optional>

#include <dyntape/autodiff/interpret.h>

namespace dyntape {

namespace {

// One order of derivatives: an interpreter with its workspace and a place for the outputs of a point.
struct Route {
  explicit Route(Derivatives derivatives)
      : d(std::move(derivatives)), run(d.function), workspace(run), out(d.function.n_y()) {}

  Derivatives d;
  Interpreter run;
  Interpreter::Workspace workspace;
  std::vector<double> out;
};

}  // namespace

struct PointFunction::Routes {
  Function function;
  std::vector<Route> routes;  // by order
  std::string complaint;
  BuildReport build;

  bool evaluate(Order order, std::size_t points, const double* z, const double* p, const double* w, double* y,
                double* jacobian, double* hessian) {
    Route& route = routes[static_cast<std::size_t>(order)];
    const std::size_t n_y = route.d.n_y, n_j = route.d.jacobian.nnz(), n_h = route.d.hessian.nnz();
    for (std::size_t i = 0; i < points; ++i) {
      const std::uint32_t status = route.run(z + i * function.n_x(), p + i * function.n_p(),
                                             w ? w + i * n_y : nullptr, route.out.data(), route.workspace);
      if (status != 0) {
        complaint = describe_guard(function, status) + ", at point " + std::to_string(i);
        return false;
      }
      const double* out = route.out.data();
      std::copy(out, out + n_y, y + i * n_y);
      if (n_j > 0) std::copy(out + n_y, out + n_y + n_j, jacobian + i * n_j);
      if (n_h > 0) std::copy(out + n_y + n_j, out + n_y + n_j + n_h, hessian + i * n_h);
    }
    complaint.clear();
    return true;
  }
};

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

PointFunction::PointFunction(const Function& function, std::size_t points, Order order,
                             const EvaluationOptions&)
    : routes_(std::make_unique<Routes>()), points_(points), n_y_(function.n_y()) {
  routes_->function = function;
  for (int k = 0; k <= static_cast<int>(order); ++k) {
    routes_->routes.emplace_back(derive(function, static_cast<Order>(k)));
  }
}

PointFunction::~PointFunction() = default;
PointFunction::PointFunction(PointFunction&&) noexcept = default;

const Pattern& PointFunction::jacobian() const { return routes_->routes.back().d.jacobian; }
const Pattern& PointFunction::hessian() const { return routes_->routes.back().d.hessian; }
const BuildReport& PointFunction::build() const { return routes_->build; }
std::string PointFunction::complaint() const { return routes_->complaint; }

bool PointFunction::values(const double* z, const double* p, double* y) {
  return routes_->evaluate(Order::kValue, points_, z, p, nullptr, y, nullptr, nullptr);
}

bool PointFunction::first(const double* z, const double* p, double* y, double* jacobian) {
  return routes_->evaluate(Order::kFirst, points_, z, p, nullptr, y, jacobian, nullptr);
}

bool PointFunction::second(const double* z, const double* p, const double* w, double* y, double* jacobian,
                           double* hessian) {
  return routes_->evaluate(Order::kSecond, points_, z, p, w, y, jacobian, hessian);
}

std::string PointFunction::first_not_finite(std::size_t i, const double* z, const double* p) const {
  const Interpreter run(routes_->function);
  Interpreter::Workspace workspace(run);
  std::vector<double> y(n_y_);
  const Function& f = routes_->function;
  run(z + i * f.n_x(), p + i * f.n_p(), nullptr, y.data(), workspace);
  return run.first_not_finite(workspace);
}

}  // namespace dyntape
