// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/robot/robot_evaluator.h>

#include <optional>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/dynamics/algorithms/check_forward_dynamics.h>
#include <dyntape/interface/robot/condition_note.h>
#include <dyntape/interface/robot/robot_differences.h>
#include <dyntape/interface/robot/robot_rows.h>

namespace dyntape {

const char* to_string(RobotRoute route) {
  switch (route) {
    case RobotRoute::kAnalytic:
      return "analytic";
    case RobotRoute::kTape:
      return "tape";
    case RobotRoute::kGenerated:
      return "generated";
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

// One of the four members at the end is there: the way to evaluate.  They refer to each other and to `model`, so
// a Path does not move.
struct RobotEvaluator::Path {
  Path(const dynamics::Model<double>& robot, const RobotFunction& what) : model(robot), function(what) {}

  dynamics::Model<double> model;
  RobotFunction function;
  std::size_t n_in = 0, n_out = 0;

  std::optional<detail::RobotWorkspace<double>> plain;
  std::optional<detail::RobotDifferences> differences;
  std::optional<Interpreter> tape;
  std::optional<Interpreter::Workspace> tape_workspace;
  std::optional<CompiledFunction> compiled;
  std::optional<CompiledFunction::Workspace> workspace;
};

RobotEvaluator::RobotEvaluator(const dynamics::Model<double>& model, const RobotFunction& function,
                               RobotRoute route, const RobotEvaluatorOptions& options)
    : path_(std::make_unique<Path>(model, function)) {
  if (!has_route(function, route)) {
    throw ArgumentError(std::string(to_string(function)) + " is a value: the route \"" + to_string(route) +
                        "\" exists for derivatives only");
  }
  if (is_forward(function)) dynamics::check_forward_dynamics(model);
  detail::note_condition(model, function);
  Path& path = *path_;
  path.plain.emplace(path.model, function);
  path.n_in = path.plain->n_in();
  path.n_out = path.plain->n_out();
  switch (route) {
    case RobotRoute::kAnalytic:
      return;
    case RobotRoute::kTape:
      path.tape.emplace(record_robot_function(model, function, RobotSource::kDifferentiated));
      path.tape_workspace.emplace(*path.tape);
      break;
    case RobotRoute::kGenerated: {
      CodegenOptions codegen = options.codegen;
      codegen.order = Order::kValue;
      path.compiled = CompiledFunction::make(record_robot_function(model, function), codegen);
      path.workspace.emplace(*path.compiled);
      break;
    }
    case RobotRoute::kFdForward:
    case RobotRoute::kFdCentral:
      path.differences.emplace(path.model, function, route == RobotRoute::kFdCentral, options.step);
  }
  path.plain.reset();
}

RobotEvaluator::~RobotEvaluator() = default;
RobotEvaluator::RobotEvaluator(RobotEvaluator&&) noexcept = default;
RobotEvaluator& RobotEvaluator::operator=(RobotEvaluator&&) noexcept = default;

std::size_t RobotEvaluator::n_in() const { return path_->n_in; }
std::size_t RobotEvaluator::n_out() const { return path_->n_out; }

void RobotEvaluator::evaluate(const double* state, double* result) {
  Path& path = *path_;
  if (path.compiled) {
    path.compiled->value(state, nullptr, result, *path.workspace);
  } else if (path.tape) {
    if (const std::uint32_t status = (*path.tape)(state, nullptr, nullptr, result, *path.tape_workspace)) {
      throw GuardViolation(describe_guard(path.tape->function(), status));
    }
  } else if (path.differences) {
    (*path.differences)(state, result);
  } else {
    path.plain->evaluate(state, result);
  }
}

Eigen::VectorXd RobotEvaluator::operator()(const Eigen::Ref<const Eigen::VectorXd>& state) {
  if (static_cast<std::size_t>(state.size()) != n_in()) {
    throw ArgumentError(std::string(to_string(path_->function)) + ": the state has " +
                        std::to_string(state.size()) + " entries, model \"" + path_->model.name +
                        "\" expects " + std::to_string(n_in()));
  }
  Eigen::VectorXd result(static_cast<Eigen::Index>(n_out()));
  evaluate(state.data(), result.data());
  return result;
}

const CompiledFunction* RobotEvaluator::compiled() const {
  return path_->compiled ? &*path_->compiled : nullptr;
}

const Function* RobotEvaluator::recorded() const {
  if (path_->compiled) return &path_->compiled->function();
  return path_->tape ? &path_->tape->function() : nullptr;
}

}  // namespace dyntape
