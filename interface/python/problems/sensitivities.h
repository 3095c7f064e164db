// SPDX-License-Identifier: BSD-3-Clause
//
// Derivatives of an optimal motion, as Python has them: of a Solution, and of a controller's plan.
//
//   MotionSensitivity derivatives(problem, mesh);
//   return ProblemSensitivities{derivatives.at(now, solution), motion, problem};       // dyntape.Sensitivities
#pragma once

#include <dyntape/interface/control/sensitivity/motion_sensitivities.h>

namespace dyntape::python {

struct ProblemSensitivities {
  ProblemSensitivities(MotionSensitivities derivatives, Trajectory of, const Problem& problem)
      : found(std::move(derivatives)),
        motion(std::move(of)),
        n_x(problem.n_x()),
        first_a(n_x + (problem.free_time ? 1 : 0)),
        first_u(first_a + problem.n_a()),
        n_z(first_u + problem.n_u()) {}

  MotionSensitivities found;
  Trajectory motion;                   // its points and scheme
  Eigen::Index n_x;                    // states
  Eigen::Index first_a, first_u, n_z;  // within a point; its entries
};

}  // namespace dyntape::python
