// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/robot/robot_evaluator.h>

#include <cmath>
#include <limits>
#include <optional>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/interface/robot/check_accelerations.h>
#include <dyntape/interface/robot/robot_rows.h>

namespace dyntape {
namespace {

// The step that is really taken from x: x + h rounds.
double rounded_step(double x, double step) {
  const volatile double moved = x + step * std::max(1.0, std::abs(x));
  return moved - x;
}

}  // namespace

namespace detail {

// Finite differences of the plain double value, as the header states them.
class RobotDifferences {
 public:
  RobotDifferences(const dynamics::Model<double>& model, const RobotFunction& derivative, bool central,
                   double step);

  // State -> the blocks of the derivative.
  void operator()(const double* state, double* blocks);

 private:
  Eigen::VectorXd value();

  RobotWorkspace<double> work_;
  std::vector<RobotBlock> values_;
  std::vector<int> by_;
  bool central_;
  double step_;
  std::vector<int> scaled_by_;  // (nv) the entry of q that scales the step, or -1
};

RobotDifferences::RobotDifferences(const dynamics::Model<double>& model, const RobotFunction& derivative,
                                   bool central, double step)
    : work_(model, value_of(derivative)),
      values_(outputs(model, value_of(derivative))),
      by_(derived_by(derivative)),
      central_(central),
      step_(step),
      scaled_by_(static_cast<std::size_t>(work_.sizes.nv), -1) {
  const double eps = std::numeric_limits<double>::epsilon();
  if (step_ == 0) step_ = central ? std::cbrt(eps) : std::sqrt(eps);
  for (const auto& joint : model.joints) {
    if (!dynamics::traits(joint.type).on_a_line) continue;
    const auto* mimic = work_.mimic();
    const auto idx_q = static_cast<std::size_t>(joint.idx_q), idx_v = static_cast<std::size_t>(joint.idx_v);
    const int q = mimic ? mimic->q_entries[idx_q].index : joint.idx_q;
    const int v = mimic ? mimic->v_entries[idx_v].index : joint.idx_v;
    scaled_by_[static_cast<std::size_t>(v)] = q;  // a follower's are its leader's
  }
}

Eigen::VectorXd RobotDifferences::value() {
  Eigen::VectorXd y(static_cast<Eigen::Index>(work_.n_out()));
  work_.run();
  work_.write(y.data());
  return y;
}

void RobotDifferences::operator()(const double* state, double* blocks) {
  const int n = work_.sizes.nv;
  work_.read(state);
  const Eigen::VectorXd here = value(), q = work_.state.q;
  // `place(h)` moves one entry of the state by h.
  const auto difference = [&](double h, auto place) -> Eigen::VectorXd {
    place(h);
    const Eigen::VectorXd ahead = value();
    if (!central_) return (ahead - here) / h;
    place(-h);
    return (ahead - value()) / (2 * h);
  };
  const auto slope = [&](int input, int k) {
    if (input == 0) {
      const int entry = scaled_by_[static_cast<std::size_t>(k)];
      const Eigen::VectorXd s = difference(entry < 0 ? step_ : rounded_step(q[entry], step_), [&](double h) {
        work_.state.q = work_.integrate(q, h * Eigen::VectorXd::Unit(n, k));
      });
      work_.state.q = q;
      return s;
    }
    double& x = (input == 1 ? work_.state.v : work_.state.w)[k];
    const double there = x;
    const Eigen::VectorXd s = difference(rounded_step(x, step_), [&](double h) { x = there + h; });
    x = there;
    return s;
  };

  for (std::size_t j = 0; j < by_.size(); ++j) {
    for (int k = 0; k < n; ++k) {
      const Eigen::VectorXd column = slope(by_[j], k);
      int first = 0;
      for (const RobotBlock& value : values_) {
        const int block = first * static_cast<int>(by_.size()) + static_cast<int>(j) * value.size();
        for (int i = 0; i < value.size(); ++i) blocks[(block + i) * n + k] = column[first + i];
        first += value.size();
      }
    }
  }
}

}  // namespace detail

const char* to_string(RobotRoute route) {
  switch (route) {
    case RobotRoute::kAnalytic:
      return "analytic";
    case RobotRoute::kTape:
      return "tape";
    case RobotRoute::kGenerated:
      return "generated";
    case RobotRoute::kMachineCode:
      return "machine-code";
    case RobotRoute::kFdForward:
      return "fd-forward";
    case RobotRoute::kFdCentral:
      break;
  }
  return "fd-central";
}

RobotRoute robot_route_from(const std::string& word) {
  std::string choices;
  for (RobotRoute route : kRobotRoutes) {
    if (word == to_string(route)) return route;
    choices += std::string(choices.empty() ? "" : ", ") + to_string(route);
  }
  throw ArgumentError("there is no route \"" + word + "\"; choose one of " + choices);
}

bool has_route(const RobotFunction& function, RobotRoute route) {
  return is_derivative(function) || (route != RobotRoute::kFdForward && route != RobotRoute::kFdCentral);
}

// One of the three ways to evaluate is there.  They refer to `model`, so a Path does not move.
struct RobotEvaluator::Path {
  Path(const dynamics::Model<double>& robot, const RobotFunction& what) : model(robot), function(what) {}

