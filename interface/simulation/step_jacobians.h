// SPDX-License-Identifier: BSD-3-Clause
//
// The Jacobians of a step that was taken, compiled.
//
//   StepJacobians slopes(record_jacobians(system, integrator), sizes, options);
//   slopes.evaluate(z, arguments, x_next);       // unknowns at the solution; (x, t, h, u, p); x'
//   slopes.matrix()                              // (nt x (nt + n_u + n_p)): A, B and P side by side
//
// With y = (dx, u, p):  dx' = E_y dy + E_z dz  and  0 = R_y dy + R_z dz,  so  dx'/dy = E_y - E_z R_z^-1 R_y.
#pragma once

#include <Eigen/LU>

#include <dyntape/codegen/compiled_function.h>
#include <dyntape/interface/simulation/record_step.h>

namespace dyntape {

class StepJacobians {
 public:
  StepJacobians(const RecordedJacobians& recorded, int nx, int n_z, int nt, const CodegenOptions& options);

  void evaluate(const double* z, const double* arguments, const double* x_next);
  const Eigen::MatrixXd& matrix() const { return matrix_; }
  const CompiledFunction& function() const { return function_; }

 private:
  Pattern pattern_;
  CompiledFunction function_;
  CompiledFunction::Workspace workspace_;
  int nx_, n_z_, nt_;
  Eigen::VectorXd variables_, parameters_, non_zeros_;
  Eigen::MatrixXd all_, matrix_;
};

}  // namespace dyntape
