// SPDX-License-Identifier: BSD-3-Clause
//
// Options and result of printing a controller (controller.h).
#pragma once

#include <string>
#include <vector>

#include <dyntape/codegen/pipeline.h>
#include <dyntape/interface/control/discretize/staged_program.h>
#include <dyntape/interface/control/printed/text_count.h>

namespace dyntape {

struct ControllerOptions {
  MeshOptions mesh = {.scheme = runge_kutta_4(1), .intervals = 20, .hessian = HessianKind::kGaussNewton};
  bool single = false;           // float instead of double, throughout
  std::string name = {};         // of the functions; empty: the problem's
  int iterations = 50;           // most that a step may be asked for
  int interior_steps = 15;       // most of a quadratic program
  int trials = 8;                // most of a line search
  double price = 1e3;            // of soft limits: nominal costs per nominal value
  double tolerance = 0;          // change of a solved plan, in nominal values; 0: 1e-4, with float 1e-3
  std::size_t target_bytes = 0;  // of state, stack and constants together; 0: any
  codegen::StackUse stack = {};  // measured stack, for the header
};

// Indices of numbers in the state, which has `numbers` of them and then three integers.
struct ControllerLayout {
  std::size_t z = 0, p = 0, bound = 0, end_bound = 0, gain = 0, begin = 0, cost = 0, violation = 0,
              numbers = 0;
};

struct PrintedController {
  std::string name;        // "lift"
  codegen::Source source;  // text and header
  bool single = false;
  int n_x = 0, n_u = 0, intervals = 0;
  std::vector<double> times;                 // (intervals + 1) s
  std::vector<std::string> bounds;           // "upper limit of force", by entry of the state's `bound`
  std::vector<std::string> parameter_names;  // columns of the state's `p`: "t", then the problem's

  // Bytes.  Constants are tables; code is additional.
  std::size_t state_bytes = 0, constant_bytes = 0, stack_bytes = 0;
  TextCount of_step, of_iteration;  // a step: of_step + iterations * of_iteration, at most
  TextCount of_control;

  ControllerLayout layout;
};

}  // namespace dyntape
