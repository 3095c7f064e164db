// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/rollout/device_rollout.h>

#include <vector>

#include <dyntape/autodiff/error.h>
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

}  // namespace

DeviceRollout::DeviceRollout(const Scene& scene, const std::string& device)
    : DeviceRollout(scene, independent_system_of(scene.robot), device) {}

DeviceRollout::DeviceRollout(const Scene& scene, const System& system, const std::string& device)
    : h_(scene.step),
      n_x_(system.model.nq + system.model.nv + int(lagged_motors(system).size())),
      n_u_(system.n_u),
      loop_(DeviceLoop::make(step_for_device(scene, system), kTimes, scene.evaluation, {.device = device})) {}

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
             .states = all.states,
             .stride_x = all.x_stride,
             .stride_p = all.u_stride},
            stop);
}

}  // namespace dyntape