  // Recorded, then interpreted or compiled.
  void record(RobotSource source, CodegenOptions options) {
    options.order = Order::kValue;
    compiled = CompiledFunction::make(record_robot_function(model, function, source), options);
    workspace.emplace(*compiled);
  }

  dynamics::Model<double> model;
  RobotFunction function;
  std::size_t n_in = 0, n_out = 0;

  std::optional<detail::RobotWorkspace<double>> plain;
  std::optional<detail::RobotDifferences> differences;
  std::optional<CompiledFunction> compiled;
  std::optional<CompiledFunction::Workspace> workspace;
};

RobotEvaluator::RobotEvaluator(const dynamics::Model<double>& model, const RobotFunction& function,
                               RobotRoute route, const RobotEvaluatorOptions& options)
    : path_(std::make_unique<Path>(model, function)) {
  if (!has_route(function, route))
    throw ArgumentError(std::string(to_string(function)) + " is a value: the route \"" + to_string(route) +
                        "\" exists for derivatives only");
  detail::check_accelerations(model, function);
  Path& path = *path_;
  path.plain.emplace(path.model, function);
  path.n_in = path.plain->n_in();
  path.n_out = path.plain->n_out();
  if (route == RobotRoute::kAnalytic) return;
  path.plain.reset();
  if (route == RobotRoute::kTape) {
    path.record(RobotSource::kDifferentiated, {.route = Route::kInterpreter});
  } else if (route == RobotRoute::kGenerated || route == RobotRoute::kMachineCode) {
    CodegenOptions codegen = options.codegen;
    if (route == RobotRoute::kMachineCode) codegen.route = Route::kMachineCode;
    path.record(RobotSource::kShortest, codegen);
  } else {
    path.differences.emplace(path.model, function, route == RobotRoute::kFdCentral, options.step);
  }
}

RobotEvaluator::~RobotEvaluator() = default;
RobotEvaluator::RobotEvaluator(RobotEvaluator&&) noexcept = default;
RobotEvaluator& RobotEvaluator::operator=(RobotEvaluator&&) noexcept = default;

std::size_t RobotEvaluator::n_in() const { return path_->n_in; }
std::size_t RobotEvaluator::n_out() const { return path_->n_out; }

void RobotEvaluator::evaluate(const double* state, double* result) {
  Path& path = *path_;
  if (path.compiled) return path.compiled->value(state, nullptr, result, *path.workspace);
  if (path.differences) return (*path.differences)(state, result);
  path.plain->evaluate(state, result);
}

Eigen::VectorXd RobotEvaluator::operator()(const Eigen::Ref<const Eigen::VectorXd>& state) {
  if (static_cast<std::size_t>(state.size()) != n_in())
    throw ArgumentError(std::string(to_string(path_->function)) + ": the state has " +
                        std::to_string(state.size()) + " entries, model \"" + path_->model.name +
                        "\" expects " + std::to_string(n_in()));
  Eigen::VectorXd result(static_cast<Eigen::Index>(n_out()));
  evaluate(state.data(), result.data());
  return result;
}

const CompiledFunction* RobotEvaluator::compiled() const {
  return path_->compiled ? &*path_->compiled : nullptr;
}

}  // namespace dyntape
