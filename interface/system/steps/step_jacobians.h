// SPDX-License-Identifier: BSD-3-Clause
//
// Computes the Jacobians of a step, compiled.
//
//   StepJacobians derivatives(system, integrator, options);
//   derivatives.evaluate(z, arguments, x_next);       // unknowns at the solution; (x, t, h, u, p); x'
//   derivatives.matrix()                              // (nt x (nt + n_u + n_p)): A, B and P side by side
//
// Chain rule from point to point (record_step.h), with derivatives by w = (z, dx, u, p): a value a_i of the dynamics
// at a point y_i has the derivatives D_i dy_i/dw, which enter all later values.  At a zero of the residual R,
//   dz/d(dx, u, p) = -R_z^-1 R_(dx, u, p)      dx'/d(dx, u, p) = E_(dx, u, p) + E_z dz/d(dx, u, p)
#pragma once

#include <Eigen/LU>

#include <dyntape/codegen/compiled_function.h>
#include <dyntape/interface/system/steps/record_step.h>

namespace dyntape {

class StepJacobians {
 public:
  StepJacobians(const System& system, Integrator integrator, const CodegenOptions& options);

  void evaluate(const double* z, const double* arguments, const double* x_next);
  const Eigen::MatrixXd& matrix() const { return matrix_; }

  // The compiled functions, and the operations of one evaluation without matrix products.
  std::vector<const CompiledFunction*> functions() const;
  std::size_t operations() const;

 private:
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  struct Kernel {
    Kernel(const Function& function, const CodegenOptions& options);
    void run(std::size_t count = 1);

    CompiledFunction function;
    CompiledFunction::Workspace workspace;
    Eigen::MatrixXd x, p, y;  // one column per point
  };
  void evaluate_kernels(const double* z, const double* arguments, const double* x_next);
  void chain_points();

  RecordedJacobians recorded_;
  int nq_, nv_, nx_, nt_, n_u_, n_p_;
  Kernel points_, dynamics_, chain_;
  Rows rows_;                          // of the chain, by (z, dx, u, p)
  Eigen::MatrixXd slopes_;             // D of a point
  Rows by_all_;                        // D dy/dw
  std::vector<std::size_t> of_point_;  // where the non-zeros of the chain by the values of each point begin
  std::vector<std::uint32_t> order_;   // the non-zeros, by columns
  Eigen::MatrixXd matrix_;
};

}  // namespace dyntape
