// SPDX-License-Identifier: BSD-3-Clause
// The program of the README: your own cost on a robot, with exact derivatives from compiled C.
#include <iostream>

#include <dyntape/autodiff/record/record.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/urdf/urdf.h>

using namespace dyntape;

int main(int argc, char** argv) {
  const auto arm = dynamics::load_urdf(argc > 1 ? argv[1] : "config/robots/panda.urdf");
  const auto taped = arm.cast<AD>();
  const int hand = arm.frame_index("panda_hand");

  // Squared distance of the hand from a target: joint positions are variables, the target is a parameter.
  const Function distance = record("distance", arm.nq, 3, [&](const VectorXad& q, const VectorXad& target) {
    dynamics::Data<AD> data(taped);
    dynamics::forward_kinematics<AD>(taped, data, q);
    return VectorXad::Constant(1, (dynamics::frame_placement(taped, data, hand).p - target).squaredNorm());
  });

  CodegenOptions options;
  options.order = Order::kSecond;
  const auto compiled = CompiledFunction::make(distance, options);  // derived, printed, compiled, cached
  const auto r = compiled.evaluate(Order::kSecond, {0.3, -0.5, 0, -2, 0, 1.5, 0.5, 0, 0}, {0.5, 0, 0.5}, {1});
  std::cout << "distance^2 " << r.y[0] << ", " << r.hessian.size() << " second derivatives, "
            << compiled.operations(Order::kSecond) << " operations\n";
  // Non-zeros of the derivatives: entry k is at jacobian_pattern().row[k], .col[k].  The hand does not depend on the
  // fingers' joints.
  const Pattern& pattern = compiled.jacobian_pattern();
  for (std::size_t k = 0; k < pattern.nnz(); ++k)
    std::cout << "  by q" << pattern.col[k] << "  " << r.jacobian[k] << "\n";
}
