// SPDX-License-Identifier: BSD-3-Clause
//
// Co-design: how the holding torques of an arm change with its lengths and masses, and a lighter arm by Newton steps
// on its design.
#include <cstdio>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/robot/model_parameters.h>

using namespace dyntape;

int main(int argc, char** argv) {
  const auto arm = dynamics::load_urdf(argc > 1 ? argv[1] : "config/robots/ur5.urdf");
  const ModelParameters design(
      arm, {"length:wrist_1_joint", "mass:forearm_link", "comx:forearm_link", "gravity:z"});

  // Holding torque of shoulder and elbow at a posture: variables are the design, the posture is a parameter.
  const Function holding =
      record_design(arm, design, 6, [](const dynamics::Model<AD>& robot, const VectorXad& q) {
        dynamics::Data<AD> data(robot);
        return VectorXad(dynamics::generalized_gravity<AD>(robot, data, q).segment(1, 2));
      });
  const Derivatives derived = derive(holding, Order::kFirst);
  const std::vector<double> posture = {0, -0.6, 0.9, 0, 0, 0};
  std::vector<double> values = design.nominal();
  std::vector<double> y = evaluate(derived.function, values, posture);
  std::printf("holding torques %.3f and %.3f N m\n", y[0], y[1]);
  for (std::size_t k = 0; k < derived.jacobian.nnz(); ++k) {
    std::printf("  joint %u by %-22s %9.3f\n", derived.jacobian.row[k] + 1,
                design.names()[derived.jacobian.col[k]].c_str(), y[2 + k]);
  }

  // How much shorter must the forearm be for the elbow to hold a tenth less?  Newton on one design variable.
  const double wanted = 0.9 * y[1];
  for (int i = 0; i < 10; ++i) {
    y = evaluate(derived.function, values, posture);
    for (std::size_t k = 0; k < derived.jacobian.nnz(); ++k) {
      if (derived.jacobian.row[k] == 1 && derived.jacobian.col[k] == 0)
        values[0] += (wanted - y[1]) / y[2 + k];
    }
  }
  y = evaluate(derived.function, values, posture);
  std::printf("forearm at %.4f of its length: elbow holds %.3f N m, wanted %.3f\n", values[0], y[1], wanted);

  // The robot with that design, in plain double: the same torque.
  const auto lighter = design.apply<double>(Eigen::Map<const Eigen::VectorXd>(values.data(), 4));
  dynamics::Data<double> data(lighter);
  const Eigen::VectorXd g =
      dynamics::generalized_gravity(lighter, data, Eigen::Map<const Eigen::VectorXd>(posture.data(), 6));
  return std::abs(g[2] - wanted) < 1e-10 && values[0] > 0 && values[0] < 1 ? 0 : 1;
}
