// SPDX-License-Identifier: BSD-3-Clause
//
// A cost on joint torques with the analytic derivatives of inverse dynamics: the recording calls the robot instead
// of recording its statements.
#include <iostream>

#include <dyntape/autodiff/record/record.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/robot/robot_callee.h>

using namespace dyntape;

int main(int argc, char** argv) {
  const auto arm = dynamics::load_urdf(argc > 1 ? argv[1] : "config/robots/ur5.urdf");
  const auto torques = inverse_dynamics_callee(arm);  // (q, v, a) -> tau

  // Variables: q, v, a; parameters: one weight per joint.
  const auto effort = [&](const VectorXad& x, const VectorXad& weights) {
    return VectorXad::Constant(1, weights.dot(call(torques, x).cwiseAbs2()));
  };
  const Function f = record("effort", torques->n_in, arm.nv, effort);

  CodegenOptions options;
  options.order = Order::kSecond;
  const auto compiled = CompiledFunction::make(f, options);
  std::vector<double> x(torques->n_in, 0.1);
  const auto r = compiled.evaluate(Order::kSecond, x, std::vector<double>(arm.nv, 1e-3), {1});
  std::cout << "effort " << r.y[0] << ", " << r.jacobian.size() << " derivatives, " << r.hessian.size()
            << " second derivatives, " << compiled.operations(Order::kSecond) << " operations\n";
}
