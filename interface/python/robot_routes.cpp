// SPDX-License-Identifier: BSD-3-Clause
#include "robot_routes.h"

#include <Eigen/Core>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/device_function.h>
#include <dyntape/codegen/run/workspace_pool.h>
#include <dyntape/interface/robot/robot_evaluator.h>

#include "robots/lanes_route.h"

namespace dyntape::python {
namespace {

// Plain double code, and differences of it.
class PlainRoute final : public RobotPath {
 public:
  PlainRoute(const dynamics::Model<double>& model, const RobotFunction& function, RobotRoute route)
      : model_(model), function_(function), route_(route) {
    is_brief = route == RobotRoute::kAnalytic;
    const auto evaluator = pool_.take([&] { return made(); });
    n_in = evaluator->n_in();
    n_out = evaluator->n_out();
  }

  void evaluate(const double* states, std::size_t count, double* results) override {
    const auto evaluator = pool_.take([&] { return made(); });
    for (std::size_t i = 0; i < count; ++i) evaluator->evaluate(states + i * n_in, results + i * n_out);
  }

 private:
  std::unique_ptr<RobotEvaluator> made() const {
    return std::make_unique<RobotEvaluator>(model_, function_, route_);
  }

  const dynamics::Model<double>& model_;
  const RobotFunction function_;
  const RobotRoute route_;
  dyntape::detail::WorkspacePool<RobotEvaluator> pool_;
};

// A recording, interpreted or compiled.
class RecordedRoute final : public RobotPath {
 public:
  RecordedRoute(const dynamics::Model<double>& model, const RobotFunction& function, RobotRoute route,
                Lanes lanes, const std::stop_token& stop)
      : RecordedRoute(RobotEvaluator(model, function, route, options(lanes, stop))) {}

  void evaluate(const double* states, std::size_t count, double* results) override {
    const auto workspace = pool_.take([&] { return made(); });
    Points points;
    points.count = count, points.x = states, points.y = results;
    function_.check(function_.run(Order::kValue, points, *workspace), count);
  }

 private:
  explicit RecordedRoute(const RobotEvaluator& evaluator) : function_(*evaluator.compiled()) {
    n_in = function_.n_x();
    n_out = function_.n_y();
  }

  static RobotEvaluatorOptions options(Lanes lanes, const std::stop_token& stop) {
    RobotEvaluatorOptions options;
    options.codegen.stop = stop;
    options.codegen.lanes = lanes;
    return options;
  }

  std::unique_ptr<CompiledFunction::Workspace> made() const {
    return std::make_unique<CompiledFunction::Workspace>(function_);
  }

  const CompiledFunction function_;
  dyntape::detail::WorkspacePool<CompiledFunction::Workspace> pool_;
};

class DeviceRoute final : public RobotPath {
 public:
  DeviceRoute(const dynamics::Model<double>& model, const RobotFunction& function, const RobotDevice& device)
      : function_(DeviceFunction::make(record_robot_function(model, function, RobotSource::kAnalytic),
                                       {.order = Order::kValue},
                                       {.device = device.name, .single = device.single})) {
    is_device = true;
    n_in = function_.function().n_x();
    n_out = function_.function().n_y();
  }

  void evaluate(const double* states, std::size_t count, double* results) override {
    Points points;
    points.count = count, points.x = states, points.y = results;
    function_.check(function_.run(Order::kValue, points), count);
  }

 private:
  const DeviceFunction function_;
};

std::shared_ptr<RobotPath> unshaped_route(const dynamics::Model<double>& model, const RobotFunction& function,
                                          const std::string& word, const RobotDevice& device, bool many,
                                          const std::stop_token& stop) {
  if (!device.name.empty()) return std::make_shared<DeviceRoute>(model, function, device);
  if (word == kLanes) return make_lanes_route(model, function);
  RobotRoute route;
  try {
    route = robot_route_from(word);
  } catch (const ArgumentError& e) {
    throw ArgumentError(std::string(e.what()) + ", " + kLanes);
  }
  if (route == RobotRoute::kTape || route == RobotRoute::kGenerated || route == RobotRoute::kMachineCode)
    return std::make_shared<RecordedRoute>(model, function, route, many ? Lanes::kNative : Lanes::kNone,
                                           stop);
  return std::make_shared<PlainRoute>(model, function, route);
}

}  // namespace

std::vector<std::string> extents_of(const std::string& shape) {
  std::vector<std::string> extents;
  if (shape == "1") return extents;
  std::size_t from = 0;
  for (std::size_t at; (at = shape.find(" x ", from)) != shape.npos; from = at + 3)
    extents.push_back(shape.substr(from, at - from));
  extents.push_back(shape.substr(from));
  return extents;
}

std::vector<Block> blocks_of(const dynamics::Model<double>& model, const RobotFunction& function) {
  std::vector<Block> blocks;
  for (const RobotBlock& output : outputs(model, function)) {
    const int extents[] = {output.rows, output.cols, output.pages};
    blocks.push_back({output.name, Shape(extents, extents + extents_of(output.shape).size())});
  }
  return blocks;
}

std::shared_ptr<RobotPath> make_route(const dynamics::Model<double>& model, const RobotFunction& function,
                                      const std::string& word, const RobotDevice& device, bool many,
                                      const std::stop_token& stop) {
  std::shared_ptr<RobotPath> route = unshaped_route(model, function, word, device, many, stop);
  route->blocks = blocks_of(model, function);
  return route;
}

void evaluate(RobotPath& route, const Rows& rows, double* results) {
  constexpr std::size_t kBriefOutputs = 256;
  const auto part = [&](std::size_t first, std::size_t count, const double* states) {
    double* const y = results + first * route.n_out;
    route.evaluate(states, count, y);
    Eigen::Map<Eigen::ArrayXd>(y, Eigen::Index(count * route.n_out)) += 0.0;  // -0 becomes 0
  };
  if (route.is_device) return for_parts(rows, route.n_in + route.n_out, part);
  if (rows.is_single() && route.is_brief && route.n_out <= kBriefOutputs) return for_one(rows, part);
  for_chunks(rows, part);
}

}  // namespace dyntape::python
