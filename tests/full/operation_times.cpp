// SPDX-License-Identifier: BSD-3-Clause
//
// Whether the time that a scene takes follows the operations that --explain counts: thirty scenes, the accelerations of
// each and their Jacobian, least squares of ns by operations.  The exit status is 1 where R^2 is not above 0.98.
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <dyntape/interface/scene/effect_costs.h>
#include <dyntape/interface/scene/scene.h>

namespace {

using namespace dyntape;

struct Robot {
  std::string file, base;
};
const std::vector<Robot> kRobots = {{"pendulum", "fixed"},
                                    {"ur5", "fixed"},
                                    {"panda", "fixed"},
                                    {"solo12", "floating"},
                                    {"simple_humanoid", "floating"}};
const std::string kFriction = "joint_friction\n{\ntorque 0.2\nsmoothing 0.01\n}\n";
const std::string kSprings = "joint_springs\n{\nstiffness 5\n}\n";
const std::string kMotors =
    "armature\n{\nrotor_inertia 1e-3\ngear_ratio 9\n}\ntorque_saturation\n{\nlimit 20\nkind smooth\n}\n";
const std::vector<std::string> kEffects = {"gravity off\ncoriolis off\n",
                                           "gravity off\n",
                                           "joint_damping 0.1\n",
                                           "joint_damping 0.1\n" + kFriction + kSprings,
                                           "joint_damping 0.1\n" + kFriction + kMotors,
                                           "joint_damping 0.1\n" + kSprings + kMotors};

double r_squared(const std::vector<double>& x, const std::vector<double>& y) {
  const auto centred = [](const std::vector<double>& all) {
    const Eigen::VectorXd v = Eigen::Map<const Eigen::VectorXd>(all.data(), Eigen::Index(all.size()));
    return Eigen::VectorXd(v.array() - v.mean());
  };
  const Eigen::VectorXd a = centred(x), b = centred(y);
  return a.dot(b) * a.dot(b) / (a.squaredNorm() * b.squaredNorm());
}

int run(const std::string& root) {
  std::vector<double> operations, seconds, jacobian_operations, jacobian_seconds;
  std::printf("%-18s %10s %8s %10s %8s\n", "robot", "operations", "ns", "Jacobian", "ns");
  for (const Robot& robot : kRobots) {
    for (const std::string& effects : kEffects) {
      const std::string text = "robot\n{\nurdf " + root + "/config/robots/" + robot.file + ".urdf\nbase " +
                               robot.base + "\n}\neffects\n{\n" + effects +
                               "\n}\nsimulation\n{\nduration 1\n}\n";
      const Scene scene = read_scene_text(text, root + "/(operation_times)");
      const FunctionCost cost = scene_cost(scene.robot, scene.evaluation, true);
      operations.push_back(double(cost.value.operations));
      seconds.push_back(cost.value.seconds);
      jacobian_operations.push_back(double(cost.jacobian.operations));
      jacobian_seconds.push_back(cost.jacobian.seconds);
      std::printf("%-18s %10ld %8.0f %10ld %8.0f\n", robot.file.c_str(), cost.value.operations,
                  1e9 * cost.value.seconds, cost.jacobian.operations, 1e9 * cost.jacobian.seconds);
    }
  }
  const double value = r_squared(operations, seconds);
  const double jacobian = r_squared(jacobian_operations, jacobian_seconds);
  std::printf("R^2 %.4f, of Jacobians %.4f\n", value, jacobian);
  return value > 0.98 && jacobian > 0.98 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc > 1 ? argv[1] : ".");
  } catch (const std::exception& e) {
    std::fprintf(stderr, "operation_times: %s\n", e.what());
    return 2;
  }
}
