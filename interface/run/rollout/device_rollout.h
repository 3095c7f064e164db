// SPDX-License-Identifier: BSD-3-Clause
//
// Many motions of a scene on a device of OpenCL: one kernel takes many steps of thousands of worlds (codegen/device_loop.h).
//
//   const Scene scene = read_scene("config/scenes/quadruped_explicit.info");
//   const DeviceRollout rollout(scene, {.device = "opencl:0"});                 // records the step, compiles the kernel
//   std::vector<double> ends(worlds * n_x);
//   rollout.run({.worlds = worlds, .steps = 500, .every = 500, .x0 = x0, .u = u, .states = ends.data(), .x_stride = n_x});
//
// In place of commands a recorded function may close the loop at the beginning of each step, u = f(x, p), with parameters of each
// world or for all.
//
// States, commands and steps are those of SceneRollout (scene_rollout.h).  The bits are the same too if the step calls no
// elementary function of the device (codegen/device/print_device.h); friction calls tanh, exponents of contacts pow.
// If a world has no step, its states are NaN from there on.
//
// Errors: those of DeviceLoop.  ArgumentError: rigid contacts or hard limits, an implicit or adaptive scheme, a
// policy that branches on values or does not fit the scene.
#pragma once

#include <stop_token>

#include <dyntape/codegen/device_loop.h>
#include <dyntape/interface/files/scene/scene.h>

namespace dyntape {

class DeviceRollout {
 public:
  // policy: of the state, and parameters, to the commands; null: commands are given.
  DeviceRollout(const Scene& scene, const DeviceRunOptions& how, const Function* policy = nullptr);

  int n_x() const { return n_x_; }
  int n_u() const { return n_u_; }

  // Strides are in doubles, from world to world; 0: one row for all.
  struct Worlds {
    std::size_t worlds = 0, steps = 0, every = 1;
    const double* x0 = nullptr;  // (n_x) of each world
    const double* u = nullptr;   // (steps x n_u) of each world; or
    const double* p = nullptr;   // (n_p) of the policy, of each world
    double* states = nullptr;    // (steps / every x n_x) of each world: those after every `every`-th step
    std::size_t x_stride = 0, u_stride = 0, p_stride = 0;
  };
  void run(const Worlds& all, const std::stop_token& stop = {}) const;

 private:
  DeviceRollout(const Scene& scene, const System& system, const DeviceRunOptions& how,
                const Function* policy);

  double h_;
  int n_x_, n_u_;
  DeviceLoop loop_;
};

}  // namespace dyntape
