// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/simulate/effect_costs.h>

#include <algorithm>
#include <chrono>

#include <dyntape/autodiff/record/record.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/robot/robot_functions.h>
#include <dyntape/interface/system/tied_system.h>

namespace dyntape {

namespace {

// The shortest of several runs: what else goes on only ever adds.
double seconds_of(const CompiledFunction& f, Order order) {
  using Clock = std::chrono::steady_clock;
  constexpr int kRuns = 40;
  constexpr double kRun = 5e-4;
  CompiledFunction::Workspace workspace(f);
  const std::vector<double> x(f.n_x(), 0.3);
  std::vector<double> y(f.n_y()), J(order == Order::kFirst ? f.jacobian_pattern().nnz() : 0);
  const auto run = [&](int count) {
    const auto begin = Clock::now();
    for (int i = 0; i < count; ++i) {
      if (order == Order::kFirst) f.first_order(x.data(), nullptr, y.data(), J.data(), workspace);
      if (order == Order::kValue) f.value(x.data(), nullptr, y.data(), workspace);
    }
    return std::chrono::duration<double>(Clock::now() - begin).count();
  };
  int count = 1;
  while (run(count) < kRun && count < (1 << 24)) count *= 2;
  double least = run(count);
  for (int i = 1; i < kRuns; ++i) least = std::min(least, run(count));
  return least / count;
}

// Without loops and contacts; with mimic joints those of the independent joints.
Function accelerations_of(RobotScene scene) {
  if (scene.mimics.empty()) return record_forward_dynamics(scene.model, scene.effects);
  scene.constraints = {};
  const System system = independent_system_of(scene);
  const int nq = system.model.nq, nv = system.model.nv;
  return record(scene.model.name + "_accelerations", std::size_t(nq + nv + system.n_u), 0,
                [&](const VectorXad& x, const VectorXad&) {
                  return system.acceleration({0, x.head(nq), x.segment(nq, nv), x.tail(system.n_u), {}});
                });
}

FunctionCost operator-(const FunctionCost& a, const FunctionCost& b) {
  const auto less = [](const Cost& x, const Cost& y) {
    return Cost{x.operations - y.operations, x.seconds - y.seconds};
  };
  return {less(a.value, b.value), less(a.jacobian, b.jacobian)};
}

std::string operations_text(const Cost& cost) { return io::with_groups(cost.operations); }

// A difference of two measured times: below zero it is less than they scatter.
std::string time_text(const Cost& cost) {
  if (cost.seconds < 0) return "~ 0";
  return cost.seconds == 0 ? "" : io::significant(1e9 * cost.seconds, 3);
}

}  // namespace

FunctionCost scene_cost(const RobotScene& scene, const CodegenOptions& options, bool measured) {
  CodegenOptions how = options;
  how.order = Order::kFirst;
  if (!measured) how.route = Route::kInterpreter;
  const Function f = accelerations_of(scene);
  const CompiledFunction ready = CompiledFunction::make(f, how);
  FunctionCost cost;
  cost.value.operations = long(ready.operations(Order::kValue));
  cost.jacobian.operations = long(ready.operations(Order::kFirst));
  if (!measured) return cost;
  cost.value.seconds = seconds_of(ready, Order::kValue);
  cost.jacobian.seconds = seconds_of(ready, Order::kFirst);
  return cost;
}

std::vector<EffectCost> effect_costs(const RobotScene& scene, const CodegenOptions& options, bool measured) {
  const FunctionCost all = scene_cost(scene, options, measured);
  std::vector<EffectCost> costs;
  RobotScene without = scene;
  dynamics::for_each_effect(without.effects, [&](auto& effect) {
    EffectCost cost{dynamics::effect_name(effect), bool(effect), {}};
    if (cost.acts) {
      const auto kept = effect;
      effect.reset();
      cost.added = all - scene_cost(without, options, measured);
      effect = kept;
    }
    costs.push_back(std::move(cost));
  });
  return costs;
}

std::string robot_text(const RobotScene& scene, const std::string& urdf,
                       const std::vector<std::string>& notes) {
  double mass = 0;
  for (const auto& inertia : scene.model.inertias) mass += inertia.mass;
  const int independent = scene.model.nv - int(scene.mimics.size());
  std::string text = "Robot \"" + scene.model.name + "\" (" + urdf + "): " + std::to_string(independent) +
                     " degrees of freedom, " + std::to_string(actuated_dofs(scene).size()) + " driven, " +
                     io::significant(mass, 6) + " kg moving, " +
                     (floats(scene.model) ? "floating" : "fixed") + " base\n";
  for (const std::string& note : notes) text += "  note: " + note + "\n";
  return text;
}

std::string effects_text(const std::vector<EffectCost>& costs) {
  const bool measured = std::any_of(costs.begin(), costs.end(),
                                    [](const EffectCost& cost) { return cost.added.value.seconds != 0; });
  std::vector<io::TextColumn> columns = {{"effect"},
                                         {"acts"},
                                         {"operations it adds", "", io::Align::kRight},
                                         {"with Jacobian", "", io::Align::kRight}};
  if (measured) {
    columns.push_back({"value", "ns", io::Align::kRight});
    columns.push_back({"with Jacobian", "ns", io::Align::kRight});
  }
  io::TextTable table(columns);
  for (const EffectCost& cost : costs) {
    std::vector<std::string> row = {cost.name, cost.acts ? "yes" : "no",
                                    cost.acts ? operations_text(cost.added.value) : "not recorded",
                                    cost.acts ? operations_text(cost.added.jacobian) : ""};
    if (measured) {
      row.push_back(cost.acts ? time_text(cost.added.value) : "");
      row.push_back(cost.acts ? time_text(cost.added.jacobian) : "");
    }
    table.append(row);
  }
  return table.text();
}

std::string constraints_text(const RobotScene& scene) {
  std::string text;
  for (const std::string& name : scene.constraints.loop_names) text += "  loop: " + name + "\n";
  for (const auto& contact : scene.constraints.rigid.contacts) {
    text += "  rigid contact: " + contact.name + ", friction " + io::significant(contact.friction, 3) +
            ", restitution " + io::significant(contact.restitution, 3) + "\n";
  }
  for (const auto& stop : scene.constraints.rigid.stops)
    text += "  hard limit: " + stop.name + " at " + io::significant(stop.limit, 6) + "\n";
  return text.empty() ? "" : "\nConstraints, besides the accelerations above:\n" + text;
}

}  // namespace dyntape
