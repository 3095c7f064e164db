// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/rollout/device_rollout.h>

#include <vector>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/graph/function.h>
#include <dyntape/interface/system/run.h>
#include <dyntape/interface/system/steps/record_step.h>
#include <dyntape/interface/system/tied_system.h>

namespace dyntape {

namespace {

constexpr std::size_t kTimes = 2;  // t and h, the first parameters of a step

Function step_for_device(const Scene& scene, const System& system) {
  const std::string where = "roll-out on a device: scene \"" + scene.name + "\" has ";
  if (!scene.robot.constraints.rigid.empty())
    throw ArgumentError(where +
                        "rigid contacts or hard limits, whose steps iterate; expected compliant contacts, or "
                        "a roll-out on the processor");
  if (scene.integrator != Integrator::kSemiImplicitEuler && scene.integrator != Integrator::kRungeKutta4)
    throw ArgumentError(where + "the scheme " + to_string(scene.integrator) + "; expected an explicit one, " +
                        to_string(Integrator::kSemiImplicitEuler) + " or " +
                        to_string(Integrator::kRungeKutta4) + ", or a roll-out on the processor");
  return record_step(system, scene.integrator).end;
}

// The step with the policy's commands: of variables x and parameters (t, h, p); outputs x' and u, which have to be finite.
Function closed_loop(const Function& step, const Function& policy) {
  const std::size_t n_u = step.n_p() - kTimes;
  if (!policy.guards.empty())
    throw ArgumentError("roll-out on a device: policy \"" + policy.name + "\" branches on values (" +
                        policy.guards[0].file + ":" + std::to_string(policy.guards[0].line) +
                        "); expected select, or dyntape.where in Python");
  if (policy.n_x() != step.n_x() || policy.n_y() != n_u || policy.n_w() > 0)
    throw ArgumentError("roll-out on a device: policy \"" + policy.name + "\" takes " +
                        std::to_string(policy.n_x()) + " values and returns " + std::to_string(policy.n_y()) +
                        "; expected " + std::to_string(step.n_x()) + " of the state, and " +
                        std::to_string(n_u) + " commands");
  Function closed;
  closed.name = step.name;
  closed.inputs = {step.n_x(), kTimes + policy.n_p(), 0};
  const std::vector<NodeId> u =
      splice(policy.graph, policy.outputs, closed.graph, [&](Block block, std::uint32_t i) {
        return closed.graph.input(block, block == Block::kParameters ? i + std::uint32_t(kTimes) : i);
      });
  std::vector<NodeId> roots(step.outputs.begin(), step.outputs.end());
  for (const Guard& guard : step.guards) roots.push_back(guard.condition);
  const std::vector<NodeId> ends = splice(step.graph, roots, closed.graph, [&](Block block, std::uint32_t i) {
    return block == Block::kParameters && i >= kTimes ? u[i - kTimes] : closed.graph.input(block, i);
  });
  closed.outputs.assign(ends.begin(), ends.begin() + std::ptrdiff_t(step.outputs.size()));
  closed.outputs.insert(closed.outputs.end(), u.begin(), u.end());
  closed.guards = step.guards;
  for (std::size_t k = 0; k < step.guards.size(); ++k)
    closed.guards[k].condition = ends[step.outputs.size() + k];
  return closed;
}

Function function_for_device(const Scene& scene, const System& system, const Function* policy) {
  const Function step = step_for_device(scene, system);
  return policy ? closed_loop(step, *policy) : step;
}

}  // namespace

DeviceRollout::DeviceRollout(const Scene& scene, const DeviceRunOptions& how, const Function* policy)
    : DeviceRollout(scene, independent_system_of(scene.robot), how, policy) {}

DeviceRollout::DeviceRollout(const Scene& scene, const System& system, const DeviceRunOptions& how,
                             const Function* policy)
    : h_(scene.step),
      n_x_(system.model.nq + system.model.nv + int(lagged_motors(system).size())),
      n_u_(system.n_u),
      loop_(DeviceLoop::make(function_for_device(scene, system, policy),
                             {.shared = kTimes, .constants = policy ? policy->n_p() : 0}, scene.evaluation,
                             how)) {}

void DeviceRollout::run(const Worlds& all, const std::stop_token& stop) const {
  std::vector<double> times;
  const StepRange range{.to = long(all.steps), .h = h_};
  for (long k = range.from; k < range.to; ++k) {
    const StepTime s = range.at(k);
    times.insert(times.end(), {s.t, s.h});
  }
  loop_.run({.count = all.worlds,
             .steps = all.steps,
             .every = all.every,
             .x = all.x0,
             .shared = times.data(),
             .p = all.u,
             .constants = all.p,
             .states = all.states,
             .stride_x = all.x_stride,
             .stride_p = all.u_stride,
             .stride_constants = all.p_stride},
            stop);
}

}  // namespace dyntape
